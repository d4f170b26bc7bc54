"""The contract of an effect: what a missing piece of physics may change, one method an equation.

An effect is an immutable module whose coefficients are `parameter` fields. With its switches at their base value
(usually zero) every method must return exactly what the base model has, so that the extended model contains the base
model. The default methods below change nothing; an effect overrides the one equation it is about.
"""

from __future__ import annotations

import abc
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, ClassVar, NamedTuple

import equinox as eqx

from smajax.model.types import Scalar, WireState

if TYPE_CHECKING:
    from smajax.model.load.base import AbstractMovingLoad
    from smajax.model.system import System
    from smajax.model.wire.conditions import AbstractConditions
    from smajax.model.wire.kinetics import Kinetics
    from smajax.model.wire.wire import Wire


PRESLIDING = 5e-5  # m, where nothing is known of it: asperities bend by micrometres before they slip (Dahl 1968)


class Extent(NamedTuple):
    """How far the runs of an experiment go."""

    seconds: float  # length of one
    stroke: float  # between the smallest and the largest reading of all, SI
    increment: float  # from one level to the next where the readings lie on levels, SI; 0 where they do not


class AbstractEffect(eqx.Module):
    """One candidate for what a model lacks."""

    effect_name: ClassVar[str]  # "latent_heat"
    title: ClassVar[str]  # "latent heat of transformation"
    equation: ClassVar[str]  # heat, electrical, kinetics, constitutive, mechanics, sensor, input
    formula: ClassVar[str]  # plain text, with its source
    sentence: ClassVar[str]  # for an engineer: what its presence means
    # Coefficients that switch the effect on: their base value is zero and the score test looks at them. The others
    # (a width, a scale) mean nothing until a switch is off zero and keep their default until then.
    switches: ClassVar[tuple[str, ...]]
    # Whether it is a matter of seconds: it means nothing where the samples of a log have no times.
    needs_time: ClassVar[bool] = False
    # Whether the load may stick and jump with it: then what a fit gains by it may be the integration's
    # (`attribution.steady`).
    jumps: ClassVar[bool] = False
    # Where a refit begins, per coefficient: off the base value, because a coefficient that starts on its bound at
    # zero stays there.
    starts: ClassVar[dict[str, float]]

    @classmethod
    @abc.abstractmethod
    def base(cls) -> AbstractEffect:
        """The effect at its base value: present in the equations and changing nothing."""

    @classmethod
    def shows(cls, extent: Extent) -> bool:
        """Whether runs of that extent could show it: a candidate that they cannot is not looked at."""
        return True

    @classmethod
    def places(cls, extent: Extent) -> tuple[dict[str, float], ...]:
        """Values of the coefficients that are no switches at which the score test looks too, beside `starts`."""
        return ()

    @classmethod
    def spans(cls, extent: Extent) -> dict[str, tuple[float, float]]:
        """Bounds of coefficients in the unit of the reading, by the runs: what is wide in metres is narrow in radians."""
        return {}

    @classmethod
    def begins(cls, told: Mapping[str, float]) -> dict[str, tuple[float, float]]:
        """Ranges of coefficients, positive, from all over which a refit begins where the misfit has many valleys.

        `told`: the score test's switches.
        """
        return {}

    @classmethod
    def applies(cls, system: System) -> bool:
        """Whether it can change anything of this wire, load and drive: a candidate that cannot is not looked at."""
        return True

    def stored_heat(self, wire: Wire, temperature: Scalar, fraction: Scalar) -> Scalar | float:
        """Heat stored per metre beside m c_p T, J/m."""
        return 0.0

    def heat_of_change(self, wire: Wire, old: WireState, temperature: Scalar, fraction: Scalar) -> Scalar | float:
        """Heat per metre that the way from `old` takes and that is no function of the state, J/m."""
        return 0.0

    def heat_loss(self, wire: Wire, temperature: Scalar, ambient: Scalar) -> Scalar | float:
        """Heat lost per metre beside h_c A_c (T - T_inf), W/m."""
        return 0.0

    def convection_change(self, time: Scalar) -> Scalar | float:
        """Relative change of h_c, -."""
        return 0.0

    def ambient_shift(self, time: Scalar) -> Scalar | float:
        """Added to the ambient temperature, C."""
        return 0.0

    def resistance_factor(self, temperature: Scalar, fraction: Scalar) -> Scalar | float:
        """Relative change of the resistance per metre, -."""
        return 0.0

    def command(self, channel: str, value: Scalar) -> Scalar:
        """What the drive makes of the `value` recorded on one of its channels, in the channel's unit."""
        return value

    def series_resistance(self) -> Scalar | float:
        """Resistance between the supply and the wire, ohm."""
        return 0.0

    def current_sag(self) -> Scalar | float:
        """Relative fall of the supply per ampere that it is asked for, 1/A."""
        return 0.0

    def supply_drop(self, old: WireState, current: Scalar, per_volt: Scalar) -> Scalar | float:
        """Voltage that the supply has lost at the end of a step from `old`, V.

        `current` (A, the mean) is what a rested supply gives, `per_volt` (A/V) by how much that falls per volt lost.
        """
        return 0.0

    def kept_after_current(self, old: WireState, current: Scalar, per_volt: Scalar) -> dict[str, Scalar]:
        """What it remembers of the current after such a step: entries of `WireState.kept` that `kept_after` leaves alone."""
        return {}

    def heating_shape(self, z: Scalar, remaining: Scalar) -> Scalar:
        """Share of martensite left at the reduced distance z = (y_A - A_s)/(A_f - A_s); 1 far below, 0 far above."""
        return remaining

    def cooling_shape(self, z: Scalar, remaining: Scalar) -> Scalar:
        """Share of austenite left at the reduced distance z = (y_M - M_f)/(M_s - M_f); 0 far below, 1 far above."""
        return remaining

    def shapes(self) -> bool:
        """Whether it changes the shape of a branch: then the two are no mirror images."""
        own, base = type(self), AbstractEffect
        return own.heating_shape is not base.heating_shape or own.cooling_shape is not base.cooling_shape

    def heating_distance(self, law: Kinetics, z: Scalar, temperature: Scalar, stress: Scalar, old: WireState) -> Scalar:
        """The reduced distance itself, from what the law has; `old` is the wire before the step."""
        return z

    def cooling_distance(self, law: Kinetics, z: Scalar, temperature: Scalar, stress: Scalar, old: WireState) -> Scalar:
        """Likewise on cooling."""
        return z

    def displaces(self) -> bool:
        """Whether it moves a range: the direction of a step is then that of the moved distance."""
        own, base = type(self), AbstractEffect
        return own.heating_distance is not base.heating_distance or own.cooling_distance is not base.cooling_distance

    def second_conditions(self) -> tuple[AbstractConditions, Scalar] | None:
        """Branch conditions that a share of the wire follows in the place of the law's, and that share, -."""
        return None

    def kept_at_start(self, temperature: Scalar, stress: Scalar, fraction: Scalar) -> dict[str, Scalar]:
        """What it remembers of the wire from step to step, by name, at rest: an entry of `WireState.kept` each."""
        return {}

    def kept_after(self, old: WireState, temperature: Scalar, stress: Scalar, fraction: Scalar) -> dict[str, Scalar]:
        """The same entries after a step from `old` to (`temperature`, `stress`, `fraction`)."""
        return {}

    def kept_strain(self, at: WireState) -> Scalar | float:
        """Strain beside that of `strain` which depends on what is kept, a function of `at`, -."""
        return 0.0

    def strain(
        self, wire: Wire, temperature: Scalar, stress: Scalar, fraction: Scalar, detwinned: Scalar
    ) -> Scalar | float:
        """Strain beside eps_L xi_s and the elastic part, a function of state, -; `detwinned` is xi_s."""
        return 0.0

    def modulus_change(self, wire: Wire, fraction: Scalar) -> Scalar | float:
        """Added to Young's modulus of the base model, Pa; the sum must stay above zero."""
        return 0.0

    def friction_limit(self) -> Scalar | float:
        """Largest friction of the load at rest, N (N m for an arm)."""
        return 0.0

    def friction_share(self) -> Scalar | float:
        """Largest friction at rest that grows with the load, over the load at rest at its start, -."""
        return 0.0

    def friction_level(self, speed: Scalar) -> Scalar | float:
        """Such a friction while it slips over that at rest, -, at a speed of the wire's moving end, m/s."""
        return 1.0

    def presliding(self) -> Scalar | float:
        """Motion of the wire's moving end over which such a friction builds up, m."""
        return PRESLIDING

    def loose_length(self) -> Scalar | float:
        """By how much the wire is longer than its way at the start of a run, m; of a load that rests on its end stop."""
        return 0.0

    def resisting_force(self, load: AbstractMovingLoad, displacement: Scalar, speed: Scalar) -> Scalar | float:
        """Force against contraction beside the load's, N; displacement (m) and speed (m/s) are the wire's moving end's."""
        return 0.0

    def load_change(self, time: Scalar) -> Scalar | float:
        """Relative change of the load's weight and springs, -."""
        return 0.0

    def input_lag(self, time: Scalar) -> Scalar | float:
        """By how much the drive's input is older at `time` than recorded, s. `simulate` heeds it, a closed loop refuses it."""
        return 0.0

    def sensor_time_constant(self) -> Scalar | float:
        """Time constant of a first-order sensor, s."""
        return 0.0

    recalls: ClassVar[bool] = False  # whether `sensed` needs its own last reading

    def sensed(self, reading: Scalar, time: Scalar, last: Scalar) -> Scalar:
        """What the sensor shows where it would show `reading`, the lag included; `last`: what this gave before."""
        return reading

    def senses(self) -> bool:
        """Whether it changes what the sensor shows."""
        return type(self).sensed is not AbstractEffect.sensed


def having(effects: Sequence[AbstractEffect], method: str) -> list[AbstractEffect]:
    """Those of `effects` that override `method`: where there are none, it is not even traced."""
    return [effect for effect in effects if getattr(type(effect), method) is not getattr(AbstractEffect, method)]
