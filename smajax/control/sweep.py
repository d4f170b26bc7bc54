"""Robustness of controllers: plants that are not what the controller believes, in one batch a controller.

A mismatch multiplies one parameter of the plant; the controller keeps its gains and what it believes. Every combination
of two mismatches, set points and shares of the controller's main gain is one closed loop; one program runs them all,
`CHUNK` at a time side by side. The air's temperature is multiplied in degrees Celsius: 20 C becomes 10 to 40 C.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from smajax.control.closed_loop import simulate_closed_loop
from smajax.control.controllers.base import AbstractController
from smajax.control.figures_of_merit import Merit, judged_loop
from smajax.control.interface import Interface
from smajax.control.mismatch import MISMATCHES
from smajax.control.reference import Reference, clock, constant
from smajax.core.names import instead
from smajax.core.parameters import get_parameters, set_vector
from smajax.core.progress import Progress, Stage, quiet
from smajax.model.system import System
from smajax.model.types import Scalar, Series
from smajax.simulation.batch.axes import zipped
from smajax.simulation.batch.chunks import Function, chunks

LEAST, MOST = 0.5, 2.0  # the mismatches looked at, plant over belief
TARGET, GAIN, NUMBER = "set point", "share of the gain", "number"
CHUNK = 1024  # loops between two marks of progress


def lanes(
    mismatches: Mapping[str, np.ndarray | float], target: np.ndarray | float, gain: np.ndarray | float = 1.0
) -> np.ndarray:
    """One row a closed loop, (L, mismatches + 2): every mismatch (1 where none is given), set point (rad), share of the gain.

    Raises ValueError for a mismatch there is not.
    """
    unknown = [name for name in mismatches if name not in MISMATCHES]
    if unknown:
        raise ValueError(f"no mismatch `{', '.join(unknown)}`; there are {', '.join(sorted(MISMATCHES))}.")
    columns = [mismatches.get(name, 1.0) for name in MISMATCHES]
    return np.stack([np.ravel(column) for column in np.broadcast_arrays(*columns, target, gain)], axis=1)


def check_mismatches(first: str, second: str) -> None:
    """ValueError for a mismatch there is not, or twice the same; `second` is "" where there is one alone."""
    for name in (first, second) if second else (first,):
        if name not in MISMATCHES:
            raise ValueError(f"no mismatch `{name}`{instead(name, MISMATCHES, 'there are')}.")
    if first == second:
        raise ValueError(f"`{first}` twice, expected one mismatch or two different ones of {', '.join(MISMATCHES)}.")


@dataclass(frozen=True)
class Grid:
    """The product of two mismatches (plant over belief) or one, set points (rad) and shares of the main gain.

    Raises ValueError for a mismatch there is not, or twice the same.
    """

    first: str
    second: str  # "": there is one alone
    ratios: np.ndarray  # (A,), for both
    targets: np.ndarray  # (S,), rad
    gains: np.ndarray  # (G,), share of the preset's main gain

    def __post_init__(self) -> None:
        check_mismatches(self.first, self.second)

    @property
    def mismatches(self) -> tuple[str, ...]:
        return (self.first, self.second) if self.second else (self.first,)

    @property
    def shape(self) -> tuple[int, int, int, int]:
        """(A, A, S, G); (A, 1, S, G) of one mismatch alone."""
        return len(self.ratios), len(self._second), len(self.targets), len(self.gains)

    @property
    def _second(self) -> np.ndarray:
        return self.ratios if self.second else np.ones(1)

    @property
    def size(self) -> int:
        """How many closed loops."""
        return int(np.prod(self.shape))

    def axes(self) -> tuple[np.ndarray, ...]:
        """Both ratios, set point and share of the gain of every closed loop, each of the grid's shape."""
        return np.meshgrid(self.ratios, self._second, self.targets, self.gains, indexing="ij")

    def lanes(self) -> np.ndarray:
        *shares, target, gain = self.axes()
        return lanes(dict(zip(self.mismatches, shares, strict=False)), target, gain)


NOTHING_BETWEEN = Interface()


def mismatched(system: System, ratios: Mapping[str, Scalar]) -> System:
    """The plant whose parameters are `ratios` (by the names of `MISMATCHES`) times those of `system`."""
    own = tuple(MISMATCHES.values())
    shares = jnp.stack([ratios[name] for name in MISMATCHES])
    return set_vector(system, own, get_parameters(system, own) * shares)


class Outcome(NamedTuple):
    """What came of closed loops: arrays of shape (L,)."""

    merits: Merit
    failed_at: np.ndarray  # s; infinity where the controller always answered


def ratios(points: int) -> np.ndarray:
    """`points` mismatches from 0.5 to 2, evenly by logarithm; an odd number has 1 among them."""
    return np.exp(np.linspace(np.log(LEAST), np.log(MOST), points))


class _Rig(eqx.Module):
    """What all closed loops have in common."""

    system: System
    controller: AbstractController
    time: Series
    interface: Interface
    key: jax.Array
    main_gain: str = eqx.field(static=True)


def _setting(rig: _Rig, values: dict[str, Scalar]) -> tuple[System, AbstractController, Reference, dict[str, Any]]:
    """Plant, controller, set point and interface of one closed loop."""
    gain = get_parameters(rig.controller, [rig.main_gain]) * values[GAIN]
    interface = rig.interface.settings(rig.time[1] - rig.time[0], rig.key, values[NUMBER])
    controller = set_vector(rig.controller, [rig.main_gain], gain)
    return mismatched(rig.system, values), controller, constant(rig.time, values[TARGET]), interface


def _judged(rig: _Rig, values: dict[str, Scalar]) -> dict[str, Any]:
    plant, controller, wanted, interface = _setting(rig, values)
    merits, failed_at = judged_loop(plant, controller, wanted, **interface)
    return {"merits": merits, "failed_at": failed_at}


def _drawn(rig: _Rig, values: dict[str, Scalar]) -> dict[str, Any]:
    plant, controller, wanted, interface = _setting(rig, values)
    return {"position": simulate_closed_loop(plant, controller, wanted, **interface).run.position}


def _run(
    function: Function,
    system: System,
    controller: AbstractController,
    main_gain: str,
    rows: np.ndarray,
    seconds: float,
    dt: float,
    interface: Interface,
    seed: int,
    progress: Progress,
) -> Any:
    rig = _Rig(system, controller, clock(seconds, dt), interface, jax.random.key(seed), main_gain)
    columns = dict(zip((*MISMATCHES, TARGET, GAIN), rows.T, strict=True))
    axes = zipped({**columns, NUMBER: np.arange(len(rows))})
    count = -(-len(rows) // CHUNK)
    found = []
    for number, answer in chunks(function, rig, axes, min(CHUNK, len(rows)), range(count)):
        found.append(answer)
        progress(Stage("sweeping", (number + 1) / count))
    return jax.tree.map(lambda *leaves: np.concatenate(leaves), *found)


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
    """Run every row of `lanes`, on all devices; trajectories are not stored. Each draws its own noise, from `seed`."""
    whole = _run(_judged, system, controller, main_gain, rows, seconds, dt, interface, seed, progress)
    return Outcome(whole["merits"], whole["failed_at"])


def positions(
    system: System,
    controller: AbstractController,
    main_gain: str,
    rows: np.ndarray,
    *,
    seconds: float = 10.0,
    dt: float = 0.01,
    interface: Interface = NOTHING_BETWEEN,
    seed: int = 0,
) -> np.ndarray:
    """Positions over time of every row of `lanes`, (L, time), rad or m: for the few that are drawn."""
    return _run(_drawn, system, controller, main_gain, rows, seconds, dt, interface, seed, quiet)["position"]
