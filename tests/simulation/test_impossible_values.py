"""Runs of a batch with parameters that no wire or load has: a status of their own, out of what statistics are taken of."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from smajax.model.presets import build
from smajax.simulation.batch.axes import Axes, grid, zipped
from smajax.simulation.batch.run_batch import good, run_batch, status_summary
from smajax.simulation.observers import IMPOSSIBLE, NOT_FINITE

ARM = build("niti_table_3_1", "arm", "amplified_voltage")
DT, SECONDS = 0.02, 2.0


@pytest.mark.parametrize(
    ("axes", "told", "status"),
    [
        (
            grid(payload_mass=[-0.05, 0.05]),
            "1 of 2 values of `payload_mass` are out of its bounds, 0 to 100 kg",
            [4, 0],
        ),
        (grid(convection_coefficient=[0.0, 150.0]), "such as 0: such runs are simulated all the same", [4, 0]),
        (grid(convection_coefficient=[-10.0, 150.0]), "`status` 4 marks them", [4, 0]),
        # What went wrong in the run followed from its values.
        (grid(convection_coefficient=[70.0, -3000.0]), "out of its bounds, 1 to 5000", [0, 4]),
        (grid(wire_length=[1.0, 0.0]), "such as 0: ", [0, 4]),
        (
            grid(austenite_start=[60.0, 90.0]),
            "1 of 2 pairs of `austenite_start` and `austenite_finish` are in the wrong order, such as 90 and 78 degC",
            [0, 4],
        ),
        (grid(martensite_finish=[42.0, 60.0]), "`martensite_start` are in the wrong order, such as 60 and 52", [0, 4]),
        (
            zipped(austenite_start=[80.0, 80.0], austenite_finish=[90.0, 75.0]),
            "1 of 2 pairs of .* such as 80 and 75 degC",
            [0, 4],
        ),
    ],
)
def test_impossible_parameters_have_a_status_of_their_own(axes: Axes, told: str, status: list[int]) -> None:
    with pytest.warns(UserWarning, match=told):
        found = run_batch(ARM, {}, axes * grid(voltage=[7.0]), seconds=SECONDS, dt=DT, tolerance=None)
    assert found["status"].values.ravel().tolist() == status
    assert found["first_bad_time"].values.ravel()[status.index(IMPOSSIBLE)] == 0.0
    kept = good(found)["position"].isel(voltage=0)
    assert np.isnan(kept[status.index(IMPOSSIBLE)]).all()
    assert np.isfinite(kept[status.index(0)]).all()
    assert "1 of 2 runs (50.00%) went wrong, 1 with impossible parameters" in status_summary(found)


def test_two_temperatures_that_vary_apart_are_compared_run_by_run_and_on_disk(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("smajax.simulation.batch.run_batch.chunk_size", lambda *_: 4)
    axes = (
        grid(austenite_start=[60.0, 80.0]) * grid(load_torque=[0.0, 1e308]) * grid(austenite_finish=[70.0, 78.0, 85.0])
    )
    whole: dict[str, Any] = {"seconds": 0.2, "dt": DT, "tolerance": None, "keep": ()}
    with pytest.warns(UserWarning, match="2 of 6 pairs of `austenite_start` and `austenite_finish`"):
        here = run_batch(ARM, {"voltage": 7.0}, axes, **whole)
    for torque, low in ((0, 0), (1, NOT_FINITE)):
        assert here["status"].isel(load_torque=torque).values.tolist() == [[low] * 3, [IMPOSSIBLE, IMPOSSIBLE, low]]
    summary = status_summary(here)
    assert "8 of 12 runs (66.67%) went wrong, 4 with impossible parameters" in summary
    assert "of the others the first after 0.02 s" in summary
    with pytest.warns(UserWarning, match="2 of 6 pairs"):
        stored = run_batch(ARM, {"voltage": 7.0}, axes, out=tmp_path / "batch", **whole)
    np.testing.assert_array_equal(stored["status"], here["status"])


def test_impossible_runs_do_not_decide_how_finely_a_batch_is_integrated() -> None:
    settings: dict[str, Any] = {"seconds": SECONDS, "dt": DT}
    alone = run_batch(ARM, {}, grid(voltage=[7.0]), **settings)
    with pytest.warns(UserWarning, match="out of its bounds"):
        beside = run_batch(ARM, {}, grid(voltage=[7.0]) * grid(convection_coefficient=[70.0, 0.0]), **settings)
    with pytest.warns(UserWarning, match="out of its bounds"):
        none_left = run_batch(ARM, {}, grid(voltage=[7.0], payload_mass=[-0.05]), **settings)
    assert beside.attrs["integration"] == alone.attrs["integration"]
    assert none_left["status"].values.tolist() == [[IMPOSSIBLE]]
