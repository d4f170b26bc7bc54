"""Which run to do next: candidate inputs within what was applied already, ranked by their expected information."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass

import jax.numpy as jnp
import numpy as np

from smajax.core.display_units import label
from smajax.data.experiment.record import Run
from smajax.fit.packed_runs import RunBatch
from smajax.fit.problem import Problem
from smajax.fit.sensitivity import sensitivity
from smajax.model.channels import channel

LEVELS = (0.4, 0.6, 0.8, 1.0)  # of the range that was applied
MAX_LEVELS = 3  # of an input that is constant within a run
REGULARISATION = 1e-12  # of the information matrix


@dataclass(frozen=True)
class Suggestion:
    """A run that was not done: its inputs and its expected information."""

    what: str
    inputs: dict[str, np.ndarray]  # channel -> (n,)
    information: float  # nats: half the rise of the logarithm of the information's determinant
    shrinks: dict[str, float]  # parameter -> its standard error afterwards over the present one


def _shapes(count: int) -> dict[str, np.ndarray]:
    """Courses between 0 and 1, each of shape (count,)."""
    t = np.arange(count) / count
    staircase = np.concatenate([np.linspace(0.25, 1.0, 4), np.linspace(0.75, 0.0, 4)])
    return {
        "held for 60 % of the run, then off": np.where(t < 0.6, 1.0, 0.0),
        "in three equal pulses": np.where((6.0 * t).astype(int) % 2 == 0, 1.0, 0.0),
        "ramped up and down once": 1.0 - np.abs(2.0 * t - 1.0),
        "ramped up and down three times": 1.0 - np.abs(2.0 * ((3.0 * t) % 1.0) - 1.0),
        "in stairs up and down": staircase[np.minimum((8.0 * t).astype(int), 7)],
    }


def _levels(runs: Sequence[Run], name: str) -> list[float]:
    values = sorted({round(float(np.median(run.inputs[name])), 12) for run in runs})
    return values if len(values) <= MAX_LEVELS else [values[0], values[len(values) // 2], values[-1]]


def _with_unit(name: str, value: float) -> str:
    """The value of an input (SI) in its display unit: `93 °C`."""
    display = channel(name)
    return display.with_unit(value)


def candidate_runs(runs: Sequence[Run]) -> dict[str, dict[str, np.ndarray]]:
    """Inputs by their description: the channel that varies most takes each course, the others the values they had.

    Empty where nothing varies within a run.
    """
    swing = {
        name: max(float(np.ptp(run.inputs[name])) for run in runs)
        / (max(float(np.abs(run.inputs[name]).max()) for run in runs) or 1.0)
        for name in runs[0].inputs
    }
    main = max(swing, key=lambda name: swing[name])
    if swing[main] == 0.0:
        return {}
    count = int(np.median([len(run.time) for run in runs]))
    low = min(float(run.inputs[main].min()) for run in runs)
    high = max(float(run.inputs[main].max()) for run in runs)
    others = [name for name in runs[0].inputs if name != main]
    candidates = {}
    for (shape, course), level in itertools.product(_shapes(count).items(), LEVELS):
        for values in itertools.product(*(_levels(runs, name) for name in others)):
            top = low + level * (high - low)
            constant = "".join(
                f", {label(name)} {_with_unit(name, value)}" for name, value in zip(others, values, strict=True)
            )
            series = {name: np.full(count, value) for name, value in zip(others, values, strict=True)}
            candidates[f"{label(main)} {shape}, up to {_with_unit(main, top)}{constant}"] = {
                main: low + course * (top - low),
                **series,
            }
    return candidates


def candidate_problem(
    problem: Problem, values: np.ndarray, runs: Sequence[Run]
) -> tuple[dict[str, dict[str, np.ndarray]], Problem]:
    """(candidate runs by their description, the problem that has them as its runs) at the fit `values` (P,)."""
    candidates = candidate_runs(runs)
    batch = problem.batch
    series = list(candidates.values())
    if not series:
        return {}, problem
    length = len(next(iter(series[0].values())))
    blank = np.zeros((len(series) * len(batch.outputs), length))
    # Parameters that a run overrides: as in the first one; those with one value for each run: the mean of them.
    mean = np.asarray(problem.per_run_at(jnp.asarray(values))).mean(axis=0, keepdims=True)
    overrides = np.repeat(np.concatenate([batch.overrides[:1], mean], axis=1), len(series), axis=0)
    inputs = {name: jnp.asarray(np.stack([one[name] for one in series])) for name in batch.inputs}
    overridden = (*batch.override_names, *problem.per_run.names)
    runs_to_try = RunBatch(
        inputs,
        *map(jnp.asarray, (blank, np.ones_like(blank), overrides)),
        overridden,
        batch.dt,
        batch.outputs,
        batch.integration,
    )
    system = problem.system_at(jnp.asarray(values))
    return candidates, problem.with_system(system, runs_to_try)


def suggestions(
    problem: Problem, values: np.ndarray, names: Sequence[str], runs: Sequence[Run], inflation: float, count: int = 5
) -> tuple[Suggestion, ...]:
    """The `count` best candidates for the parameters `names` at the fit `values` (P,), best first; D-optimal.

    The information of a run is that of its Jacobian at the fit, each run's offset taken off where the experiment has
    one: it holds for the model as fitted, not for an effect that the model lacks.
    """
    candidates, to_try = candidate_problem(problem, values, runs)
    if not candidates or not names:
        return ()
    scale = np.asarray([abs(values[problem.names.index(name)]) or 1.0 for name in names])
    at = sensitivity(problem.with_mean_slopes(), values, names)
    columns, priors = at.columns(names) * scale, at.prior_columns(names) * scale
    shared = [name for name in names if name in to_try.names]
    there = sensitivity(to_try.with_mean_slopes(), to_try.start_values(), shared)
    information = columns.T @ columns / inflation + priors.T @ priors + REGULARISATION * np.eye(len(names))
    before = np.sqrt(np.diag(np.linalg.inv(information)))
    ranked = []
    by_run = np.zeros((len(candidates), to_try.measured.size // len(candidates), len(names)))
    by_run[..., [list(names).index(name) for name in shared]] = there.jacobian.reshape(len(candidates), -1, len(shared))
    for (what, one), jacobian in zip(candidates.items(), by_run, strict=True):
        added = jacobian * scale
        if not np.isfinite(added).all():
            continue
        after = information + added.T @ added / inflation
        gain = 0.5 * float(np.linalg.slogdet(after)[1] - np.linalg.slogdet(information)[1])
        errors = np.sqrt(np.diag(np.linalg.inv(after))) / before
        shrinks = {name: float(error) for name, error in zip(names, errors, strict=True) if name in shared}
        ranked.append(Suggestion(what, one, gain, shrinks))
    return tuple(sorted(ranked, key=lambda one: -one.information)[:count])
