"""What a tuning was asked for."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from smajax.control.interface import between_in_words, check_interface, check_set_points
from smajax.control.presets import CONTROLLERS
from smajax.control.tune import adam, cma_es
from smajax.control.tune.evaluate import STEP
from smajax.control.tune.multistart import Effort
from smajax.control.tune.objective import REGULATION, Goal
from smajax.control.tune.scenarios import BESIDE, check_variation
from smajax.control.tune.terms import TERMS
from smajax.core.names import close_matches
from smajax.model.system import System
from smajax.simulation.integration_error import AUTO, Tolerance


@dataclass(frozen=True)
class TuneSettings:
    """A tuning; angles in degrees, weights and limits in the units of `TERMS`."""

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
    noise: float = 0.0  # degrees
    period: float = STEP  # s
    delay: int = 0
    seed: int = 0
    unseen: int = 32  # plants of the check
    start: Mapping[str, float] = field(default_factory=dict)  # gains to begin from in the place of the preset's
    tolerance: Tolerance = AUTO  # as `run_batch`'s; None is one step a sample

    @property
    def goal(self) -> Goal:
        return Goal(self.objective, self.weights, self.limits)

    @property
    def effort(self) -> Effort:
        return Effort(self.tried, self.starts, self.rounds, self.seed, self.by)

    def check(self, system: System) -> None:
        """ValueError for what there is not, or makes no sense, with what does."""
        if self.controller not in CONTROLLERS:
            raise ValueError(
                f"no controller `{self.controller}`{close_matches(self.controller, CONTROLLERS, 'there are')}."
            )
        check_set_points(system, self.set_points)
        if len(set(self.set_points)) < len(self.set_points):
            raise ValueError(f"every set point once, not {', '.join(f'{angle:g}' for angle in self.set_points)}.")
        check_variation(self.variation)
        check_interface(self.estimator, self.noise, self.period, STEP)
        steps = self.seconds / self.period
        if steps < 1.0 or abs(steps - round(steps)) > 1e-6:
            raise ValueError(
                f"a loop lasts a whole number of control periods of {self.period:g} s, not {self.seconds:g} s."
            )
        box = CONTROLLERS[self.controller].box
        if self.start and set(self.start) != set(box):
            raise ValueError(f"gains to begin from are {', '.join(box)}, all of them; not {', '.join(self.start)}.")
        if self.finish < 0:
            raise ValueError(f"generations without gradients are none or more, not {self.finish}.")
        if self.unseen < 1:
            raise ValueError(f"the check needs at least one plant, not {self.unseen}.")
        _ = self.goal, self.effort  # they check themselves

    def check_packages(self) -> None:
        """MissingExtraError without a package that these settings need, before the work."""
        if self.by == "adam":
            adam.rule()
        if self.finish:
            cma_es.package()

    def plants_sentence(self, air: float = 20.0) -> str:
        """On which plants gains are tuned. `air`: degC as believed, of which a share is told in kelvins."""
        sizes = {name: f"{100 * share:g} %" for name, share in self.variation.items()}
        if "ambient" in sizes:
            sizes["ambient"] = f"{self.variation['ambient'] * abs(air):.3g} K"
        wrong = [f"{name} ±{size}" for name, size in sizes.items()]
        plants = f"the plant as believed and with {', '.join(wrong)} at once" if wrong else "the plant as believed"
        return f"{plants}; set points {', '.join(f'{angle:g}°' for angle in self.set_points)}"

    def held_out_sentence(self) -> str:
        """On what the gains are checked that tuning never saw."""
        where = "set points between those tuned" if len(self.set_points) > 1 else f"a set point {BESIDE:g}° beside"
        return f"plants within the variation, {where}" if self.variation else f"{where}, the plant as believed"

    def goal_sentence(self) -> str:
        """What is made small, and what is kept below a limit."""
        parts = [
            f"{weight:g} x {TERMS[name].label} ({TERMS[name].unit})" for name, weight in self.weights.items() if weight
        ]
        of = {
            "nominal": "mean over the set points, plant as believed",
            "worst": "largest of all loops",
            "mean-variance": "mean of all loops plus one standard deviation",
        }[self.objective]
        limits = [f"{TERMS[name].label} ≤ {limit:g} {TERMS[name].unit}" for name, limit in self.limits.items()]
        return f"Cost: {' + '.join(parts)}, {of}" + (f"; in every loop {', '.join(limits)}" if limits else "")

    def between_in_words(self) -> str:
        """What lies between plant and controller."""
        return between_in_words(self.estimator, self.noise, self.period, self.delay)

    def record(self) -> dict[str, Any]:
        """For JSON."""
        return {
            "controller": self.controller,
            "set_points_deg": list(self.set_points),
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
            "noise_deg": self.noise,
            "period_s": self.period,
            "delay_periods": self.delay,
            "seed": self.seed,
            "plants_of_the_check": self.unseen,
            "start": dict(self.start),
            "tolerance": self.tolerance,
        }
