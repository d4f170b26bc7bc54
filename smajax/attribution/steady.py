"""Does what an effect gains hang on the step of the integration?

A load that sticks and jumps may jump a step earlier or later by rounding alone. A fit can choose the coefficients whose
row of jumps happens to fall where the log's does, and gains what no wire does: at half the step the gain is gone.
"""

from __future__ import annotations

import numpy as np

from smajax.attribution.judging import Model, Search
from smajax.effects.library import LIBRARY
from smajax.fit.batch import halved
from smajax.fit.problem import Problem
from smajax.fit.shown import shown_at


def kept_at_half_the_step(setting: Search, new: Model, old: Model) -> float:
    """Share of what `new` gains on `old` in the squared error of all fit runs that it keeps, unfitted, at half the step.

    1 where nothing that was added can jump.
    """
    if not any(LIBRARY[effect].jumps for effect in new.effects if effect not in old.effects):
        return 1.0
    problem, index = setting.restricted(new.effects)
    fine = Problem.build(problem.system, halved(problem.batch), problem.noise_sigma, problem.offset)
    misfit = problem.centred(problem.measured - shown_at(fine, [new.values[index]])[0][:, ::2])
    cost = float(np.sum((np.asarray(misfit) / np.asarray(problem.noise)) ** 2))
    return (old.cost - cost) / (old.cost - new.cost) if old.cost > new.cost else 1.0
