"""The requirement on the filter is judged on loops that nothing was tuned on, and its table is of the stored numbers."""

from __future__ import annotations

import json

import numpy as np

from smajax.control.presets import CONTROLLERS
from smajax.control.tune.terms import TERMS
from studies.requirement.run import GAINS, HERE, MARK, gains_of, judged_on, table
from studies.requirement.search import LIMITS, MARGIN, SET_POINTS, costs


def test_loops_that_judge_are_none_of_those_that_gains_were_searched_on() -> None:
    rows = judged_on()
    nearest = np.abs(np.degrees(rows[:, 6])[:, None] - np.asarray(SET_POINTS)).min(axis=1)
    corner = (np.abs(np.abs(rows[:, :3] - 1.0) - 0.2) < 1e-9).all(axis=1)
    assert nearest[corner].min() > 0.1
    assert (np.abs(rows[:, :3] - 1.0) <= 0.2 + 1e-9).all()


def test_the_cost_counts_loops_beyond_the_limits_and_then_how_far() -> None:
    met = np.zeros((1, 4, len(TERMS)))
    assert costs(met)[0] == 0.0
    at = list(TERMS).index("overshoot")
    one, two, far = met.copy(), met.copy(), met.copy()
    one[0, 0, at] = 2.0 * MARGIN * LIMITS["overshoot"]
    two[0, :2, at] = 2.0 * MARGIN * LIMITS["overshoot"]
    far[0, 0, at] = 3.0 * MARGIN * LIMITS["overshoot"]
    assert 0.0 < costs(one)[0] < costs(two)[0]
    assert costs(one)[0] < costs(far)[0]


def test_the_stored_results_are_of_every_controller_and_in_the_table() -> None:
    results = json.loads((HERE / "results.json").read_text(encoding="utf-8"))
    assert set(results) == set(CONTROLLERS)
    assert {name for name, one in results.items() if one["gains"] == "searched on the filter"} == {
        path.stem for path in GAINS.glob("*.json")
    }
    assert all(one["filter"]["loops"] == len(judged_on()) for one in results.values())
    assert (HERE / "README.md").read_text(encoding="utf-8").split(MARK)[1].strip() == table(results)
    assert gains_of("pid")[1] == "searched on the filter"
