"""The checks that the final model has passed, for the other models that its prediction is averaged with.

One whose load sticks and jumps has to keep its gain at half the step (`step_size_check`), and the held-out runs have to validate it as they
do the final model (`held_out`): by what is fitted already, the likeliest set with one effect fewer. Models of little weight change the
average by less than either check can tell and are not looked at.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from smajax.attribution.findings import DroppedModel
from smajax.attribution.fitted_sets import JointSearch
from smajax.attribution.laplace_evidence import FittedModel
from smajax.attribution.model_fits import Model, Search
from smajax.attribution.paired_errors import compared, pooled_rms
from smajax.attribution.reasons import HeldOutWorse, StepDependent
from smajax.attribution.step_size_check import gain_kept_at_half_step
from smajax.attribution.values_per_run import held_out_owners, held_out_residuals
from smajax.model.effects.library import LIBRARY

CHECKED = 0.05  # weight above which a model is looked at

Weighed = list[tuple[FittedModel, float]]


def checked(
    setting: Search, search: JointSearch, base: Model, final: Model, models: Weighed
) -> tuple[Weighed, tuple[DroppedModel, ...]]:
    """(the models that pass, with weights of sum one; those that do not). `final` has passed; the base model adds nothing that could fail."""
    own = search.joint.ordered(final.effects)
    doubted = {one.effects: one for one, weight in models if weight > CHECKED and one.effects not in ((), own)}
    reasons: dict[tuple[str, ...], StepDependent | HeldOutWorse] = {}
    for effects, one in doubted.items():
        kept = gain_kept_at_half_step(setting, _as_model(search, one), base)
        if kept < setting.config.gain_kept_at_half_step:
            jumping = [effect for effect in effects if LIBRARY[effect].candidate.stick_slip]
            reasons[effects] = StepDependent(" + ".join(jumping), kept)
    if setting.held_out is not None:
        left = [one for effects, one in doubted.items() if effects not in reasons]
        # By the program of the average.
        every = [effect for one, _ in models for effect in one.effects]
        reasons |= _on_held_out(setting, search, base, left, every)
    rest = [(one, weight) for one, weight in models if one.effects not in reasons]
    total = sum(weight for _, weight in rest)
    dropped = (
        DroppedModel(one.effects, weight, reasons[one.effects]) for one, weight in models if one.effects in reasons
    )
    return [(one, weight / total) for one, weight in rest], tuple(dropped)


def _on_held_out(
    setting: Search, search: JointSearch, base: Model, models: Sequence[FittedModel], every: Sequence[str]
) -> dict[tuple[str, ...], HeldOutWorse]:
    """Those of `models` that predict the held-out runs worse than the base model, or than without one of their effects, beyond chance."""
    if not models:
        return {}
    simpler = [_without_one(search, one) for one in models]
    values = [base.values, *(one.values for one in models), *(one.values for one in simpler if one is not None)]
    owners = held_out_owners(setting)
    basic, *others = held_out_residuals(setting, every, values)
    own, nested = others[: len(models)], iter(others[len(models) :])
    found = {}
    for one, rest, mine in zip(models, simpler, own, strict=True):
        without = basic if rest is None else next(nested)
        for other in (basic, without):
            if compared(mine, other, setting.config, owners) == "worse":
                found[one.effects] = HeldOutWorse(pooled_rms(other), pooled_rms(mine))
                break
    return found


def _without_one(search: JointSearch, model: FittedModel) -> FittedModel | None:
    """The likeliest fitted set with one effect fewer; None where it is the base model, or none was fitted."""
    error = search.error(model)
    nested = [
        one
        for effects, one in search.fitted.items()
        if effects and len(effects) == len(model.effects) - 1 and set(effects) < set(model.effects)
    ]
    return max(nested, key=lambda one: one.log_evidence(error**2), default=None)


def _as_model(search: JointSearch, fitted: FittedModel) -> Model:
    """A fitted model as the step-size check takes it: no run was left out."""
    cost, none = fitted.squares / search.noise**2, np.zeros((0, 0))
    return Model(fitted.effects, fitted.values, cost, none, float("nan"), width_factors=fitted.width_factors)
