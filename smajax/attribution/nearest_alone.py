"""Models of one or two effects that come near to one of many, fitted to their ends."""

from __future__ import annotations

from collections.abc import Sequence

from smajax.attribution.fitted_sets import JointSearch
from smajax.attribution.joint_search import stage_of
from smajax.attribution.laplace_evidence import FittedModel
from smajax.attribution.program_fits import BegunFit
from smajax.attribution.side_by_side import fit_side_by_side

NEAREST = 3  # of them, those that leave the least
NEAR = 3.0  # times what the many leave, up to which one may come down to it
FALLING = 0.95  # of its error: a fit that falls by more in its steps goes on
MOST_TIMES = 3


def nearest_alone(search: JointSearch, alone: Sequence[FittedModel], found: FittedModel) -> list[FittedModel]:
    """`alone`, models of one effect or two, of which the nearest to `found` are fitted on.

    A fit beside others ends after some steps, where most have converged. Of a play of the sensor that was 15 % of the stroke it took twice as many:
    half-way it left 1.7 noises, and six effects that left 1.2 were likelier.
    """
    near = [one for one in alone if one.rms < NEAR * found.rms]
    going = sorted(near, key=lambda one: one.rms)[:NEAREST]
    for _ in range(MOST_TIMES):
        if not going:
            break
        begun = [BegunFit(one.effects, one.values, one.width_factors) for one in going]
        fit_side_by_side(search, begun, search.error(found), stage_of(search, len(search.rounds)), compared=False)
        going = [now for one in going if (now := search.fitted[one.effects]).rms < FALLING * one.rms]
    return [search.fitted[one.effects] for one in alone]
