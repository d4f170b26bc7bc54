"""Effects that say what parameters of the base model say where a fit has these free (`Candidate.same_as`)."""

from __future__ import annotations

import math
from collections.abc import Collection

from smajax.attribution.joint_parameters import JointParameters
from smajax.model.effects.library import LIBRARY

# Of the effect's widths: a parameter that is known better is given, and what the effect then says is that it was given wrongly.
AS_FREE = 0.5


def said_by_parameters(joint: JointParameters) -> frozenset[str]:
    """Those effects of `joint` that its unknowns, and the values of presets that are free, say already."""
    return frozenset(effect for effect in joint.coefficients if _said(joint, LIBRARY[effect].candidate.same_as, effect))


def _said(joint: JointParameters, parameters: Collection[str], effect: str) -> bool:
    if not parameters or not set(parameters) <= set(joint.unknowns):
        return False
    # Coefficients of such an effect are shares of these parameters, as the widths of logarithms are.
    least = AS_FREE * min(joint.priors[name].sigma for name in joint.switches(effect))
    return all(_relative_width(joint, name) >= least for name in parameters)


def _relative_width(joint: JointParameters, name: str) -> float:
    prior = joint.priors.get(name)
    if prior is None:  # anywhere within its bounds
        low, high = joint.bounds[name]
        return (high - low) / math.sqrt(12.0) / abs(0.5 * (low + high))
    return prior.sigma if prior.logarithmic else prior.sigma / abs(prior.base)
