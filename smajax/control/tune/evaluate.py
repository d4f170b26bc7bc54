"""Candidates on members in one batch: terms, their slopes in the gains, and figures of merit.

Slopes are forward: gains are few and loops many. A candidate is a point of the unit cube, the box of the gains by
logarithm.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from smajax.control.closed_loop import watch_closed_loop
from smajax.control.controllers.base import AbstractController
from smajax.control.figures_of_merit import Merit, judge_of
from smajax.control.interface import Interface
from smajax.control.mismatch import MISMATCHES
from smajax.control.presets import Box, ControllerPreset
from smajax.control.reference import clock, constant
from smajax.control.sweep import NUMBER, TARGET, mismatched
from smajax.control.tune.scenarios import Members
from smajax.control.tune.terms import TERMS, Terms, as_judged, as_shown, watch_of
from smajax.core.parameters import check_bounds, get_parameters, set_parameters, set_vector
from smajax.model.system import System
from smajax.model.types import Scalar, Series
from smajax.simulation.batch.axes import zipped
from smajax.simulation.batch.chunks import Function, chunks

LOOPS = 256  # most closed loops of a batch: between two of them a run can be interrupted
STEP = 0.01  # s, of the simulation while tuning
FINE = 0.005  # s, of the simulation that judges
WILD = 1e4  # units of a term per box: a slope beyond it says nothing of the next point


class Seen(NamedTuple):
    """What came of candidates: arrays of shape (candidates, members, ...)."""

    terms: np.ndarray  # (C, M, terms), with derivatives; units of `TERMS`
    slopes: np.ndarray  # (C, M, terms, gains), by the unit cube; of no length where they were not asked for
    judged: np.ndarray  # (C, M, terms), the settling time itself
    merits: Merit

    @property
    def failed(self) -> np.ndarray:
        """(C, M): some number is none."""
        return ~(np.isfinite(self.judged) & np.isfinite(self.terms)).all(axis=2)

    def wild(self, used: np.ndarray | list[int]) -> np.ndarray:
        """(C, M): the slopes of the terms `used` are none, or as large as only a loop without order has them."""
        return ~(np.abs(self.slopes[:, :, used]) < WILD).all(axis=(2, 3))  # nan is not


class _Rig(eqx.Module):
    system: System
    controller: AbstractController
    low: Series  # logarithm of the gains at the cube's corner
    width: Series
    time: Series
    softness: Scalar
    interface: Interface
    key: jax.Array
    names: tuple[str, ...] = eqx.field(static=True)
    smoothed: Callable[[AbstractController, Scalar], AbstractController] | None = eqx.field(static=True)


def _point(rig: _Rig, values: dict[str, Scalar]) -> Scalar:
    return jnp.stack([values[f"at {name}"] for name in rig.names])


def _loop(rig: _Rig, values: dict[str, Scalar], point: Scalar) -> tuple[Terms, Merit]:
    plant, wanted = mismatched(rig.system, values), constant(rig.time, values[TARGET])
    controller = set_vector(rig.controller, rig.names, jnp.exp(rig.low + point * rig.width))
    if rig.smoothed is not None:
        controller = rig.smoothed(controller, rig.softness)
    watch = watch_of(judge_of(plant, wanted), rig.softness)
    dt = rig.time[1] - rig.time[0]
    found, _ = watch_closed_loop(
        watch, plant, controller, wanted, **rig.interface.settings(dt, rig.key, values[NUMBER])
    )
    return found


def _valued(rig: _Rig, values: dict[str, Scalar]) -> dict[str, Any]:
    terms, merit = _loop(rig, values, _point(rig, values))
    judged = as_judged(terms, merit, rig.time[-1])
    return {"terms": as_shown(terms), "judged": judged, "merits": merit}


def _sloped(rig: _Rig, values: dict[str, Scalar]) -> dict[str, Any]:
    def terms_of(point: Scalar) -> tuple[Scalar, tuple[Terms, Merit]]:
        terms, merit = _loop(rig, values, point)
        return as_shown(terms), (terms, merit)

    slopes, (terms, merit) = jax.jacfwd(terms_of, has_aux=True)(_point(rig, values))
    judged = as_judged(terms, merit, rig.time[-1])
    return {"terms": as_shown(terms), "slopes": slopes, "judged": judged, "merits": merit}


class Rig:
    """A controller on its plant, ready to be tried with other gains. `simulations` counts the closed loops so far.

    Raises ValueError for gains that are not the controller's, and bounds that are not positive and rising.
    """

    def __init__(
        self,
        preset: ControllerPreset,
        system: System,
        *,
        box: Box | None = None,
        seconds: float = 10.0,
        interface: Interface | None = None,
        seed: int = 0,
        loops: int = LOOPS,
    ) -> None:
        self.preset = preset
        self.system = preset.plant(system)
        self.controller = preset.make(self.system)
        self.box = dict(preset.box if box is None else box)
        wrong = {name: bounds for name, bounds in self.box.items() if not 0.0 < bounds[0] < bounds[1]}
        if wrong:
            raise ValueError(f"gains are searched by logarithm: bounds must be positive and rise, not {wrong}.")
        for side in (0, 1):
            check_bounds(set_parameters(self.controller, {name: bounds[side] for name, bounds in self.box.items()}))
        self.names = tuple(self.box)
        low, high = np.log(np.asarray(list(self.box.values()))).T
        self._low, self._width = low, high - low
        self.seconds, self.interface, self.seed, self.loops = seconds, interface or Interface(), seed, loops
        self.simulations = 0

    @property
    def before(self) -> np.ndarray:
        """The preset's gains, held in the box, as a point of the cube."""
        return self.point(dict(zip(self.names, np.asarray(get_parameters(self.controller, self.names)), strict=True)))

    def gains(self, point: np.ndarray) -> dict[str, float]:
        """The gains at a point, to six digits: what is judged is what a file holds."""
        values = np.exp(self._low + point * self._width)
        return {name: float(f"{value:.6g}") for name, value in zip(self.names, values, strict=True)}

    def point(self, gains: Mapping[str, float]) -> np.ndarray:
        """The point of gains, held in the cube."""
        values = np.asarray([gains[name] for name in self.names])
        return np.clip((np.log(values) - self._low) / self._width, 0.0, 1.0)

    def held(self, points: np.ndarray) -> np.ndarray:
        """Points (C, gains) as a file holds their gains."""
        return np.stack([self.point(self.gains(one)) for one in points])

    def sloped(self, points: np.ndarray, members: Members, softness: float) -> Seen:
        """Terms with slopes of every point (C, gains); one that switches is smoothed by `softness`."""
        return self._seen(_sloped, points, members, STEP, softness, True)

    def judged(self, points: np.ndarray, members: Members, dt: float = FINE) -> Seen:
        """The same loops as they are, without slopes."""
        return self._seen(_valued, points, members, dt, 0.1, False)

    def _seen(
        self, function: Function, points: np.ndarray, members: Members, dt: float, softness: float, smooth: bool
    ) -> Seen:
        inside = round(STEP / dt)
        interface = dataclasses.replace(self.interface, every=self.interface.every * inside)
        rig = _Rig(
            self.system,
            self.controller,
            jnp.asarray(self._low),
            jnp.asarray(self._width),
            clock(self.seconds, dt),
            jnp.asarray(softness),
            interface,
            jax.random.key(self.seed),
            self.names,
            self.preset.smoothed if smooth else None,
        )
        count, size = len(points), members.size
        columns = {f"at {name}": np.repeat(points[:, k], size) for k, name in enumerate(self.names)}
        columns |= dict(zip((*MISMATCHES, TARGET), np.tile(members.rows, (count, 1)).T, strict=True))
        columns[NUMBER] = np.tile(np.arange(size, dtype=float), count)
        found = []
        for start in range(0, count * size, self.loops):
            # Batches of one size, the last one filled up: one program serves however many starts are left.
            some = np.minimum(np.arange(start, start + self.loops), count * size - 1)
            axes = zipped({name: values[some] for name, values in columns.items()})
            found += [answer for _, answer in chunks(function, rig, axes, self.loops, [0])]
        whole = jax.tree.map(lambda *leaves: np.concatenate(leaves)[: count * size], *found)
        self.simulations += count * size
        by_candidate = jax.tree.map(lambda leaf: leaf.reshape(count, size, *leaf.shape[1:]), whole)
        return Seen(**{"slopes": np.zeros((count, size, len(TERMS), 0)), **by_candidate})
