"""What could be mistaken for an effect that was found: how alike, how likely by the same runs, and which run tells them apart."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from smajax.attribution.judging import Fitted, Model, Search, Start, base_value, nudged
from smajax.attribution.screen import Score, scaled, switches
from smajax.attribution.search import start_values
from smajax.design import trial
from smajax.experiment.record import Run
from smajax.fit.sensitivity import Sensitivity, sensitivity
from smajax.fit.shown import shown_at
from smajax.report.findings import Rival

ALIKE = 0.7  # of an effect's trace: from here on a rival is worth a refit
REFITTED = 3  # rivals of each effect
ABSORBED = 1e-6  # of itself: all that is left of a trace that other parameters make as well
LIKELY = 0.01  # weight from which on a run that tells the two apart is looked for


def imitation(at: Sensitivity, trace: np.ndarray, others: Sequence[str], rival: Sequence[str]) -> float:
    """Share of a trace (samples,), less what the parameters `others` absorb, that `rival`'s coefficients could have made."""
    basis = np.linalg.qr(scaled(at.columns(others)))[0] if others else np.zeros((len(trace), 0))
    own = trace - basis @ (basis.T @ trace)
    columns = at.columns(rival)
    left = columns - basis @ (basis.T @ columns)
    # What the others absorb to rounding has no direction of its own.
    kept = np.linalg.norm(left, axis=0) > ABSORBED * np.linalg.norm(columns, axis=0)
    size = float(np.linalg.norm(own))
    if not kept.any() or size <= ABSORBED * float(np.linalg.norm(trace)):
        return 0.0
    directions = np.linalg.qr(scaled(left[:, kept]))[0]
    return float(np.linalg.norm(directions.T @ own)) / size


def rivals(setting: Search, model: Model, runs: Sequence[Run]) -> tuple[Rival, ...]:
    """For each effect of `model` the candidates that leave nearly the same trace, refitted in its place.

    A weight is that of the model with the rival among all of them, `model` too: exp(-C/2) with C the squared error on
    runs left out in turn over the variance of an independent sample of what `model` leaves. It is a probability only as
    far as one of them is true and none was likelier before.
    """
    outside = [name for name in setting.candidates if name not in model.effects]
    if not model.effects or not outside:
        return ()
    names, index = setting.problem.names, setting.problem.names.index
    at = sensitivity(setting.problem, nudged(setting, model.values, outside), setting.every)
    loose = setting.loose(model.effects, model.values)
    found: list[tuple[str, str, float]] = []
    for effect in model.effects:
        own = setting.coefficients(effect)
        trace = at.columns(own) @ np.asarray([model.values[index(name)] - base_value(name) for name in own])
        others = [name for name in loose if name not in own]
        like = [(effect, rival, imitation(at, trace, others, switches(rival))) for rival in outside]
        found += [one for one in sorted(like, key=lambda one: -one[2]) if one[2] > ALIKE][:REFITTED]
    if not found:
        return ()
    starts = []
    for effect, rival, _ in found:
        values = np.array(setting.inside(model))
        for name in setting.coefficients(effect):
            values[index(name)] = base_value(name)
        rest = tuple(name for name in model.effects if name != effect)
        towards = Score((rival,), 0.0, 0.0, 1.0, {})
        starts.append(Start((*rest, rival), start_values(values, names, towards, setting.bounds)))
    fits, _ = setting.fit(starts, "refitting what could be mistaken for it", hops=True)
    fitted = [Fitted(begun.effects, one) for begun, one in zip(starts, fits, strict=True)]
    whole = Fitted(model.effects, setting.known(model))
    judged = setting.judged([whole, *fitted])
    level = setting.levels([whole])[0] * float(setting.problem.noise_sigma) ** 2
    cost = np.asarray([float((one.left_out**2).sum()) / level for one in judged])
    weight = np.exp(-0.5 * (cost - cost.min()))
    weight /= weight.sum()
    told = []
    for (effect, rival, alike), one, share in zip(found, judged[1:], weight[1:], strict=True):
        what, apart = separating_run(setting, model, one, runs) if share > LIKELY else ("", float("nan"))
        told.append(Rival(effect, rival, alike, float(share), one.left_out_rmse, what, apart))
    return tuple(sorted(told, key=lambda one: -one.weight))


def separating_run(setting: Search, one: Model, other: Model, runs: Sequence[Run]) -> tuple[str, float]:
    """(the candidate run on which two fitted models differ most, rms difference over the noise); "" without a candidate."""
    problem, index = setting.restricted((*one.effects, *other.effects))
    candidates, there = trial(problem, one.values[index], runs)
    if not candidates:
        return "", float("nan")
    first, second = shown_at(there, [model.values[index] for model in (one, other)])
    apart = np.sqrt(np.mean(there.centred(first - second) ** 2, axis=1)) / float(setting.problem.noise_sigma)
    best = int(np.argmax(np.nan_to_num(apart, nan=-1.0)))
    return list(candidates)[best], float(apart[best])
