"""The stored times of a receding horizon are in the table, and within the control period."""

from __future__ import annotations

import json

from studies.receding_horizon.run import CONTROLLERS, HERE, MARK, table


def test_the_stored_times_are_in_the_table_and_within_the_period() -> None:
    results = json.loads((HERE / "results.json").read_text(encoding="utf-8"))
    assert (HERE / "README.md").read_text(encoding="utf-8").split(MARK)[1].strip() == table(results)
    assert tuple(results["controllers"]) == CONTROLLERS
    for one in results["controllers"].values():
        assert one["median_s"] <= one["percentile_99_s"] <= one["worst_s"] <= one["worst_of_all_repeats_s"]
        assert one["worst_s"] < 0.01 * results["period_s"]
        assert one["largest_difference_V"] < 1e-9
