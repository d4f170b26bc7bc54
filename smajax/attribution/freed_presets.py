"""When the values of presets that the experiment file does not give are free in the search.

From the base model alone fits that free them too may end in local minima, and with wrong values held effects that are not there are named in their place.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from smajax.attribution.doubtful_runs import Left
from smajax.attribution.fitted_sets import JointSearch
from smajax.attribution.joint_parameters import JointParameters
from smajax.attribution.laplace_evidence import FittedModel
from smajax.attribution.side_by_side import fitted_from
from smajax.fit.outputs_of_runs import sums_of_squares

FREED_SHARE = 2.0 / 3.0  # of the base error, to which free values of presets lower it where the search begins so
HALVED = 0.5  # of what effects leave, to which free values of presets lower it where the search with these held ends
AS_LITTLE = 1.5  # times as much: one Gauss-Newton step does not tell models apart


def freed_at_the_base(freed: FittedModel, held: FittedModel) -> bool:
    """Whether the search begins with the values of presets free: the base model fitted with these free and held."""
    return freed.rms < FREED_SHARE * held.rms


def needs_presets(search: JointSearch, free: JointSearch, found: FittedModel) -> bool:
    """Whether `search`, in which the values of presets are held, ends because these can make up for most of what the effects of `found` leave.

    What is added beside wrong values stands in for them; beside free ones the evidence tells which of the two it is. Once for each set of effects, by a fit in `free`, which has that of the base model.
    """
    if found.effects in free.fitted or HALVED * found.rms < search.noise:
        return False
    free.programs = search.programs
    if fitted_from(free, found).rms > HALVED * found.rms:
        return False
    search.free_beside = found.effects
    return True


def nearer_base(joint: JointParameters, fitted: np.ndarray, known: np.ndarray) -> np.ndarray:
    """Where the base model begins with the values of presets free, (P,): where it was `fitted` with these held, or where a search has `known` it, whichever leaves less.

    From held ones it may end in a local minimum that an effect beside it does not have.
    """
    problem, index = joint.restricted(())
    first, second = sums_of_squares(problem, [fitted[index], known[index]])
    return known if second < first else fitted


def freed_by_a_step(
    models: Sequence[FittedModel], left: Sequence[Sequence[Left]], found: FittedModel
) -> tuple[str, ...] | None:
    """Effects of the smallest of `models` of which values of presets take as much as of any, where that is most of what `found` leaves; None elsewhere."""
    of_all = [its_left[0].of_all for its_left in left]
    if min(of_all) > HALVED * found.rms:
        return None
    alike = [model for model, rms in zip(models, of_all, strict=True) if rms <= AS_LITTLE * min(of_all)]
    return min(alike, key=lambda one: len(one.effects)).effects
