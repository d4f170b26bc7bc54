"""Robustness of controllers: plants that are not what the controller believes, in one batch a controller.

A mismatch multiplies one parameter of the plant; the controller keeps its gains and what it believes. Every combination
of two mismatches, set points and shares of the controller's main gain is one closed loop; one program runs them all, `CHUNK` at a time side by side.
The air's temperature is multiplied in degrees Celsius: 20 C becomes 10 to 40 C.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from smajax.closed_loop import simulate_closed_loop
from smajax.controller.base import AbstractController
from smajax.estimator.base import AbstractEstimator
from smajax.fit.solve import Progress, quiet
from smajax.merit import Merit, merit
from smajax.parameters import get_parameters, set_vector
from smajax.reference import clock, constant
from smajax.system import System
from smajax.types import Scalar, Series

# What may be wrong: its name on the command line -> the plant's parameter.
MISMATCHES = {
    "inertia": "inertia_ratio",
    "damping": "damping",
    "convection": "convection_coefficient",
    "ambient": "ambient_temperature",
    "payload": "payload_mass",
    "supply": "amplifier_gain",
}
LEAST, MOST = 0.5, 2.0  # the mismatches looked at, plant over belief
CHUNK = 1024  # loops at once: their trajectories lie in memory while the figures of merit are taken


@dataclass(frozen=True)
class Grid:
    """The product of two mismatches (plant over belief), set points (rad) and shares of the main gain."""

    first: str
    second: str
    ratios: np.ndarray  # (A,), for both
    targets: np.ndarray  # (S,), rad
    gains: np.ndarray  # (G,), share of the preset's main gain

    @property
    def shape(self) -> tuple[int, int, int, int]:
        return len(self.ratios), len(self.ratios), len(self.targets), len(self.gains)

    def lanes(self) -> np.ndarray:
        """One row a closed loop, (A * A * S * G, 4): both ratios, set point, share of the gain."""
        axes = np.meshgrid(self.ratios, self.ratios, self.targets, self.gains, indexing="ij")
        return np.stack([axis.ravel() for axis in axes], axis=1)


def ratios(points: int) -> np.ndarray:
    """`points` mismatches from 0.5 to 2, evenly by logarithm; an odd number has 1 among them."""
    return np.exp(np.linspace(np.log(LEAST), np.log(MOST), points))


@eqx.filter_jit
def _merits(
    system: System,
    controller: AbstractController,
    plant_names: tuple[str, ...],
    gain_name: str,
    lanes: jax.Array,
    time: Series,
    every: int,
    estimator: AbstractEstimator | None,
) -> tuple[Merit, Scalar]:
    nominal = get_parameters(system, plant_names)
    gain = get_parameters(controller, [gain_name])

    def one(lane: jax.Array) -> tuple[Merit, Scalar]:
        plant = set_vector(system, plant_names, nominal * lane[:2])
        tuned = set_vector(controller, [gain_name], gain * lane[3])
        loop = simulate_closed_loop(
            plant, tuned, constant(time, lane[2]), time[1] - time[0], every, estimator=estimator
        )
        return merit(loop, plant), loop.failed_at

    return jax.vmap(one)(lanes)


def sweep(
    system: System,
    controller: AbstractController,
    main_gain: str,
    grid: Grid,
    *,
    seconds: float = 10.0,
    dt: float = 0.01,
    every: int = 1,
    estimator: AbstractEstimator | None = None,
    progress: Progress = quiet,
) -> tuple[Merit, np.ndarray]:
    """(figures of merit, time at which the controller failed or infinity), every array of the grid's shape.

    Raises ValueError for a mismatch there is not.
    """
    unknown = [name for name in (grid.first, grid.second) if name not in MISMATCHES]
    if unknown or grid.first == grid.second:
        raise ValueError(f"two different mismatches of {sorted(MISMATCHES)}, not `{grid.first}` and `{grid.second}`.")
    names = (MISMATCHES[grid.first], MISMATCHES[grid.second])
    lanes, time = grid.lanes(), clock(seconds, dt)
    found = []
    for start in range(0, len(lanes), CHUNK):
        some = lanes[start : start + CHUNK]
        # Filled up by repeating the last, so that one compilation serves every chunk.
        filled = np.concatenate([some, np.repeat(some[-1:], CHUNK - len(some), axis=0)]) if start else some
        answer = _merits(system, controller, names, main_gain, jnp.asarray(filled), time, every, estimator)
        cut = slice(len(some))
        found.append(jax.tree.map(lambda leaf, cut=cut: np.asarray(leaf)[cut], answer))
        progress("sweeping", min(1.0, (start + len(some)) / len(lanes)))
    merits, failed = jax.tree.map(lambda *leaves: np.concatenate(leaves).reshape(grid.shape), *found)
    return merits, failed


@eqx.filter_jit
def _angles(
    system: System,
    controller: AbstractController,
    name: str,
    ratios: jax.Array,
    target: Scalar,
    time: Series,
    every: int,
    estimator: AbstractEstimator | None,
) -> jax.Array:
    nominal = get_parameters(system, [name])

    def one(ratio: Scalar) -> Series:
        plant = set_vector(system, [name], nominal * ratio)
        wanted = constant(time, target)
        return simulate_closed_loop(
            plant, controller, wanted, time[1] - time[0], every, estimator=estimator
        ).run.position

    return jax.vmap(one)(ratios)


def lines(
    system: System,
    controller: AbstractController,
    mismatch: str,
    at: Sequence[float],
    target: float,
    *,
    seconds: float = 10.0,
    dt: float = 0.01,
    every: int = 1,
    estimator: AbstractEstimator | None = None,
) -> tuple[np.ndarray, np.ndarray]:
    """(time, angle at each ratio of one mismatch, shape (ratios, time)): the source's single lines."""
    time = clock(seconds, dt)
    wanted = jnp.asarray(target, dtype=float)
    angles = _angles(system, controller, MISMATCHES[mismatch], jnp.asarray(at), wanted, time, every, estimator)
    return np.asarray(time), np.asarray(angles)
