"""The base model, or one of few effects, with one effect more: what many effects may stand in for."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from smajax.attribution.exclusive_effects import exclude_each_other, of_groups
from smajax.attribution.fitted_sets import JointSearch
from smajax.attribution.joint_search import NEIGHBOURS, asked_about, is_fresh, stage_of
from smajax.attribution.laplace_evidence import FittedModel
from smajax.attribution.side_by_side import fit_side_by_side
from smajax.attribution.subset_evidence import LinearModel, Subset
from smajax.attribution.traces import Variant


def fitted_alone(search: JointSearch, effects: Sequence[str], error: float) -> list[FittedModel]:
    """The base model with one of `effects` each, of those that the runs can show; `error` of an independent sample, SI."""
    fresh = [effect for effect in effects if (effect,) not in search.fitted]
    _fit_alone(search, fresh, error)
    return _alone(search, effects)


def likeliest_alone(search: JointSearch, effects: Sequence[str], found: FittedModel) -> list[FittedModel]:
    """The base model with one of `effects` each that has come near to `found`, of the `NEIGHBOURS` that the linear model about the base model finds likeliest."""
    error = search.error(found)
    fresh = [effect for effect in effects if is_fresh(search, (effect,), error)]
    # One effect is owed what the coefficients of many cost, and no more than a model without any.
    owed = found.cost_of_coefficients(error**2) - search.fitted[()].cost_of_coefficients(error**2)
    _fit_alone(search, fresh, error, NEIGHBOURS, found.squares / error**2 + 2.0 * max(owed, 0.0))
    return _alone(search, effects)


def described_alone(search: JointSearch, found: FittedModel) -> list[FittedModel]:
    """The base model, and the likeliest fit of another effect of `found` alone, with one effect more each that describes what an effect of `found` describes (`exclude_each_other`), fitted to its end.

    However far it is behind on the way: a second range of the transformation is far from linear, and a curve of it with five stand-ins came first. What else is
    missing has to be there: without the contrast of the resistances that was, the second range left as much as nothing.
    """
    error = search.error(found)
    described = set(of_groups(found.effects))
    alike = [
        name
        for name in search.joint.coefficients
        if name not in search.excluded and any(exclude_each_other((name, one)) for one in described)
    ]
    rest = set(found.effects) - described
    single = [one for one in search.fitted.values() if len(one.effects) == 1 and rest.issuperset(one.effects)]
    likeliest = max(single, key=lambda one: one.log_evidence(error**2), default=None)
    models = []
    for beside in [(), *([] if likeliest is None else [likeliest.effects])]:
        sets = {name: search.joint.ordered((*beside, name)) for name in alike}
        fresh = [name for name, effects in sets.items() if is_fresh(search, effects, error)]
        _fit_alone(search, fresh, error, compared=False, beside=beside)
        models += [search.fitted[effects] for effects in sets.values() if effects in search.fitted]
    return models


def _alone(search: JointSearch, effects: Sequence[str]) -> list[FittedModel]:
    """The models of one of `effects` each that were fitted."""
    return [search.fitted[effect,] for effect in effects if (effect,) in search.fitted]


def _fit_alone(
    search: JointSearch,
    effects: Sequence[str],
    error: float,
    most: int | None = None,
    least_cost: float = np.inf,
    compared: bool = True,
    beside: tuple[str, ...] = (),
) -> None:
    """Fit the model with the effects `beside`, by default the base model, with one of `effects` more each, of those that the runs can show: the `most` likeliest in the linear model, None for all."""
    shown = [effect for effect in effects if effect in search.detectable]
    if not shown:
        return

    def alone(search: JointSearch, linear: LinearModel, present: FittedModel, error: float) -> list[Subset]:
        here: Subset = frozenset(Variant(effect, -1) for effect in beside)
        places: dict[str, Variant] = {}
        for one in sorted(linear.places, key=lambda one: -linear.log_evidence(here | {one})):
            places.setdefault(one.effect, one)
        return [here | {one} for effect, one in places.items() if effect in shown][:most]

    begun = asked_about(search, search.fitted[beside], error, alone, shown, most).begun
    fit_side_by_side(search, begun, error, stage_of(search, len(search.rounds)), compared, least_cost)
