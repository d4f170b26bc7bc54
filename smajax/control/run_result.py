"""What a run gives: its data set, figures of merit, and in what the plant differs from the controller's model."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

import xarray as xr

from smajax.control.controllers.base import AbstractController
from smajax.control.figures_of_merit import SetPointMerit
from smajax.control.loop_settings import LoopSettings
from smajax.control.run_notes import Note, Source
from smajax.core.parameters import parameter_values, parameters
from smajax.model.effects.library import LIBRARY
from smajax.model.extended import with_effects
from smajax.model.system import System


@dataclass(frozen=True)
class Mismatch:
    """A parameter in which the plant differs from the controller's model, in the program's own unit."""

    name: str
    unit: str
    assumed: float | None  # None: its effect is not in the controller's model
    true: float

    @property
    def ratio(self) -> float | None:
        """Plant over the assumed value; None where there is none, or where it is zero."""
        return self.true / self.assumed if self.assumed else None


@dataclass(frozen=True)
class RunResult:
    """A run over time, figures of merit of a closed loop (SI), and notes on what may be wrong."""

    data: xr.Dataset
    system: System
    merit: Mapping[str, float]
    notes: tuple[Note, ...]
    by_set_point: tuple[SetPointMerit, ...] = ()  # figures of merit by set point, where there are several
    mismatches: tuple[Mismatch, ...] = ()
    settings: tuple[Source, ...] = ()  # what a closed loop takes from files of gains and of models
    loop: LoopSettings | None = None  # of a closed loop: limit of the command, period, delay, filter, noise
    controller: AbstractController | None = None
    assumed: System | None = None  # of a closed loop: the plant as the controller knows it
    # Root mean square, rad or m, over `whole_run` and `second_half`, which the way to the reference leaves out; of a reference without figures of merit.
    tracking_error: Mapping[str, float] = field(default_factory=dict)


def mismatches(assumed: System, plant: System) -> tuple[Mismatch, ...]:
    """Every parameter in which they differ by more than a unit's rounding; an effect that the plant has not is at its base value there."""
    plant = with_effects(plant, [one.effect_name for one in assumed.effects if one.effect_name in LIBRARY])
    before, units = parameter_values(assumed), parameters(plant)
    return tuple(
        Mismatch(name, units[name].unit, before.get(name), value)
        for name, value in parameter_values(plant).items()
        if not math.isclose(before.get(name, math.nan), value, rel_tol=1e-12)
    )
