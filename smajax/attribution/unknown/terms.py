"""Unknown terms: a smooth function of one state put into one equation, for what no effect of the library accounts for.

They are effects like any other, but no candidates: a function of eleven coefficients says where something is missing and
what it looks like, not what it is. With all coefficients zero each leaves the base model as it is.
"""

from __future__ import annotations

import dataclasses
from typing import ClassVar, Self

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from smajax.attribution.unknown.spline import COUNT, powers_of, spline
from smajax.core.parameters import parameter
from smajax.model.drive.inputs import CommandTerm
from smajax.model.effects.base import AbstractEffect
from smajax.model.effects.candidate import Candidate, Equation
from smajax.model.load.base import AbstractMovingLoad
from smajax.model.load.force import EndMotion, ForceTerm
from smajax.model.sensor_reading import SensorTerm
from smajax.model.types import Scalar, WireState
from smajax.model.wire.constitutive import ConstitutiveTerm
from smajax.model.wire.heat import HeatState, HeatTerm
from smajax.model.wire.kinetics_terms import ShapeTerm
from smajax.model.wire.resistance import ResistanceTerm
from smajax.model.wire.wire import Wire

FORMULA = "f: eleven cosine waves as cubic B-splines, each coefficient about twice its share of the usual largest f"
COEFFICIENTS = tuple(f"c{wave}" for wave in range(COUNT))
LEAST_RESISTANCE = 0.1  # of the base model's


def _candidate(title: str, equation: Equation) -> Candidate:
    sentence, guess = "Something that the library does not hold.", dict.fromkeys(COEFFICIENTS, 0.0)
    return Candidate(
        title=title,
        equation=equation,
        formula=FORMULA,
        sentence=sentence,
        switches=COEFFICIENTS,
        initial_guess=guess,
    )


class AbstractUnknown(AbstractEffect):
    r"""$f(x) = s \sum_k c_k W_k\big((x - x_0)/w\big)$ of one state x, held outside of x_0..x_0 + w.

    The wave $W_k = \frac12 (1 + (k/2)^4)^{-1/2} \sum_j \cos\big(\pi k (j + 1/2)/11\big) B_j$ has k half periods, of eleven cubic B-splines $B_j$.
    """

    c0: Scalar = parameter("-", -4.0, 4.0, "twice f/s of the constant", default=0.0)
    c1: Scalar = parameter("-", -4.0, 4.0, "size of the wave of one half period", default=0.0)
    c2: Scalar = parameter("-", -4.0, 4.0, "size of the wave of two half periods", default=0.0)
    c3: Scalar = parameter("-", -4.0, 4.0, "size of the wave of three half periods", default=0.0)
    c4: Scalar = parameter("-", -4.0, 4.0, "size of the wave of four half periods", default=0.0)
    c5: Scalar = parameter("-", -4.0, 4.0, "size of the wave of five half periods", default=0.0)
    c6: Scalar = parameter("-", -4.0, 4.0, "size of the wave of six half periods", default=0.0)
    c7: Scalar = parameter("-", -4.0, 4.0, "size of the wave of seven half periods", default=0.0)
    c8: Scalar = parameter("-", -4.0, 4.0, "size of the wave of eight half periods", default=0.0)
    c9: Scalar = parameter("-", -4.0, 4.0, "size of the wave of nine half periods", default=0.0)
    c10: Scalar = parameter("-", -4.0, 4.0, "size of the wave of ten half periods", default=0.0)
    low: Scalar = eqx.field(converter=jnp.asarray, default=0.0)  # x_0, in the state's unit
    width: Scalar = eqx.field(converter=jnp.asarray, default=1.0)  # w
    scale: Scalar = eqx.field(converter=jnp.asarray, default=1.0)  # s, in the function's unit
    powers: Float[Array, 11] | None = None  # what `prepared` computes

    symbol: ClassVar[str]  # of the state
    state: ClassVar[str]  # the state in words
    state_unit: ClassVar[str]
    unit: ClassVar[str]  # of the function
    only_changes: ClassVar[bool] = False  # whether a constant f is none: drawn about its mean over the samples then

    def prepared(self) -> Self:
        """The same with the spline of its waves computed."""
        return dataclasses.replace(self, powers=self._powers())

    def _powers(self) -> Float[Array, 11]:
        return self.scale * powers_of([getattr(self, name) for name in COEFFICIENTS])

    def value(self, x: Scalar) -> Scalar:
        """f(x)."""
        own = self._powers() if self.powers is None else self.powers
        return spline(own, (x - self.low) / self.width)


class LossOfTemperature(AbstractUnknown, HeatTerm):
    """A heat loss beside the convection's."""

    effect_name: ClassVar[str] = "unknown_loss_of_temperature"
    candidate: ClassVar[Candidate] = _candidate("a heat loss depending on the temperature over the air's", "heat")
    symbol: ClassVar[str] = "T - T_inf"
    state: ClassVar[str] = "temperature over ambient"
    state_unit: ClassVar[str] = "K"
    unit: ClassVar[str] = "W/m"

    def heat_loss(self, wire: Wire, at: HeatState) -> Scalar | float:
        return self.value(at.temperature - at.ambient)


class HeatOfFraction(AbstractUnknown, HeatTerm):
    """Heat stored in the phases."""

    effect_name: ClassVar[str] = "unknown_heat_of_fraction"
    candidate: ClassVar[Candidate] = _candidate("a stored heat depending on the martensite fraction", "heat")
    symbol: ClassVar[str] = "xi"
    state: ClassVar[str] = "martensite fraction"
    state_unit: ClassVar[str] = "-"
    unit: ClassVar[str] = "J/m"
    only_changes: ClassVar[bool] = True

    def stored_heat(self, wire: Wire, temperature: Scalar, fraction: Scalar) -> Scalar | float:
        return self.value(fraction)


def _resisting(change: Scalar) -> Scalar:
    """A relative change that leaves a tenth of the resistance at least: of less than none the current would cool the wire."""
    return jnp.where(change > LEAST_RESISTANCE - 1.0, change, LEAST_RESISTANCE - 1.0)


class ResistanceOfTemperature(AbstractUnknown, ResistanceTerm):
    """A relative change of the resistance."""

    effect_name: ClassVar[str] = "unknown_resistance_of_temperature"
    candidate: ClassVar[Candidate] = _candidate("a change of resistance depending on the temperature", "electrical")
    symbol: ClassVar[str] = "T"
    state: ClassVar[str] = "temperature"
    state_unit: ClassVar[str] = "degC"
    unit: ClassVar[str] = "-"

    def resistance_factor(self, temperature: Scalar, fraction: Scalar) -> Scalar | float:
        return _resisting(self.value(temperature))


class ResistanceOfFraction(AbstractUnknown, ResistanceTerm):
    """The same by phase."""

    effect_name: ClassVar[str] = "unknown_resistance_of_fraction"
    candidate: ClassVar[Candidate] = _candidate(
        "a change of resistance depending on the martensite fraction", "electrical"
    )
    symbol: ClassVar[str] = "xi"
    state: ClassVar[str] = "martensite fraction"
    state_unit: ClassVar[str] = "-"
    unit: ClassVar[str] = "-"

    def resistance_factor(self, temperature: Scalar, fraction: Scalar) -> Scalar | float:
        return _resisting(self.value(fraction))


class CommandOfCommand(AbstractUnknown, CommandTerm):
    """A relative change of what the drive delivers: u -> u [1 + f(u)], of an amplifier that saturates, loses small commands or is not linear.

    u is the command as the effects before it leave it, and what comes of it has its sign: a negative power would cool the wire.
    """

    effect_name: ClassVar[str] = "unknown_command_of_command"
    candidate: ClassVar[Candidate] = _candidate(
        "a change of what the drive delivers depending on its command", "electrical"
    )
    symbol: ClassVar[str] = "u"
    state: ClassVar[str] = "command of the drive"
    state_unit: ClassVar[str] = "command"
    unit: ClassVar[str] = "-"

    def command(self, channel: str, value: Scalar) -> Scalar:
        kept = 1.0 + self.value(value)
        return value * jnp.where(kept > 0.0, kept, 0.0)


def _bent(share: Scalar, by: Scalar) -> Scalar:
    # 0 and 1 stay where they are: a transformation ends where it ended.
    return share + share * (1.0 - share) * by


class HeatingCurve(AbstractUnknown, ShapeTerm):
    """Another shape of the martensite-to-austenite curve: h -> h + h (1 - h) f(h)."""

    effect_name: ClassVar[str] = "unknown_heating_curve"
    candidate: ClassVar[Candidate] = _candidate("another course of the transformation on heating", "kinetics")
    symbol: ClassVar[str] = "h"
    state: ClassVar[str] = "share of martensite left on the heating curve"
    state_unit: ClassVar[str] = "-"
    unit: ClassVar[str] = "-"

    def heating_shape(self, z: Scalar, remaining: Scalar) -> Scalar:
        return _bent(remaining, self.value(remaining))


class CoolingCurve(AbstractUnknown, ShapeTerm):
    """The same of the austenite-to-martensite curve."""

    effect_name: ClassVar[str] = "unknown_cooling_curve"
    candidate: ClassVar[Candidate] = _candidate("another course of the transformation on cooling", "kinetics")
    symbol: ClassVar[str] = "k"
    state: ClassVar[str] = "share of austenite left on the cooling curve"
    state_unit: ClassVar[str] = "-"
    unit: ClassVar[str] = "-"

    def cooling_shape(self, z: Scalar, remaining: Scalar) -> Scalar:
        return _bent(remaining, self.value(remaining))


class BothCurves(AbstractUnknown, ShapeTerm):
    """The same of both curves, by what each has left: a material whose range is not traversed evenly either way."""

    effect_name: ClassVar[str] = "unknown_both_curves"
    candidate: ClassVar[Candidate] = _candidate("another course of the transformation on either way", "kinetics")
    symbol: ClassVar[str] = "h"
    state: ClassVar[str] = "share left on the heating or the cooling curve"
    state_unit: ClassVar[str] = "-"
    unit: ClassVar[str] = "-"

    def heating_shape(self, z: Scalar, remaining: Scalar) -> Scalar:
        return _bent(remaining, self.value(remaining))

    def cooling_shape(self, z: Scalar, remaining: Scalar) -> Scalar:
        return _bent(remaining, self.value(remaining))


class StrainOfTemperature(AbstractUnknown, ConstitutiveTerm):
    """A strain beside eps_L xi_s and the elastic part."""

    effect_name: ClassVar[str] = "unknown_strain_of_temperature"
    candidate: ClassVar[Candidate] = _candidate("a strain depending on the temperature", "constitutive")
    symbol: ClassVar[str] = "T"
    state: ClassVar[str] = "temperature"
    state_unit: ClassVar[str] = "degC"
    unit: ClassVar[str] = "-"
    only_changes: ClassVar[bool] = True

    def strain(self, wire: Wire, at: WireState) -> Scalar | float:
        return self.value(at.temperature)


class StrainOfStress(AbstractUnknown, ConstitutiveTerm):
    """The same of the stress."""

    effect_name: ClassVar[str] = "unknown_strain_of_stress"
    candidate: ClassVar[Candidate] = _candidate("a strain depending on the stress", "constitutive")
    symbol: ClassVar[str] = "sigma"
    state: ClassVar[str] = "stress"
    state_unit: ClassVar[str] = "Pa"
    unit: ClassVar[str] = "-"
    only_changes: ClassVar[bool] = True

    def strain(self, wire: Wire, at: WireState) -> Scalar | float:
        return self.value(at.stress)


class StrainOfFraction(AbstractUnknown, ConstitutiveTerm):
    """The same of the martensite fraction."""

    effect_name: ClassVar[str] = "unknown_strain_of_fraction"
    candidate: ClassVar[Candidate] = _candidate("a strain depending on the martensite fraction", "constitutive")
    symbol: ClassVar[str] = "xi"
    state: ClassVar[str] = "martensite fraction"
    state_unit: ClassVar[str] = "-"
    unit: ClassVar[str] = "-"
    only_changes: ClassVar[bool] = True

    def strain(self, wire: Wire, at: WireState) -> Scalar | float:
        return self.value(at.martensite_fraction)


class ForceOfDisplacement(AbstractUnknown, ForceTerm):
    """A force against contraction beside the load's."""

    effect_name: ClassVar[str] = "unknown_force_of_displacement"
    candidate: ClassVar[Candidate] = _candidate("a force depending on the displacement", "mechanics")
    symbol: ClassVar[str] = "x"
    state: ClassVar[str] = "displacement of the wire's end"
    state_unit: ClassVar[str] = "m"
    unit: ClassVar[str] = "N"

    def resisting_force(self, load: AbstractMovingLoad, at: EndMotion) -> Scalar | float:
        return self.value(at.displacement)


class ForceOfSpeed(AbstractUnknown, ForceTerm):
    """The same of the speed."""

    effect_name: ClassVar[str] = "unknown_force_of_speed"
    candidate: ClassVar[Candidate] = _candidate("a force depending on the speed", "mechanics")
    symbol: ClassVar[str] = "v"
    state: ClassVar[str] = "speed of the wire's end"
    state_unit: ClassVar[str] = "m/s"
    unit: ClassVar[str] = "N"

    def resisting_force(self, load: AbstractMovingLoad, at: EndMotion) -> Scalar | float:
        return self.value(at.speed)


class ReadingOfValue(AbstractUnknown, SensorTerm):
    """An error of the sensor's reading, in the sensor's unit."""

    effect_name: ClassVar[str] = "unknown_reading_of_value"
    candidate: ClassVar[Candidate] = _candidate("an error of the sensor depending on what it shows", "sensor")
    symbol: ClassVar[str] = "y"
    state: ClassVar[str] = "what an ideal sensor shows"
    state_unit: ClassVar[str] = "reading"
    unit: ClassVar[str] = "reading"

    def sensed(self, reading: Scalar, time: Scalar, last: Scalar) -> Scalar:
        return reading + self.value(reading)


class ReadingOfTime(AbstractUnknown, SensorTerm):
    """The same of the time since the run's start."""

    effect_name: ClassVar[str] = "unknown_reading_of_time"
    candidate: ClassVar[Candidate] = _candidate("an error of the sensor depending on the time in the run", "sensor")
    symbol: ClassVar[str] = "t"
    state: ClassVar[str] = "time"
    state_unit: ClassVar[str] = "s"
    unit: ClassVar[str] = "reading"

    def sensed(self, reading: Scalar, time: Scalar, last: Scalar) -> Scalar:
        return reading + self.value(time)


UNKNOWN: dict[str, type[AbstractUnknown]] = {
    term.effect_name: term
    for term in (
        LossOfTemperature,
        HeatOfFraction,
        ResistanceOfTemperature,
        ResistanceOfFraction,
        CommandOfCommand,
        HeatingCurve,
        CoolingCurve,
        BothCurves,
        StrainOfTemperature,
        StrainOfStress,
        StrainOfFraction,
        ForceOfDisplacement,
        ForceOfSpeed,
        ReadingOfValue,
        ReadingOfTime,
    )
}
