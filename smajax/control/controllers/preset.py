"""A controller with its gains, as a sweep runs it and as tuning changes it, on the arm and on other plants."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

import jax.numpy as jnp

from smajax.control.controllers.base import AbstractController
from smajax.control.load_equation import missing_for_equation, missing_for_stroke
from smajax.control.scales import factors_for, is_arm, limited_as, on_amplifier, scaled, share_of_limit
from smajax.core.parameters import parameters, set_parameters
from smajax.engine import Engine
from smajax.model.load.base import AbstractMovingLoad
from smajax.model.system import System
from smajax.model.types import Scalar

Box = Mapping[str, tuple[float, float]]  # gain -> its positive bounds; the box is searched by logarithm
WIDER = 3.0
ANGLE, STATE = "angle", "angle, rate, stress, temperature, fraction"
# What a controller is derived from, beside the reading: the load's equation of motion, or where its stroke ends.
EQUATION, STROKE = "equation", "stroke"


def _same(system: System) -> System:
    return system


@dataclass(frozen=True)
class ControllerPreset:
    """A controller by name: how it is made for a plant, and which of its gains are varied and tuned within which bounds.

    Gains and bounds are the arm's; on another load `make` and `box_on` scale them (`control.scales`), and on an arm whose amplifier or supply has
    a limit the voltages among them.
    """

    on_arm: Callable[
        [System], AbstractController
    ]  # of the system that the controller is to assume, with the arm's gains
    main_gain: str  # the gain that a sweep varies
    reads: str  # what it reads of the plant: ANGLE or STATE
    box: Box  # the gains that are tuned
    section: Callable[[System], System] = _same  # the arm that its section is written for
    # One that switches -> one with a derivative, of a width that goes to nothing.
    smoothed: Callable[[AbstractController, Scalar], AbstractController] | None = None
    needs: str = ""  # EQUATION or STROKE of the load; "": the reading alone
    # Its fields and parameters that are of the plant, and so are no gains.
    known: frozenset[str] = frozenset({"believed", "equation"})
    # Gain -> scale -> its power on another load (`control.scales`), in the place of what its unit says; of several the least.
    scales: Mapping[str, Sequence[Mapping[str, int]]] = field(default_factory=dict)
    # Parameters that do not follow the plant's scales, SI: of a comparison in which several models share them.
    fixed: Mapping[str, float] = field(default_factory=dict)
    # What runs the derivatives of its loops in its gains: XLA where machine code has no translation of them, so that nobody is warned.
    derivatives_by: Engine = "auto"

    def missing(self, system: System) -> str:
        """What it needs and this plant does not give, in words; "" where it can be made."""
        if not isinstance(system.load, AbstractMovingLoad):
            return "it moves nothing that a controller could lead"
        name, unit = system.load.reading
        if unit != system.load.position_unit:
            return f"its sensor shows the {name} ({unit}), and controllers lead a position"
        try:
            system.drive.from_command(jnp.zeros(()))
        except ValueError as error:
            return str(error).rstrip(".")
        lacking = missing_for_stroke(system)
        return missing_for_equation(system) if self.needs == EQUATION and not lacking else lacking

    def make(self, system: System) -> AbstractController:
        """The controller of a plant that it is to assume. Raises ValueError where the plant does not give what it needs."""
        if lacking := self.missing(system):
            raise ValueError(f"no controller of a {type(system.load).__name__}: {lacking}.")
        controller = self.on_arm(system)
        if is_arm(system):
            controller = on_amplifier(controller, system, self.known)
        else:
            controller = scaled(controller, factors_for(system, controller, self.scales), self.known)
        return set_parameters(controller, self.fixed) if self.fixed else controller

    def plant(self, system: System) -> System:
        """The plant that runs: an arm as the controller's section has it, any other load as it is."""
        return self.section(system) if is_arm(system) else system

    def box_on(self, system: System) -> Box:
        """The bounds of its gains on a plant, to three digits, within those that make sense.

        On another load than the arm they are `WIDER` on either side, since scales are rough; those of a command stay. On an arm whose amplifier
        or supply has a limit those of a voltage keep their share of it.
        """
        limit = limited_as(system) if is_arm(system) else None
        if is_arm(system) and limit is None:
            return self.box
        controller = self.on_arm(system)
        table = parameters(controller)
        volts = {name for name in self.box if table[name].unit == "V"}
        if limit is None:
            factors, apart = factors_for(system, controller, self.scales), WIDER
        else:
            factors, apart = (
                {name: share_of_limit(name, limit) if name in volts else jnp.ones(()) for name in self.box},
                1.0,
            )

        def held(bound: float, name: str, wider: float) -> float:
            scaled_bound = bound * float(factors[name]) * (1.0 if name in volts else wider)
            return min(max(float(f"{scaled_bound:.3g}"), table[name].low), table[name].high)

        return {name: (held(low, name, 1.0 / apart), held(high, name, apart)) for name, (low, high) in self.box.items()}
