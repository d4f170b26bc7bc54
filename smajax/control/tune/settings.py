"""What a tuning was asked for."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from smajax.control.gains_file import fixed_parameters
from smajax.control.mismatch import check_ratios_of
from smajax.control.plants import Plants, PlantSet, plant_set
from smajax.control.position_unit import (
    PositionUnit,
    band_shown,
    check_unit,
    default_set_points,
    unit_named,
    unit_of,
)
from smajax.control.presets import CONTROLLERS, check_controller, check_name
from smajax.control.scales import is_arm, seconds_for
from smajax.control.signal_path import between_in_words, check_interface, check_set_points
from smajax.control.tune import adam
from smajax.control.tune.evaluate import STEP
from smajax.control.tune.multistart import Effort
from smajax.control.tune.objective import REGULATION, Goal
from smajax.control.tune.scenarios import check_variation
from smajax.core.names import close_matches
from smajax.core.old_words import worded
from smajax.model.system import System
from smajax.simulation.integration_error import AUTO, Tolerance


@dataclass(frozen=True)
class TuneSettings:
    """A tuning; set points, noise and quantum in `unit`, weights and limits in the units of `terms_in(unit)`."""

    controller: str
    set_points: tuple[float, ...] = (-40.0, -20.0, 0.0, 20.0, 40.0, 60.0, 85.0)
    variation: Mapping[str, float] = field(default_factory=dict)  # how wrong a parameter of the plant may be, a share
    objective: str = "worst"
    weights: Mapping[str, float] = field(default_factory=lambda: dict(REGULATION))
    limits: Mapping[str, float] = field(default_factory=dict)
    tried: int = 32
    starts: int = 6
    rounds: int = 30
    by: str = "trust-region"
    finish: int = 60  # generations of the search without gradients that follows
    seconds: float = 10.0
    estimator: str = ""
    noise: float = 0.0
    quantum: float = 0.0  # between two values of the readings; 0: no steps
    period: float = STEP  # s
    delay: int = 0
    seed: int = 0
    unseen: int = 32  # plants of the check
    start: Mapping[str, float] = field(default_factory=dict)  # gains to begin from in the place of the preset's
    tolerance: Tolerance = AUTO  # as `run_batch`'s; None is one step a sample
    unit: str = "deg"  # as `position_unit.unit_of` the plant
    command: str = "V"  # as the drive's: of chatter
    batch: int = 0  # plants of a batch in the place of the variation
    # In the place of those that the preset has on this plant, SI: parameters that are not tuned, and bounds of every gain.
    fixed: Mapping[str, float] = field(default_factory=dict)
    box: Mapping[str, tuple[float, float]] = field(default_factory=dict)

    @property
    def goal(self) -> Goal:
        return Goal(self.objective, self.weights, self.limits)

    @property
    def effort(self) -> Effort:
        return Effort(self.tried, self.starts, self.rounds, self.seed, self.by)

    @property
    def shown(self) -> PositionUnit:
        """The unit of set points."""
        return unit_named(self.unit, self.command)

    def check(self, system: System, plants: Plants | None = None) -> PlantSet:
        """The plants, if all is well: ValueError for what there is not, or makes no sense, with what does."""
        check_controller(self.controller, system)
        check_unit(system, self.shown)
        check_set_points(system, self.set_points)
        if len(set(self.set_points)) < len(self.set_points):
            raise ValueError(f"every set point once, not {', '.join(f'{angle:g}' for angle in self.set_points)}.")
        found = plant_set(system, plants, tuple(self.variation))
        check_variation(self.variation, found)
        sides = {name: (1.0 - share, 1.0 + share) for name, share in self.variation.items()}
        check_ratios_of(system, sides, found.table)
        if self.batch != (0 if found.batch is None else len(found.batch)):
            raise ValueError(
                f"the settings say {self.batch} plants of a batch, and {plants!r} was given: use `settings_for`."
            )
        check_interface(self.estimator, self.noise, self.period, STEP, self.quantum)
        steps = self.seconds / self.period
        if steps < 1.0 or abs(steps - round(steps)) > 1e-6:
            raise ValueError(
                f"a loop lasts a whole number of control periods of {self.period:g} s, not {self.seconds:g} s."
            )
        box = CONTROLLERS[self.controller].box
        if self.start and set(self.start) != set(box):
            raise ValueError(f"gains to begin from are {', '.join(box)}, all of them; not {', '.join(self.start)}.")
        if self.box and set(self.box) != set(box):
            raise ValueError(f"bounds are of {', '.join(box)}, all of them; not of {', '.join(self.box)}.")
        preset = CONTROLLERS[self.controller]
        own = fixed_parameters(self.controller, preset.make(preset.plant(system)))
        for name in self.fixed:
            if name not in own:
                raise ValueError(
                    f"{self.controller} has no fixed parameter {name!r}{close_matches(name, own, 'there are')}"
                )
        if self.finish < 0:
            raise ValueError(f"generations without gradients are none or more, not {self.finish}.")
        if self.unseen < 1:
            raise ValueError(f"the check needs at least one plant, not {self.unseen}.")
        _ = self.goal, self.effort  # they check themselves
        return found

    def check_packages(self) -> None:
        """MissingExtraError without a package that these settings need, before the work."""
        if self.by == "adam":
            adam.rule()

    def plants_sentence(self, air: float = 20.0) -> str:
        """On which plants gains are tuned, in words; DeprecationWarning. `air`: degC as believed."""
        return str(worded("settings.plants_sentence", "narrate(settings).plants", "plants_sentence", self, air))

    def held_out_sentence(self) -> str:
        """On what the gains are checked that tuning never saw, in words; DeprecationWarning."""
        return str(worded("settings.held_out_sentence", "narrate(settings).held_out", "held_out_sentence", self))

    def goal_sentence(self) -> str:
        """What is made small, and what is kept below a limit, in words; DeprecationWarning."""
        return str(worded("settings.goal_sentence", "narrate(settings).goal", "goal_sentence", self))

    def between_in_words(self) -> str:
        """What lies between plant and controller."""
        return between_in_words(self.estimator, self.noise, self.period, self.delay, self.shown, self.quantum)

    def record(self) -> dict[str, Any]:
        """For JSON."""
        return {
            "controller": self.controller,
            f"set_points_{self.unit}": list(self.set_points),
            "variation": dict(self.variation),
            "objective": self.objective,
            "weights": dict(self.weights),
            "limits": dict(self.limits),
            "points_tried": self.tried,
            "starts": self.starts,
            "rounds": self.rounds,
            "by": self.by,
            "generations_without_slopes": self.finish,
            "seconds": self.seconds,
            "filter": self.estimator,
            f"noise_{self.unit}": self.noise,
            "period_s": self.period,
            "delay_periods": self.delay,
            "seed": self.seed,
            "plants_of_the_check": self.unseen,
            "start": dict(self.start),
            "tolerance": self.tolerance,
            **({f"quantum_{self.unit}": self.quantum} if self.quantum else {}),
            **({"plants_of_the_batch": self.batch} if self.batch else {}),
            **({"fixed": dict(self.fixed)} if self.fixed else {}),
            **({"box": {name: list(ends) for name, ends in self.box.items()}} if self.box else {}),
        }


def regulation_weights(system: System) -> dict[str, float]:
    """`REGULATION` of a plant: one second costs as much as one degree of overshoot, or a hundredth of the stroke of a length."""
    if unit_of(system).is_angle:
        return dict(REGULATION)
    near = band_shown(system)
    lengths = {"overshoot", "steady_error"}
    return {name: float(f"{weight / near:.3g}") if name in lengths else weight for name, weight in REGULATION.items()}


def settings_for(system: System, controller: str, plants: Plants | None = None, **given: Any) -> TuneSettings:
    """A tuning on any plant: what is not given is the arm's, or that of the load's unit, stroke and time.

    given: fields of `TuneSettings`. Set points, noise and quantum in degrees of an angle and millimetres of a length, weights and limits
    in these too.
    """
    check_name(controller)
    unit = unit_of(system)
    defaults: dict[str, Any] = {"unit": unit.shown, "command": unit.command, "weights": regulation_weights(system)}
    defaults["seconds"] = seconds_for(system)
    if not is_arm(system):
        defaults["set_points"] = default_set_points(system)
    found = plant_set(system, plants)
    defaults["batch"] = 0 if found.batch is None else len(found.batch)
    return TuneSettings(controller, **{**defaults, **given})
