"""What a missing effect is worth in control: a controller tuned on each of several models, and evaluated on one plant."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import jax.numpy as jnp
import numpy as np

from smajax.control.closed_loop import ClosedLoopSetup
from smajax.control.compiled_loop import measured_loop
from smajax.control.controllers.base import AbstractController
from smajax.control.gains_file import Gains, fixed_parameters
from smajax.control.model_as_plant import plant_of, within_limit
from smajax.control.position_unit import PositionUnit, unit_of
from smajax.control.presets import CONTROLLERS
from smajax.control.reach import reach_of, reach_sentence, shared_set_points
from smajax.control.reference import resting
from smajax.control.scales import seconds_for
from smajax.control.tune.evaluate import STEP
from smajax.control.tune.settings import TuneSettings, settings_for
from smajax.control.tune.tuning import TuningResult, best_gains, tune
from smajax.core.progress import Progress, quiet
from smajax.data.model_file.record import ModelRecord
from smajax.model.system import System

PLANTS = 8  # drawn from each model's posterior, of which gains are tuned on three of every four
KNOWN = 0.01  # of a known value: a smaller difference between model and plant is none
SET_POINTS = 3  # over the reach, where none are given
EFFORT = {"tried": 16, "starts": 3, "rounds": 10, "finish": 20, "unseen": 4}
QUICK = {"tried": 8, "starts": 2, "rounds": 5, "finish": 10, "unseen": 2}  # for a demonstration


@dataclass(frozen=True)
class EvaluatedLoop:
    """One closed loop on the plant, a step from the start, cold and at rest; SI."""

    set_point: float  # rad or m
    time: np.ndarray  # (n,), s
    position: np.ndarray  # (n,), rad or m
    settling_time: float  # s; infinite where it never settles
    overshoot: float
    steady_error: float


@dataclass(frozen=True)
class TunedOnModel:
    """The gains that were tuned on one model, and their loops on the plant."""

    model: str  # "base model"
    gains: Gains
    units: Mapping[str, str]
    loops: tuple[EvaluatedLoop, ...]
    largest: float = math.inf  # command of the controller, in the drive's unit; infinite where it does not say

    @property
    def settling_time(self) -> float:
        """Mean over the set points, s; infinite where one never settles."""
        return float(np.mean([one.settling_time for one in self.loops]))

    @property
    def overshoot(self) -> float:
        """Largest over the set points, rad or m."""
        return max(one.overshoot for one in self.loops)


@dataclass(frozen=True)
class OtherValue:
    """A value that is given in the models, and another in the plant; SI."""

    name: str
    model: float
    plant: float
    unit: str


@dataclass(frozen=True)
class ControlComparison:
    """Gains tuned on several models, evaluated on one plant."""

    controller: str
    plant: str  # what it is, in words: "true model"
    unit: PositionUnit
    seconds: float  # length of a loop
    tuned: tuple[TunedOnModel, ...]
    differs: tuple[OtherValue, ...] = ()  # known values of the models that the plant has others of


def tuned_on_models(
    models: Mapping[str, ModelRecord],
    plant: tuple[str, ModelRecord],
    controller: str = "pid",
    set_points: Sequence[float] = (),
    *,
    seed: int = 0,
    effort: Mapping[str, int] | None = None,
    weights: Mapping[str, float] | None = None,
    progress: Progress = quiet,
) -> ControlComparison:
    """`controller` tuned on each of the `models` and on plants from its posterior, and evaluated on the `plant`, each by its name.

    The first model's load has the unit of the set points, mm or deg; by default they are spread over what all the models reach. All
    have the first model's limit of the command, its bounds of the gains and its controller's parameters that are not tuned (filter,
    unwinding time), and the same settings. Each model has the gains that cost least on its own plants, of those that the searches on
    all the models found. What differs is then what the models say, and neither where a search happened to end nor a time constant.

    weights: of the cost, as `tune`'s; by default overshoot and steady error count beside the settling time, and gains that settle
    later with less overshoot may then be the better ones. A comparison of settling times alone is tuned on `{"settling_time": 1.0}`.
    Raises ValueError and KeyError as `tune`, and ValueError for set points out of a model's reach.
    """
    first = next(iter(models.values()))
    system, _ = plant_of(first)
    unit, seconds = unit_of(system), seconds_for(system)
    every = {name: within_limit(first, model.system) for name, model in models.items()}
    targets = tuple(set_points) or shared_set_points(every.values(), SET_POINTS)
    for name, assumed in every.items():
        if sentence := reach_sentence(reach_of(assumed), assumed, targets):
            raise ValueError(f"{name}: {sentence}")
    truth = within_limit(first, plant[1].system)
    shared = _shared(controller, next(iter(every.values())))
    searched: list[tuple[str, System, System | None, TuneSettings, TuningResult]] = []
    for name, model in models.items():
        assumed = every[name]
        drawn = model.plants(PLANTS, seed) if any(one.names for one in model.likely) else None
        plants = None if drawn is None else within_limit(first, drawn)
        asked = {**EFFORT, **(effort or {}), **({"weights": weights} if weights else {}), **shared}
        settings = settings_for(assumed, controller, plants, set_points=targets, seconds=seconds, seed=seed, **asked)
        searched.append((name, assumed, plants, settings, tune(assumed, settings, plants=plants, progress=progress)))
    pool = [found.after for *_, found in searched]
    tuned = []
    for name, assumed, plants, settings, found in searched:
        gains = replace(found.after, values=best_gains(assumed, settings, pool, plants=plants))
        own = gains.put(CONTROLLERS[controller].plant(assumed))
        loops = tuple(
            loop_on_plant(truth, own, float(target), seconds, assumed) for target in unit.to_own(np.asarray(targets))
        )
        tuned.append(TunedOnModel(name, gains, found.units, loops, float(own.largest_command())))
    return ControlComparison(controller, plant[0], unit, seconds, tuple(tuned), differing(first, plant[1]))


def _shared(controller: str, system: System) -> dict[str, Mapping[str, Any]]:
    """Fields of `TuneSettings` that this model's plant gives to all: scaled to each they would differ by some per cent."""
    preset = CONTROLLERS[controller]
    plant = preset.plant(system)
    return {"fixed": fixed_parameters(controller, preset.make(plant)), "box": preset.box_on(plant)}


def differing(model: ModelRecord, plant: ModelRecord) -> tuple[OtherValue, ...]:
    """Values that are given in a model, and others in the plant: no fit has found these, and no effect stands for them."""
    return tuple(
        OtherValue(name, one.value, plant.values[name], model.table[name].unit)
        for name, one in model.parameters.items()
        if one.origin == "given"
        and name in plant.values
        and abs(plant.values[name] - one.value) > KNOWN * abs(one.value)
    )


def loop_on_plant(
    plant: System, controller: AbstractController, set_point: float, seconds: float, assumed: System | None = None
) -> EvaluatedLoop:
    """The loop of a controller on a plant, from the start to one set point (rad or m); `assumed` as `ClosedLoopSetup.assumed`."""
    reference = resting(jnp.full(round(seconds / STEP) + 1, set_point))
    loop, figures, _ = measured_loop(ClosedLoopSetup(plant, controller, reference, STEP, 1, assumed=assumed))
    return EvaluatedLoop(
        set_point,
        np.asarray(loop.run.time),
        np.asarray(loop.run.position),
        float(figures.settling_time),
        float(figures.overshoot),
        float(figures.steady_error),
    )
