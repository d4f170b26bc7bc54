"""A run, or two, without which a model leaves much less of the others."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from smajax.attribution.doubtful_runs import Left, left_without
from smajax.attribution.model_fits import Model, Search, Start
from smajax.core.result_cache import ResultCache
from tests.helpers.hot_weight import UNKNOWNS, VOLTS, hot_weight


@pytest.mark.parametrize(
    ("after", "stands_out"),
    [
        ([0.2, 0.9, 0.95], True),  # of 1.0
        ([0.45, 0.85, 0.95], False),
        ([0.4, 0.9, 0.95], True),  # half of what is left without any other run
        ([0.14, 0.15, 0.15], True),  # next to noise
        ([0.2], False),  # nothing is left of the others
    ],
)
def test_a_run_stands_out_where_little_is_left_without_it(after: list[float], stands_out: bool) -> None:
    groups = tuple((run,) for run in range(len(after)))
    assert Left(groups, np.ones(len(after)), np.asarray(after), 0.1).stands_out is stands_out


def test_what_is_gone_with_or_without_a_run_says_nothing_of_it() -> None:
    """As where values of presets, which are free without a run, were what was missing."""
    alike = np.asarray([0.1, 0.12, 0.13])
    assert not Left(((0,), (1,), (2,)), 1.5 * alike, alike, 0.1).stands_out


def test_two_runs_whose_levels_are_wrong_stand_out_together_and_neither_alone() -> None:
    joint = hot_weight({}, ("latent_heat",), steps=(*VOLTS, (7.5, 3.0), (8.5, 2.0))).joint
    batch = joint.problem.batch
    volts = batch.inputs["voltage"]
    for run in (1, 4):
        volts = volts.at[run].set(volts[run] / 0.9)
    problem = dataclasses.replace(joint.problem, batch=dataclasses.replace(batch, inputs={"voltage": volts}))
    setting = Search(problem, UNKNOWNS, joint.bounds, ("latent_heat",), ResultCache())
    (fit,), _ = setting.fit([Start((), problem.start_values())], "a fit", settled=1e-3)
    base = Model((), fit.values, fit.cost, np.zeros(volts.shape), 0.0)
    singly, in_twos = left_without(setting, base)
    assert not singly.stands_out
    assert in_twos.stands_out
    assert in_twos.groups[0] == (1, 4)
    assert in_twos.before.shape == in_twos.after.shape == (15,)
