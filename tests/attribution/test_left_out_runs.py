"""Runs that are left out: each is predicted by the model fitted to the others."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from smajax.attribution import leave_one_run_out
from smajax.attribution.laplace_evidence import fitted_model
from smajax.attribution.leave_one_run_out import left_out
from smajax.fit.outputs_of_runs import misfits
from smajax.fit.problem import Problem
from tests.helpers.hot_weight import NOISE, hot_weight


def test_a_run_that_has_no_numbers_where_one_step_leads_is_left_out_by_a_fit(monkeypatch: pytest.MonkeyPatch) -> None:
    search = hot_weight({})
    joint, start = search.joint, np.asarray(search.joint.problem.start_values())
    base = fitted_model(joint, (), start, ())
    calls: list[int] = []

    def without_numbers_by_one_step(problem: Problem, points: Any) -> np.ndarray:
        found = misfits(problem, points)
        calls.append(len(points))
        if len(calls) == 2:  # after all runs at the optimum, and before the fits
            found[0, problem.owner == 0] = np.nan
        return found

    monkeypatch.setattr(leave_one_run_out, "misfits", without_numbers_by_one_step)
    assert np.isfinite(left_out(joint, base, NOISE).misfit).all()
    assert len(calls) == 3
