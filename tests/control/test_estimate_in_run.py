"""What a filter estimates is beside the true states of a loop's run."""

from __future__ import annotations

import numpy as np

import smajax as sma
from smajax.control.loop_dataset import ESTIMATE, ESTIMATED, SAMPLED
from smajax.model.presets import build
from smajax.report.simulate_page import as_csv
from smajax.report.simulate_words import summary_rows

PLANT = build("flexinol_table_3_2", "dead_weight", "voltage")
STATES = [f"{ESTIMATE}{name}" for name in ESTIMATED]


def test_a_loop_with_a_filter_has_its_estimates() -> None:
    loop = sma.loop_around(PLANT, "pid", estimator="model", noise="50 um")
    run = sma.simulate_loop_dataset(loop, "3 mm: 2 s", dt=0.01, period=0.02)
    for name in ESTIMATED:
        true, estimate = run[name], run[f"{ESTIMATE}{name}"]
        assert estimate.attrs["units"] == true.attrs["units"]
        assert SAMPLED in estimate.attrs
        # Held for a control period of two samples, near the truth and not the truth.
        values = estimate.to_numpy()
        np.testing.assert_array_equal(values[:-1:2], values[1::2])
        assert not np.array_equal(values, true.to_numpy())
    off = (run["estimated_temperature"] - run["temperature"]).to_numpy()
    assert 0.0 < np.sqrt(np.mean(off**2)) < 1.0
    assert set(STATES) <= {part.split(" ")[0] for part in as_csv(run).splitlines()[0].split(",")}
    assert not [row for row in summary_rows(run) if row[0].startswith("estimated")]


def test_a_loop_that_is_told_the_true_state_has_none() -> None:
    run = sma.simulate_loop_dataset(sma.loop_around(PLANT, "pid"), "3 mm: 0.2 s", dt=0.01, period=0.02)
    assert not set(STATES) & set(run.data_vars)
