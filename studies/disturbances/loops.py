"""The loops of the study, in one program a controller: scenarios x plants side by side, and what is measured of each event."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from smajax.control.closed_loop import ClosedLoopSetup, stored_loop
from smajax.control.controllers.base import AbstractController
from smajax.control.figures_of_merit import BAND_DEGREES, STEADY_SHARE
from smajax.control.perturbed_plant import OF_ARM, perturbed_plant
from smajax.control.presets import CONTROLLERS
from smajax.control.reference import resting
from smajax.control.signal_path import Interface, interface_of
from smajax.control.sweep.grid import loop_rows
from smajax.control.tune.scenarios import tuned_on
from smajax.model.rigs import arm
from smajax.model.system import System
from smajax.model.types import Scalar
from smajax.simulation.batch.axes import zipped
from smajax.simulation.batch.chunks import chunks
from studies.disturbances.scenarios import CHANNELS, STEP, Scenario
from studies.requirement.run import gains_of
from studies.requirement.search import DELAY, FILTER, NOISE, PERIOD, QUANTUM, VARIATION

SEED = 0
MOST_PLANTS = 100
SCENARIO, NUMBER = "scenario", "number"


class _Common(eqx.Module):
    plant: System
    controller: AbstractController
    interface: Interface
    wanted: jax.Array  # (scenarios, n), rad
    disturbance: Mapping[str, jax.Array]  # (scenarios, n)
    key: jax.Array


def _position(common: _Common, values: dict[str, Scalar]) -> dict[str, Any]:
    # A weighted sum in the place of an index, for which the native engine has no translation.
    own = [jnp.where(values[SCENARIO] == number, 1.0, 0.0) for number in range(len(common.wanted))]

    def of(several: jax.Array) -> jax.Array:
        result = own[0] * several[0]
        for number in range(1, len(own)):
            result = result + own[number] * several[number]
        return result

    setup = ClosedLoopSetup(
        perturbed_plant(common.plant, values),
        common.controller,
        resting(of(common.wanted)),
        disturbance={name: of(series) for name, series in common.disturbance.items()},
        **common.interface.settings(jnp.asarray(STEP), common.key, values[NUMBER]),
    )
    return {"position": stored_loop(setup).run.position}


def plants(corners: bool = True) -> np.ndarray:
    """Ratios of the plant's parameters to the model's, (plants, columns): the nominal one first, then the corners of 20 % of inertia, damping and convection."""
    nominal = loop_rows({}, 0.0)
    found = tuned_on([0.0], VARIATION, 0).rows if corners else nominal[:, :-1]
    wrong = found[np.abs(found[:, : len(OF_ARM.columns)] - 1.0).max(axis=1) > 1e-9]
    return np.concatenate([nominal[:, : len(OF_ARM.columns)], wrong[:, : len(OF_ARM.columns)]])


def positions(name: str, happenings: Sequence[Scenario], ratios: np.ndarray) -> np.ndarray:
    """Angles over time of a controller, (scenarios, plants, n), degrees. Each loop has its own noise."""
    preset = CONTROLLERS[name]
    plant = preset.plant(arm())
    common = _Common(
        plant,
        gains_of(name)[0].put(plant),
        interface_of(plant, FILTER, NOISE, PERIOD, STEP, DELAY, QUANTUM),
        jnp.radians(jnp.asarray([one.wanted for one in happenings])),
        {channel: jnp.asarray([one.disturbance[channel] for one in happenings]) for channel in CHANNELS},
        jax.random.key(SEED),
    )
    count = len(happenings) * len(ratios)
    columns = dict(zip(OF_ARM.columns, np.tile(ratios, (len(happenings), 1)).T, strict=True))
    which = np.repeat(np.arange(len(happenings)), len(ratios))
    # A loop's noise is the same with fewer plants beside it.
    numbers = MOST_PLANTS * which + np.tile(np.arange(len(ratios)), len(happenings))
    axes = zipped({**columns, SCENARIO: which, NUMBER: numbers})
    ((_, found),) = chunks(_position, common, axes, count, range(1))
    return np.degrees(found["position"]).reshape(len(happenings), len(ratios), -1)


class Event(NamedTuple):
    """What follows one event in one loop; a step of the set point, or a disturbance of the arm at rest."""

    peak: float  # degrees: largest deviation, of a step beyond the new set point
    recovery: float  # s until it is within a degree and stays there; infinite: not before the next event
    steady: float  # degrees: mean of the absolute deviation over the last fifth before the next event


def events_of(scenario: Scenario, angle: np.ndarray) -> list[Event]:
    """Of one loop, (n,) degrees, by the true angle."""
    found = []
    for first, after in scenario.windows():
        wanted = scenario.wanted[first]
        error = angle[first:after] - wanted
        beyond = np.abs(error)
        step = wanted - (scenario.wanted[first - 1] if first else angle[0])
        peak = max(float((np.sign(step) * error).max()), 0.0) if step else float(beyond.max())
        outside = np.flatnonzero(beyond > BAND_DEGREES)
        recovery = 0.0 if not outside.size else STEP * (outside[-1] + 1)
        inside_at_last = not outside.size or outside[-1] < len(error) * (1.0 - STEADY_SHARE)
        steady = float(beyond[-round(STEADY_SHARE * len(error)) :].mean())
        found.append(Event(peak, float(recovery) if inside_at_last else float("inf"), steady))
    return found
