"""Which fit runs a model may be wrong about because a record of them is: those without which it leaves little of the others.

A fit to all runs shares the error of one record out: the run that it leaves most of is often another one. So each run, or each two, are
left out by one Gauss-Newton step.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from smajax.attribution.laplace_evidence import FittedModel, fitted_model
from smajax.attribution.leave_one_run_out import left_of_the_others
from smajax.attribution.model_fits import Model, Search

LITTLE = 0.3  # of the error on the other runs: of these a wrong record of one run explains most
NEAR_NOISE = 1.5  # noises
BESIDE_OTHERS = 0.5  # of what is left without the next run, which may be much where other effects are missing as well
LEAST_RUNS_OF_TWO = 5  # of which two are left out: fewer than three left say nothing


class Left(NamedTuple):
    """What a model leaves of the other runs without one run, or two, the least first; root mean squares, SI."""

    groups: tuple[tuple[int, ...], ...]  # the runs that are left out
    before: np.ndarray  # by the model fitted to all
    after: np.ndarray  # and to the others
    noise: float
    of_all: float = math.inf  # what is left of all runs by the model fitted to all

    @property
    def stands_out(self) -> bool:
        """Whether without one of the groups next to noise is left of the others, or little of what is, or half of what is left without any other."""
        if len(self.groups) < 2:
            return False
        little = self.after < np.maximum(LITTLE * self.before, NEAR_NOISE * self.noise)
        # What values of presets take away, with or without any run, says nothing of that run.
        kept = self.after < BESIDE_OTHERS * self.before
        return bool((little & kept).any() or self.after[0] < BESIDE_OTHERS * self.after[1])


def left_without(setting: Search, model: Model | FittedModel, program: Sequence[str] | None = None) -> tuple[Left, ...]:
    """`model` without each run, and of `LEAST_RUNS_OF_TWO` or more without each two, values of presets free as they are beside a record that is corrected.

    `program`: effects of the program that computes it; None: the model's own.
    """
    joint = setting.joint(setting.candidates)
    program = model.effects if program is None else program
    here = fitted_model(joint, model.effects, model.values, program)
    noise, most = float(setting.problem.noise_sigma), 2 if setting.problem.batch.runs >= LEAST_RUNS_OF_TWO else 1
    of_all, found = left_of_the_others(joint, here, max(noise, here.rms), program, most)
    in_order = []
    for groups, before, after in found:
        order = np.argsort(after, kind="stable")
        in_order.append(Left(tuple(groups[k] for k in order), before[order], after[order], noise, of_all))
    return tuple(in_order)
