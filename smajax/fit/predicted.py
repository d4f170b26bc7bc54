"""What the sensors show of simulated runs, and how it moves with the parameters, at many points at once.

Each pair of a point and a direction is one run of a compiled program, in forward mode.
"""

from __future__ import annotations

from collections.abc import Sequence

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from smajax.core.parameters import set_vector
from smajax.engine import program
from smajax.fit.packed_runs import shown_run
from smajax.fit.problem import Problem
from smajax.model.system import System
from smajax.model.types import Series

ROOM = 2**28  # bytes of what is shown at once: of long runs some points after the others
FEW = 256  # points whose derivatives nobody asked for: sooner had than a second program that has none


class _Run(eqx.Module):
    """One run of a problem, without the values that are asked for."""

    system: System
    inputs: dict[str, Series]
    overrides: jax.Array
    dt: jax.Array
    shared: tuple[str, ...] = eqx.field(static=True)
    override_names: tuple[str, ...] = eqx.field(static=True)
    own: tuple[str, ...] = eqx.field(static=True)
    outputs: tuple[str, ...] = eqx.field(static=True)


def _runs(problem: Problem) -> list[_Run]:
    batch = problem.batch
    dt = jnp.asarray(batch.dt, dtype=float)
    names = problem.shared, batch.override_names, problem.own.names, batch.outputs
    return [
        _Run(
            problem.system,
            {name: series[run] for name, series in batch.inputs.items()},
            batch.overrides[run],
            dt,
            *names,
        )
        for run in range(batch.runs)
    ]


def _shown(run: _Run, values: jax.Array) -> jax.Array:
    """(outputs, N) at the values of what all runs share and of what is the run's own."""
    count = len(run.shared)
    system = set_vector(run.system, run.shared, values[:count])
    own = jnp.concatenate([run.overrides, values[count:]])
    return shown_run(system, run.inputs, own, (*run.override_names, *run.own), run.dt, run.outputs)


def _vector(own: dict[str, jax.Array], what: str) -> jax.Array:
    return jnp.stack([own[f"{what} {k}"] for k in range(sum(name.startswith(what) for name in own))])


def _at(run: _Run, own: dict[str, jax.Array]) -> jax.Array:
    return _shown(run, _vector(own, "value"))


def _along(run: _Run, own: dict[str, jax.Array]) -> tuple[jax.Array, jax.Array]:
    values, towards = _vector(own, "value"), _vector(own, "towards")
    return jax.jvp(lambda there: _shown(run, there), (values,), (towards,))


def _columns(what: str, rows: np.ndarray) -> dict[str, np.ndarray]:
    return {f"{what} {k}": column for k, column in enumerate(rows.T)}


def _of_run(problem: Problem, points: np.ndarray, run: int) -> np.ndarray:
    """What one run depends on, of points (..., P): the shared values and its own."""
    count, own = len(problem.shared), problem.own.start.shape[1]
    start = count + run * own
    return np.concatenate([points[..., :count], points[..., start : start + own]], axis=-1)


def in_parts(problem: Problem, count: int, directions: int = 1) -> list[slice]:
    """`count` points, with so many series each, cut so that the series of a part have room at once."""
    at_once = max(1, ROOM // max(directions * problem.measured.nbytes, 1))
    return [slice(start, start + at_once) for start in range(0, count, at_once)]


def shown_at(problem: Problem, points: Sequence[np.ndarray] | np.ndarray) -> np.ndarray:
    """What the sensors show at points (M, P): (M, series, N), SI."""
    asked = np.asarray(points, dtype=float)
    parts = in_parts(problem, len(asked))
    if len(parts) > 1:
        return np.concatenate([shown_at(problem, asked[part]) for part in parts])
    if len(asked) <= FEW:
        nowhere = np.zeros((len(asked), 1, asked.shape[1]))
        return shown_and_slopes(problem, asked, nowhere)[0]
    found = []
    for number, run in enumerate(_runs(problem)):
        own = _columns("value", _of_run(problem, asked, number))
        found.append(program(_at, run, tuple(own))(run, own))
    return np.concatenate(found, axis=1)


def misfits(problem: Problem, points: Sequence[np.ndarray] | np.ndarray) -> np.ndarray:
    """Misfit (SI) of every series at every point, shape (M, series, N)."""
    return problem.centred(problem.measured - shown_at(problem, points))


def squares(problem: Problem, points: Sequence[np.ndarray] | np.ndarray) -> np.ndarray:
    """Sum of the squared misfits over the noise at every point, (M,): of long runs no more than some are held at once."""
    asked = np.asarray(points, dtype=float)
    found = (misfits(problem, asked[part]) / np.asarray(problem.noise) for part in in_parts(problem, len(asked)))
    return np.concatenate([(one**2).sum(axis=(1, 2)) for one in found])


def shown_and_slopes(problem: Problem, points: np.ndarray, towards: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """What the sensors show at points (M, P), and its derivatives along (M, S, P).

    Arrays (M, series, N) and (M, S, series, N).
    """
    members, directions = towards.shape[:2]
    if directions == 0:
        return shown_at(problem, points), np.zeros((members, 0, *problem.batch.output.shape))
    pairs = np.repeat(points, directions, axis=0), towards.reshape(members * directions, -1)
    values, slopes = [], []
    for number, run in enumerate(_runs(problem)):
        at, along = (_of_run(problem, one, number) for one in pairs)
        own = {**_columns("value", at), **_columns("towards", along)}
        value, slope = program(_along, run, tuple(own))(run, own)
        values.append(value[::directions])
        slopes.append(slope.reshape(members, directions, *slope.shape[1:]))
    return np.concatenate(values, axis=1), np.concatenate(slopes, axis=2)
