"""A hung weight heated in three ways, integrated by scipy from event to event: measured data whose truth is known."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import jax.numpy as jnp
import numpy as np

from smajax.core.parameters import set_parameters
from smajax.fit.packed_runs import RunBatch
from smajax.fit.problem import Problem
from smajax.model.presets import build
from studies.reference.wire_parameters import DeadWeightParameters
from studies.reference.wire_reference import simulate_dead_weight

SECONDS = 12.0
NOISE = 2e-4  # m, of the position: a potentiometer's
# Where the search starts, over the truth (a temperature: over its distance from the air), each 30 % off; the order of
# the transformation temperatures is kept.
STARTS = {
    "convection_coefficient": 1.3,
    "specific_heat": 0.7,
    "recoverable_strain": 1.3,
    "austenite_start": 0.7,
    "austenite_finish": 1.3,
    "martensite_start": 0.7,
}
BOUNDS = {
    "convection_coefficient": (50.0, 400.0),
    "specific_heat": (100.0, 900.0),
    "recoverable_strain": (0.01, 0.1),
    "austenite_start": (50.0, 77.0),
    "austenite_finish": (70.0, 120.0),
    "martensite_start": (43.0, 66.0),
}
Segments = list[tuple[float, float | Callable[[float], float], float]]


def _runs() -> list[Segments]:
    """Switched, ramped, and pulsed: (end in s, volts, mass in kg)."""
    pulses: Segments = [(2.0 * (k + 1), 7.6 if k % 2 == 0 else 3.0, 0.25) for k in range(6)]
    return [
        [(5.0, 7.4, 0.075), (SECONDS, 0.0, 0.075)],
        [(SECONDS, lambda t: 7.5 * (1.0 - abs(t / 6.0 - 1.0)), 0.15)],
        pulses,
    ]


def _held(segments: Segments, time: np.ndarray, dt: float) -> tuple[np.ndarray, np.ndarray]:
    """(volts whose square is the mean square over the step, mass), each held from a sample to the next."""
    ends = [end - 1e-9 for end, _, _ in segments[:-1]]
    volts, mass = np.zeros(len(time)), np.zeros(len(time))
    for k, here in enumerate(np.searchsorted(ends, time, side="right")):
        _, given, mass[k] = segments[here]
        inside = [given(t) if callable(given) else given for t in time[k] + dt * np.array([0.1127, 0.5, 0.8873])]
        volts[k] = np.sqrt(np.dot([5 / 18, 8 / 18, 5 / 18], np.square(inside)))  # Gauss's three points
    return volts, mass


@dataclass(frozen=True)
class Rig:
    """The problem with exact outputs, the truth, and where a search starts."""

    problem: Problem
    truth: dict[str, float]
    start: np.ndarray  # every parameter
    names: tuple[str, ...]


def rig(dt: float) -> Rig:
    """Exact positions `dt` apart in the place of measurements."""
    given = DeadWeightParameters()
    time = np.arange(round(SECONDS / dt) + 1) * dt
    exact = [simulate_dead_weight(given, segments, time)["position"] for segments in _runs()]
    inputs = [_held(segments, time, dt) for segments in _runs()]
    system = set_parameters(build("flexinol_table_3_2", "dead_weight", "voltage"), {"damping": given.damping})
    batch = RunBatch(
        {
            "voltage": jnp.asarray(np.stack([volts for volts, _ in inputs])),
            "mass": jnp.asarray(np.stack([mass for _, mass in inputs])),
        },
        jnp.asarray(np.stack(exact)),
        jnp.ones((len(exact), len(time))),
        jnp.zeros((len(exact), 0)),
        (),
        dt,
    )
    problem = Problem.build(system, batch, NOISE, False)
    values = problem.start_values()
    names, air = tuple(STARTS), given.ambient_temperature
    truth = {name: float(values[problem.names.index(name)]) for name in names}
    start = np.array(values)
    for name, share in STARTS.items():
        zero = air if name.endswith(("_start", "_finish")) else 0.0
        low, high = BOUNDS[name]
        start[problem.names.index(name)] = np.clip(zero + share * (truth[name] - zero), low, high)
    return Rig(problem, truth, start, names)
