"""What could be mistaken for an effect that was found: how much their traces overlap, how likely it is by the same runs, and which run separates them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from smajax.attribution.cross_validation import Fitted, Model, Search, Start, base_value, nudged
from smajax.attribution.findings import Confounder
from smajax.attribution.score_test import scaled, switches
from smajax.core.whiteness import correlation_time, split_runs
from smajax.data.experiment.record import Run
from smajax.fit.design import candidate_problem
from smajax.fit.predicted import predicted_at
from smajax.fit.sensitivity import Sensitivity, sensitivity
from smajax.model.effects.library import LIBRARY

# Of itself: all that is left, by rounding, of a trace that other parameters make as well.
ABSORBED = 1e-6


def overlap(at: Sensitivity, trace: np.ndarray, others: Sequence[str], confounder: Sequence[str]) -> float:
    """Share of a trace (samples,), less what the parameters `others` absorb, that the coefficients `confounder` could have made."""
    basis = np.linalg.qr(scaled(at.columns(others)))[0] if others else np.zeros((len(trace), 0))
    own = trace - basis @ (basis.T @ trace)
    columns = at.columns(confounder)
    left = columns - basis @ (basis.T @ columns)
    # What the others absorb to rounding has no direction of its own.
    kept = np.linalg.norm(left, axis=0) > ABSORBED * np.linalg.norm(columns, axis=0)
    size = float(np.linalg.norm(own))
    if not kept.any() or size <= ABSORBED * float(np.linalg.norm(trace)):
        return 0.0
    directions = np.linalg.qr(scaled(left[:, kept]))[0]
    return float(np.linalg.norm(directions.T @ own)) / size


def confounders(setting: Search, model: Model, runs: Sequence[Run]) -> tuple[Confounder, ...]:
    """For each effect of `model` the candidates that leave nearly the same trace, refitted in its place.

    A weight is that of the model with the confounder among `model` and the confounders of the same effect: exp(-C/2), with C the
    squared error on runs left out in turn over the variance of an independent sample of what `model` leaves, averaged
    over draws of the weights of blocks of samples (a Bayesian bootstrap; Yao et al. 2018, "pseudo-BMA+"). Without that a
    difference of the size of its own error would decide. It is a probability only as far as one of them is true and none
    was likelier before.
    """
    outside = [name for name in setting.candidates if name not in model.effects]
    if not model.effects or not outside:
        return ()
    config, names, index = setting.config, setting.problem.names, setting.problem.names.index
    at = sensitivity(setting.problem, nudged(setting, model.values, outside), setting.every)
    loose = setting.loose(model.effects, model.values)
    found: list[tuple[str, str, float]] = []
    for effect in model.effects:
        own = setting.coefficients(effect)
        trace = at.columns(own) @ np.asarray([model.values[index(name)] - base_value(name) for name in own])
        others = [name for name in loose if name not in own]
        like = [(effect, other, overlap(at, trace, others, switches(other))) for other in outside]
        found += [one for one in sorted(like, key=lambda one: -one[2]) if one[2] > config.overlap_refitted][
            : config.confounders_refitted
        ]
    if not found:
        return ()
    starts = []
    for effect, other, _ in found:
        values = np.array(setting.inside(model))
        for name in setting.coefficients(effect):
            values[index(name)] = base_value(name)
        rest = tuple(name for name in model.effects if name != effect)
        starts.append(Start((*rest, other), switched_on(values, names, other, setting.bounds)))
    fits, _ = setting.fit(starts, "refitting what could be mistaken for it", hops=True)
    fitted = [Fitted(start.effects, one) for start, one in zip(starts, fits, strict=True)]
    whole = Fitted(model.effects, setting.known(model))
    scored = setting.cross_validated([whole, *fitted])
    level = setting.levels([whole])[0] * float(setting.problem.noise_sigma) ** 2
    costs = blocks([one.left_out for one in scored], np.asarray(setting.problem.batch.mask)) / level
    result = []
    for place, ((effect, other, alike), one) in enumerate(zip(found, scored[1:], strict=True), 1):
        same = [0, *(k for k, (whose, _, _) in enumerate(found, 1) if whose == effect)]
        share = float(weights(costs[same], config.weight_draws)[same.index(place)])
        what, apart = (
            separating_run(setting, model, one, runs) if share > config.separating_weight else ("", float("nan"))
        )
        result.append(Confounder(effect, other, alike, share, one.left_out_rmse, what, apart))
    return tuple(sorted(result, key=lambda one: -one.weight))


def switched_on(
    values: np.ndarray, names: Sequence[str], effect: str, bounds: Mapping[str, tuple[float, float]]
) -> np.ndarray:
    """`values` (P,) with the coefficients of an effect where fits of it begin."""
    found = np.array(values)
    for name, start in LIBRARY[effect].candidate.initial_guess.items():
        full = f"{effect}.{name}"
        low, high = bounds[full]
        # Runs of a small stroke have small bounds.
        outside = full in switches(effect) and not low < start < high
        found[names.index(full)] = min(start, 0.5 * high) if outside else start
    return found


def blocks(left_out: Sequence[np.ndarray], mask: np.ndarray) -> np.ndarray:
    """Squared error of each model in each block of samples, (models, blocks); blocks are longer than the first's correlation time."""
    rows: list[list[float]] = [[] for _ in left_out]
    length = 2.0 * correlation_time(split_runs(left_out[0], mask))
    for run, valid in enumerate(mask > 0):
        count = max(1, int(valid.sum() / length))
        for row, one in zip(rows, left_out, strict=True):
            row += [float((part**2).sum()) for part in np.array_split(one[run][valid], count)]
    return np.asarray(rows)


def weights(costs: np.ndarray, draws: int) -> np.ndarray:
    """Of models with these costs in blocks, (models, blocks): exp(-C/2), the blocks weighed anew in each of so many `draws`."""
    count = costs.shape[1]
    drawn = count * np.random.default_rng(0).dirichlet(np.ones(count), draws)
    cost = drawn @ costs.T
    share = np.exp(-0.5 * (cost - cost.min(axis=1, keepdims=True)))
    return np.asarray((share / share.sum(axis=1, keepdims=True)).mean(axis=0))


def separating_run(setting: Search, one: Model, other: Model, runs: Sequence[Run]) -> tuple[str, float]:
    """(the candidate run on which two fitted models differ most, rms difference over the noise); "" without a candidate."""
    problem, index = setting.restricted((*one.effects, *other.effects))
    candidates, there = candidate_problem(problem, one.values[index], runs)
    if not candidates:
        return "", float("nan")
    first, second = predicted_at(there, [model.values[index] for model in (one, other)])
    apart = np.sqrt(np.mean(there.centred(first - second) ** 2, axis=1)) / float(setting.problem.noise_sigma)
    best = int(np.argmax(np.nan_to_num(apart, nan=-1.0)))
    return list(candidates)[best], float(apart[best])
