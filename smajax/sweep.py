"""Robustness of controllers: plants that are not what the controller believes, in one batch a controller.

A mismatch multiplies one parameter of the plant; the controller keeps its gains and what it believes. Every combination
of two mismatches, set points and shares of the controller's main gain is one closed loop; one program runs them all,
`CHUNK` at a time side by side. The air's temperature is multiplied in degrees Celsius: 20 C becomes 10 to 40 C.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from smajax.closed_loop import simulate_closed_loop
from smajax.controller.base import AbstractController
from smajax.estimator.base import AbstractEstimator
from smajax.fit.solve import Progress, quiet
from smajax.measured_state import Sensor
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


def lanes(
    mismatches: Mapping[str, np.ndarray | float], target: np.ndarray | float, gain: np.ndarray | float = 1.0
) -> np.ndarray:
    """One row a closed loop, (L, mismatches + 2): every mismatch (1 where none is given), set point (rad), share of the gain.

    Raises ValueError for a mismatch there is not.
    """
    unknown = [name for name in mismatches if name not in MISMATCHES]
    if unknown:
        raise ValueError(f"no mismatch {unknown}; there are {sorted(MISMATCHES)}.")
    columns = [mismatches.get(name, 1.0) for name in MISMATCHES]
    return np.stack([np.ravel(column) for column in np.broadcast_arrays(*columns, target, gain)], axis=1)


@dataclass(frozen=True)
class Grid:
    """The product of two mismatches (plant over belief), set points (rad) and shares of the main gain.

    Raises ValueError for a mismatch there is not, or twice the same.
    """

    first: str
    second: str
    ratios: np.ndarray  # (A,), for both
    targets: np.ndarray  # (S,), rad
    gains: np.ndarray  # (G,), share of the preset's main gain

    def __post_init__(self) -> None:
        if self.first == self.second or not {self.first, self.second} <= set(MISMATCHES):
            raise ValueError(
                f"two different mismatches of {sorted(MISMATCHES)}, not `{self.first}` and `{self.second}`."
            )

    @property
    def shape(self) -> tuple[int, int, int, int]:
        return len(self.ratios), len(self.ratios), len(self.targets), len(self.gains)

    @property
    def size(self) -> int:
        """How many closed loops."""
        return int(np.prod(self.shape))

    def axes(self) -> tuple[np.ndarray, ...]:
        """Both ratios, set point and share of the gain of every closed loop, each of the grid's shape."""
        return np.meshgrid(self.ratios, self.ratios, self.targets, self.gains, indexing="ij")

    def lanes(self) -> np.ndarray:
        first, second, target, gain = self.axes()
        return lanes({self.first: first, self.second: second}, target, gain)


class Interface(eqx.Module):
    """What lies between plant and controller; by default nothing: the true state, at every step, at once."""

    estimator: AbstractEstimator | None = None
    sensor: Sensor | None = None
    every: int = eqx.field(static=True, default=1)  # the controller is called every so many steps
    delay: int = eqx.field(static=True, default=0)  # control periods until its command arrives


NOTHING_BETWEEN = Interface()


class Outcome(NamedTuple):
    """What came of closed loops: arrays of shape (L,), and their positions over time."""

    merits: Merit
    failed_at: np.ndarray  # s; infinity where the controller always answered
    position: np.ndarray  # rad or m, (L, time)


def ratios(points: int) -> np.ndarray:
    """`points` mismatches from 0.5 to 2, evenly by logarithm; an odd number has 1 among them."""
    return np.exp(np.linspace(np.log(LEAST), np.log(MOST), points))


@eqx.filter_jit
def _run(
    system: System,
    controller: AbstractController,
    main_gain: str,
    rows: jax.Array,
    keys: jax.Array,
    time: Series,
    interface: Interface,
) -> tuple[Merit, Scalar, Series]:
    names = tuple(MISMATCHES.values())
    nominal, gain = get_parameters(system, names), get_parameters(controller, [main_gain])

    def one(row: jax.Array, key: jax.Array) -> tuple[Merit, Scalar, Series]:
        plant = set_vector(system, names, nominal * row[: len(names)])
        loop = simulate_closed_loop(
            plant,
            set_vector(controller, [main_gain], gain * row[-1]),
            constant(time, row[-2]),
            time[1] - time[0],
            interface.every,
            estimator=interface.estimator,
            sensor=interface.sensor,
            key=None if interface.sensor is None else key,
            delay=interface.delay,
        )
        return merit(loop, plant), loop.failed_at, loop.run.position

    return jax.vmap(one)(rows, keys)


def closed_loops(
    system: System,
    controller: AbstractController,
    main_gain: str,
    rows: np.ndarray,
    *,
    seconds: float = 10.0,
    dt: float = 0.01,
    interface: Interface = NOTHING_BETWEEN,
    seed: int = 0,
    progress: Progress = quiet,
) -> Outcome:
    """Run every row of `lanes`. Each draws its own sensor noise, from `seed`."""
    time = clock(seconds, dt)
    keys = jax.random.split(jax.random.key(seed), len(rows) + CHUNK)  # some for what fills up the last chunk
    found = []
    for start in range(0, len(rows), CHUNK):
        some = rows[start : start + CHUNK]
        # Filled up by repeating the last, so that one compilation serves every chunk.
        filled = np.concatenate([some, np.repeat(some[-1:], CHUNK - len(some), axis=0)]) if start else some
        own = keys[start : start + len(filled)]
        answer = _run(system, controller, main_gain, jnp.asarray(filled), own, time, interface)
        cut = slice(len(some))
        found.append(jax.tree.map(lambda leaf, cut=cut: np.asarray(leaf)[cut], answer))
        progress("sweeping", min(1.0, (start + len(some)) / len(rows)))
    return Outcome(*jax.tree.map(lambda *leaves: np.concatenate(leaves), *found))
