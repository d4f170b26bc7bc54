"""What could be mistaken for an effect that was found: the likeliest models with another effect in its place, and which run separates them."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Sequence

import numpy as np

from smajax.attribution.findings import Confounder
from smajax.attribution.fitted_sets import JointSearch
from smajax.attribution.joint_parameters import JointParameters
from smajax.attribution.laplace_evidence import FittedModel
from smajax.attribution.model_fits import Model, Search
from smajax.attribution.optimum import at_optimum
from smajax.attribution.score_test import scaled
from smajax.attribution.side_by_side import program_compiled
from smajax.attribution.traces import Traces, traces_at
from smajax.data.experiment.record import Run
from smajax.fit.design import candidate_problem
from smajax.fit.outputs_of_runs import predicted_at

# Of itself: all that is left, by rounding, of a trace that other parameters make as well.
ABSORBED = 1e-6
# In log likelihood behind the model found: what a fit that the search ended may still have to come to.
NEAR = 30.0
WIDE = 10.0  # times the widths of the priors: hardly any
REFINED = 2  # of each effect's, the likeliest


def confounders(search: JointSearch, setting: Search, model: Model, runs: Sequence[Run]) -> tuple[Confounder, ...]:
    """For each effect of `model` the models that the search fitted with another effect in its place, likeliest first.

    Those whose trace overlaps with the effect's by `overlap_listed`, with a weight of `separating_weight`, or that the runs alone do not tell from
    the effect.

    A weight is the posterior probability of the model with the confounder among `model` and all confounders of the same
    effect: by the evidence of their fits and the prior odds of the effects. Where that is small, but the runs alone hardly tell the two
    (`told_by_runs`) and would tell the model without either, it comes from the priors, and the confounder is `only_by_priors` less likely.
    """
    own = search.joint.ordered(model.effects)
    if not own or own not in search.fitted:
        return ()
    fitted, config = search.fitted[own], setting.config
    error = search.error(fitted)
    here = fitted.log_evidence(error**2)
    in_place = {effect: list(_in_place_of(search, own, effect, error)) for effect in own}
    others = {other for likened in in_place.values() for other, _ in likened}
    looked_for = search.detectable or tuple(search.joint.coefficients)  # by the search's programs
    traces = traces_at(search.joint, fitted, search.extent, (*looked_for, *others), looked_for, search.traced)
    found: list[Confounder] = []
    likely: list[tuple[int, FittedModel]] = []  # (place in `found`, model with a confounder that runs may separate)
    for effect, likened in in_place.items():
        without = search.fitted.get(search.joint.ordered([name for name in own if name != effect]))
        odds = np.exp([min(one.log_evidence(error**2) - here, 500.0) for _, one in likened])
        for (other, one), share in zip(likened, odds / (1.0 + odds.sum()), strict=True):
            alike = _alike(search, traces, fitted, effect, other)
            ratio = log_likelihood_ratio(search.joint, one, fitted, error)
            same = share <= config.confounder_mentioned and _by_priors(
                search, config.told_by_runs, ratio, one, fitted, without
            )
            if same or share > config.separating_weight:
                likely.append((len(found), one))
            elif not alike > config.overlap_listed:
                continue
            more = len(one.names) - len(fitted.names)
            found.append(Confounder(effect, other, alike, float(share), one.rms, "", float("nan"), ratio, same, more))
    separated = separating_runs(setting, fitted, [one for _, one in likely], runs)
    for (place, _), (what, apart) in zip(likely, separated, strict=True):
        found[place] = dataclasses.replace(found[place], separating_run=what, separation=apart)
    return tuple(sorted(found, key=lambda one: -one.weight))


def log_likelihood_ratio(joint: JointParameters, one: FittedModel, other: FittedModel, error: float) -> float:
    """Of `one` over `other`, each where its fit would end with priors `WIDE` times as wide; `error` of an independent sample, SI.

    At the fits themselves the model whose values are less usual leaves more, for its priors hold it back: that is not what the runs say.
    """
    held_back = _held_back(joint, one, error) - _held_back(joint, other, error)
    return 0.5 * (other.squares - one.squares) / error**2 + held_back


def _held_back(joint: JointParameters, model: FittedModel, error: float) -> float:
    """What the log likelihood of a model gains by one Gauss-Newton step to wider priors, from the optimum, where its slope is that of the priors."""
    from_base = np.asarray([joint.deviation(name, float(model.values[joint.slots[name]])) for name in model.names])
    slope, gram = model.precision * from_base, model.gram / error**2
    wide = model.precision / WIDE**2
    step = np.linalg.lstsq(gram + np.diag(wide), slope - wide * from_base)[0]  # never singular but by rounding
    return max(0.0, float(slope @ step - 0.5 * step @ gram @ step))


def _by_priors(
    search: JointSearch, told: float, ratio: float, one: FittedModel, fitted: FittedModel, without: FittedModel | None
) -> bool:
    """Whether `one` is less likely than `fitted` by priors and not by the runs, which do tell both from the model `without` either.

    What the runs say against it is little, and less than half of what makes it less likely. `ratio`: of `one` over `fitted`; `told`: by which runs tell two.
    """
    error = search.error(fitted)
    if without is not None and not log_likelihood_ratio(search.joint, one, without, error) > told:
        return False
    behind = fitted.log_evidence(error**2) - one.log_evidence(error**2)
    return ratio > -told and -ratio < 0.5 * behind


def _in_place_of(
    search: JointSearch, own: Sequence[str], effect: str, error: float
) -> Iterator[tuple[str, FittedModel]]:
    """(other effect, fitted model) with another effect in the place of `effect`, the likeliest first; at its optimum where that may make them alike.

    The search ends fits that fall behind, or made them where far more was left and priors weighed more.
    """
    rest, found = set(own) - {effect}, search.fitted[tuple(own)]
    models = [
        model
        for effects, model in search.fitted.items()
        if len(effects) == len(own) and rest < set(effects) and effect not in effects
    ]
    models.sort(key=lambda model: -model.log_evidence(error**2))
    for place, model in enumerate(models):
        (other,) = set(model.effects) - rest
        if place < REFINED and log_likelihood_ratio(search.joint, model, found, error) > -NEAR:
            yield other, at_optimum(search, model, error, program_compiled(search, model.effects))
        else:
            yield other, model


def _alike(search: JointSearch, traces: Traces, fitted: FittedModel, effect: str, other: str) -> float:
    """`overlap` of an effect's trace with another's, at the fitted model; of the other's places the one that overlaps most."""
    joint = search.joint
    coefficients = joint.coefficients[effect]
    trace = sum(
        traces.columns[name] * (fitted.values[joint.slots[name]] - joint.priors[name].base) for name in coefficients
    )
    absorbing = [traces.columns[name] for name in fitted.names if name not in coefficients]
    others = [
        [own[name] for name in joint.switches(other)] for one, own in traces.variants.items() if one.effect == other
    ]
    return max((overlap(np.asarray(trace), absorbing, one) for one in others), default=0.0)


def overlap(trace: np.ndarray, absorbing: Sequence[np.ndarray], other: Sequence[np.ndarray]) -> float:
    """Share of a trace (n,), less what the columns `absorbing` absorb, that the columns of another effect could have made."""
    basis = np.linalg.qr(scaled(np.stack(absorbing, axis=1)))[0] if absorbing else np.zeros((len(trace), 0))
    own = trace - basis @ (basis.T @ trace)
    columns = np.stack(other, axis=1)
    left = columns - basis @ (basis.T @ columns)
    # What the others absorb to rounding has no direction of its own.
    kept = np.linalg.norm(left, axis=0) > ABSORBED * np.linalg.norm(columns, axis=0)
    size = float(np.linalg.norm(own))
    if not kept.any() or size <= ABSORBED * float(np.linalg.norm(trace)):
        return 0.0
    directions = np.linalg.qr(scaled(left[:, kept]))[0]
    return float(np.linalg.norm(directions.T @ own)) / size


def separating_runs(
    setting: Search, one: Model | FittedModel, others: Sequence[Model | FittedModel], runs: Sequence[Run]
) -> list[tuple[str, float]]:
    """Of each of `others`: (the candidate run on which it differs most from `one`, rms difference over the noise).

    "" without a candidate. One program simulates all models.
    """
    problem, index = setting.restricted([effect for model in (one, *others) for effect in model.effects])
    candidates, there = candidate_problem(problem, one.values[index], runs)
    if not candidates or not others:
        return [("", float("nan"))] * len(others)
    # Values of single runs, which come last, are in the candidates already.
    points = [model.values[index][: len(there.names)] for model in (one, *others)]
    first, *rest = predicted_at(there, points, fitted=False)
    found = []
    for second in rest:
        difference = there.by_run(there.centred(first - second))
        apart = np.sqrt(np.mean(difference**2, axis=1)) / float(setting.problem.noise_sigma)
        best = int(np.argmax(np.nan_to_num(apart, nan=-1.0)))
        found.append((list(candidates)[best], float(apart[best])))
    return found
