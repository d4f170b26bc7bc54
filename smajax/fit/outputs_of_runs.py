"""Predicted sensor outputs of the runs and their derivatives by the parameters, at many points at once.

A point and some of its directions are one run of a compiled program, in forward mode.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from typing import Any, TypeVar

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from smajax.core.operating_system import available_cores
from smajax.core.parameters import set_vector
from smajax.engine import Along, Program, Wanted, begin_programs, by_machine_code, program, programs
from smajax.fit.needed_directions import NeededDirections
from smajax.fit.packed_runs import predict_run
from smajax.fit.problem import Problem
from smajax.model.system import System
from smajax.model.types import Series
from smajax.simulation.steppers import Integration

Function = Callable[[Any, Any], Any]
Result = TypeVar("Result")
MAX_BYTES = 2**28  # of predicted outputs at once: of long runs some points after the others
SHORT = 1000  # samples of a run, up to which quick compiling saves more time than the runs of a fit then lose
# Derivatives that a run computes beside its outputs: the solution of each step and the slopes of its equations serve all of them. Of runs with as many samples
# as that four take half of the time that they take one by one, and their program a third more to translate; with two a third less, and a tenth.
ALONG_MANY, ALONG_FEW, MANY_SAMPLES = 4, 2, 500
FEW = 256  # points up to which derivatives that nobody needs, half of the time, are quicker than compiling a second program without them


class _Run(eqx.Module):
    """One run of a problem, without the values at which it is predicted."""

    system: System
    inputs: dict[str, Series]
    overrides: jax.Array
    dt: jax.Array
    shared: tuple[str, ...] = eqx.field(static=True)
    override_names: tuple[str, ...] = eqx.field(static=True)
    per_run: tuple[str, ...] = eqx.field(static=True)
    outputs: tuple[str, ...] = eqx.field(static=True)
    integration: Integration
    # What was measured of it, and at one of the levels, where a sensor of the system shows levels: (outputs, N) and (outputs,).
    seen: tuple[np.ndarray, np.ndarray] | None = None


def _runs(problem: Problem) -> list[_Run]:
    batch = problem.batch
    # numpy's arrays: of JAX's each index is a program of its own, which takes longer than a short run.
    inputs = {name: np.asarray(series) for name, series in batch.inputs.items()}
    overrides, dt = np.asarray(batch.overrides), np.asarray(batch.dt, dtype=float)
    names = problem.shared, batch.override_names, problem.per_run.names, batch.outputs
    seen = batch.seen_by(problem.system)
    return [
        _Run(
            problem.system,
            {name: series[run] for name, series in inputs.items()},
            overrides[run],
            dt,
            *names,
            batch.integration,
            None if seen is None else (seen.samples[run], seen.level[run]),
        )
        for run in range(batch.runs)
    ]


def _predict(run: _Run, values: jax.Array) -> jax.Array:
    """(outputs, N) at the values that all runs share, followed by those of this run."""
    count = len(run.shared)
    system = set_vector(run.system, run.shared, values[:count])
    overrides = jnp.concatenate([run.overrides, values[count:]])
    return predict_run(
        system,
        run.inputs,
        overrides,
        (*run.override_names, *run.per_run),
        run.dt,
        run.outputs,
        run.integration,
        once=True,
        seen=run.seen,
    )


def _vector(scalars: dict[str, jax.Array], kind: str) -> jax.Array:
    return jnp.stack([scalars[f"{kind} {k}"] for k in range(sum(name.startswith(kind) for name in scalars))])


def _at(run: _Run, scalars: dict[str, jax.Array]) -> jax.Array:
    return _predict(run, _vector(scalars, "value"))


def _along(run: _Run, scalars: dict[str, jax.Array]) -> tuple[jax.Array, jax.Array]:
    values, tangent = _vector(scalars, "value"), _vector(scalars, "tangent")
    return jax.jvp(lambda point: _predict(run, point), (values,), (tangent,))


def directions_of(problem: Problem) -> int:
    """Derivatives that a run of a fit's program computes; of XLA's one, to which every direction is a run."""
    if not by_machine_code():
        return 1
    return ALONG_MANY if problem.batch.output.shape[-1] >= MANY_SAMPLES else ALONG_FEW


def runs_of_derivatives(problem: Problem, points: int, directions: int) -> int:
    """How many runs of a fit's program give the derivatives at so many points along so many directions."""
    return points * -(-directions // directions_of(problem))


def _wanted(problem: Problem, function: Function, run: _Run, names: Collection[str]) -> Wanted:
    """`function` of a run of the problem, compiled quickly or not by what it is made for, the length of a run."""
    quickly = problem.batch.output.shape[-1] <= SHORT
    tangents = tuple(name for name in names if name.startswith("tangent"))
    along = Along(tangents, directions_of(problem)) if tangents else Along()
    return Wanted(function, run, tuple(names), quickly=quickly, along=along)


def _program(problem: Problem, function: Function, run: _Run, names: Collection[str]) -> Program:
    return program(**_wanted(problem, function, run, names)._asdict())


def _columns(kind: str, rows: np.ndarray) -> dict[str, np.ndarray]:
    """Of rows (..., P) each column by its name."""
    return {f"{kind} {k}": rows[..., k] for k in range(rows.shape[-1])}


def _of_run(problem: Problem, points: np.ndarray, run: int) -> np.ndarray:
    """What one run depends on, of points (..., P): the shared values and those of this run."""
    count, per_run = len(problem.shared), problem.per_run.start.shape[1]
    start = count + run * per_run
    return np.concatenate([points[..., :count], points[..., start : start + per_run]], axis=-1)


def chunks(problem: Problem, count: int, directions: int = 1) -> list[slice]:
    """`count` points, with so many directions each, cut so that the series of a part take at most `MAX_BYTES`."""
    series = runs_of_derivatives(problem, 1, directions) * directions_of(problem)
    at_once = max(1, MAX_BYTES // max(series * problem.measured.nbytes, 1))
    return [slice(start, start + at_once) for start in range(0, count, at_once)]


def predicted_at(problem: Problem, points: Sequence[np.ndarray] | np.ndarray, fitted: bool = True) -> np.ndarray:
    """Predicted sensor outputs at points (M, P): (M, series, N), SI. `fitted`: whether the problem is, so that a program with derivatives is there."""
    rows = np.asarray(points, dtype=float)
    parts = chunks(problem, len(rows))
    if len(parts) > 1:
        return np.concatenate([predicted_at(problem, rows[part], fitted) for part in parts])
    if fitted and len(rows) <= FEW:
        zero = np.zeros((len(rows), 1, rows.shape[1]))
        return predicted_and_derivatives(problem, rows, zero)[0]
    outputs = []
    for number, run in enumerate(_runs(problem)):
        scalars = _columns("value", _of_run(problem, rows, number))
        outputs.append(_program(problem, _at, run, scalars)(run, scalars))
    return np.concatenate(outputs, axis=1)


def misfits(problem: Problem, points: Sequence[np.ndarray] | np.ndarray) -> np.ndarray:
    """Misfit (SI) of every series at every point, shape (M, series, N)."""
    return problem.centred(problem.measured - predicted_at(problem, points))


def sums_of_squares(problem: Problem, points: Sequence[np.ndarray] | np.ndarray) -> np.ndarray:
    """Sum of the squared misfits over the noise at every point, (M,): of long runs only some are in memory at once."""
    rows = np.asarray(points, dtype=float)
    scaled = (misfits(problem, rows[part]) / np.asarray(problem.noise) for part in chunks(problem, len(rows)))
    return np.concatenate([(misfit**2).sum(axis=(1, 2)) for misfit in scaled])


def total_costs(problem: Problem, points: Sequence[np.ndarray] | np.ndarray) -> np.ndarray:
    """Sum of squares at every point, (M,), the priors' with it."""
    rows = np.asarray(points, dtype=float)
    prior = np.asarray([float(np.sum(problem.priors.rows(point) ** 2)) for point in rows])
    return sums_of_squares(problem, rows) + prior


def _derivatives_of(problems: Sequence[Problem]) -> list[Wanted]:
    """What `predicted_and_derivatives` of these problems runs."""
    wanted = []
    for problem in problems:
        at = _of_run(problem, np.zeros((1, len(problem.names))), 0)
        names = {**_columns("value", at), **_columns("tangent", at)}
        # All runs are packed to one length, and share a program.
        wanted.append(_wanted(problem, _along, _runs(problem)[0], names))
    return wanted


def begin_derivatives(problems: Sequence[Problem]) -> None:
    """Have a second process, where there is one, compile what `predicted_and_derivatives` of these problems runs."""
    begin_programs(_derivatives_of(problems))


def made_ready(problems: Sequence[Problem]) -> None:
    """Compile what `predicted_and_derivatives` of these problems runs."""
    if len(problems) > 1:  # of one, its first call compiles it
        programs(_derivatives_of(problems))


def predicted_and_derivatives(
    problem: Problem, points: np.ndarray, tangents: np.ndarray, asked: np.ndarray | None = None
) -> tuple[np.ndarray, np.ndarray]:
    """Predicted sensor outputs at points (M, P), and their derivatives along tangents (M, S, P).

    Arrays (M, series, N) and (M, S, series, N). `asked`, (M, R): of which runs derivatives are, at each point, None: of all; zero of the others.
    """
    count, directions = tangents.shape[:2]
    if directions == 0:
        return predicted_at(problem, points), np.zeros((count, 0, *problem.batch.output.shape))
    asked = np.ones((count, problem.batch.runs), bool) if asked is None else asked
    needed, runs, scalars = [], _runs(problem), []
    for number in range(len(runs)):
        at, along = (_of_run(problem, part, number) for part in (points, tangents))
        needed.append(NeededDirections.of(at, along, asked[:, number], directions_of(problem)))
        scalars.append({**_columns("value", needed[-1].points), **_columns("tangent", needed[-1].tangents)})
    made = _program(problem, _along, runs[0], scalars[0])  # all runs are packed to one length, and share it
    calls = [partial(made, run, own) for run, own in zip(runs, scalars, strict=True)]  # and the number of threads
    results = _side_by_side(calls)
    predicted = [own.predicted(value[:, 0]) for own, (value, _) in zip(needed, results, strict=True)]
    derivatives = [own.derivatives(along) for own, (_, along) in zip(needed, results, strict=True)]
    return np.concatenate(predicted, axis=1), np.concatenate(derivatives, axis=2)


def slopes_at(problem: Problem, points: Sequence[np.ndarray], names: Sequence[str]) -> np.ndarray:
    """Derivative of the sensor outputs at each of the points (P,) by one parameter each, centred, SI: (M, series, N).

    Slopes at one point that follow each other share its runs.
    """
    if not points:
        return np.zeros((0, *problem.measured.shape))
    each = directions_of(problem)
    begins: list[int] = []  # the first slope of each run
    places: list[tuple[int, int]] = []  # run and direction of each slope
    for number, point in enumerate(points):
        if not begins or places[-1][1] == each - 1 or not np.array_equal(point, points[begins[-1]]):
            begins.append(number)
        places.append((len(begins) - 1, number - begins[-1]))
    rows, columns = np.transpose(places)
    tangents = np.zeros((len(begins), each, len(problem.names)))
    tangents[rows, columns, [problem.names.index(name) for name in names]] = 1.0
    _, derivatives = predicted_and_derivatives(problem, np.stack([points[one] for one in begins]), tangents)
    return problem.centred(derivatives[rows, columns])


def _side_by_side(calls: Sequence[Callable[[int], Result]]) -> list[Result]:
    """What the calls give, each told how many threads it may take.

    As many as there are cores go side by side, on one thread each: cut into parts of few vectors a run takes longer. What is left after that is cut.
    """
    cores = available_cores()
    left = len(calls) % cores
    threads = [1] * (len(calls) - left) + [cores // max(left, 1)] * left
    if min(len(calls), cores) < 2:
        return [call(share) for call, share in zip(calls, threads, strict=True)]
    try:
        with ThreadPoolExecutor(min(len(calls), cores)) as pool:
            return list(pool.map(lambda call, share: call(share), calls, threads))
    except RuntimeError:  # no room for another thread under a cap on memory
        return [call(1) for call in calls]
