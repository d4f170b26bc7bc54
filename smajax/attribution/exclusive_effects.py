"""Effects that describe the same in ways that exclude each other (`Candidate.exclusive_group`): no model of the search has two of one group."""

from __future__ import annotations

from collections.abc import Collection, Iterable

from smajax.attribution.laplace_evidence import FittedModel
from smajax.model.effects.library import LIBRARY


def of_groups(effects: Iterable[str]) -> tuple[str, ...]:
    """Those of `effects` that are of a group."""
    return tuple(effect for effect in effects if LIBRARY[effect].candidate.exclusive_group)


def exclude_each_other(effects: Collection[str]) -> bool:
    """Whether two of them are of one group."""
    groups = [LIBRARY[effect].candidate.exclusive_group for effect in of_groups(effects)]
    return len(set(groups)) < len(groups)


def replaceable(one: str, other: str) -> bool:
    """Whether either may stand in the place of the other, whatever a linear model says: both describe the same, or look much the same in a log."""
    first, second = LIBRARY[one].candidate, LIBRARY[other].candidate
    alike = bool(first.similar_group) and first.similar_group == second.similar_group
    return one != other and (alike or exclude_each_other((one, other)))


def in_another_way(
    fitted: Iterable[FittedModel], present: FittedModel, known: Collection[tuple[str, ...]], error: float, odds: float
) -> FittedModel | None:
    """The likeliest fitted model with effects of groups that are none of `known`, if it is within log `odds` of `present`, which has such effects too.

    It may need other effects beside it. `error`: of an independent sample, SI.
    """
    here, least = of_groups(present.effects), present.log_evidence(error**2) - odds
    others = [one for one in fitted if here and of_groups(one.effects) and of_groups(one.effects) not in known]
    best = max(others, key=lambda one: one.log_evidence(error**2), default=None)
    return best if best is not None and best.log_evidence(error**2) > least else None
