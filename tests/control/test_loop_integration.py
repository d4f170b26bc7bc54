"""Sweeps and tunings integrate as finely as their error asks for, and say what is left in the positions."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from smajax.control.presets import CONTROLLERS
from smajax.control.sweep.batched_loops import SMALL, LoopSetup, integrated_setup, positions
from smajax.control.sweep.grid import loop_rows
from smajax.control.sweep.run_sweep import TRUE_STATE, SweepSettings, begun_sweep, sweep_controllers
from smajax.core.progress import quiet
from smajax.model.rigs import arm
from smajax.report.sweep_folder import write_sweep
from smajax.simulation.integration_error import whole_transformation, with_tolerance

SECONDS = 3.0


def test_loops_of_a_coarse_clock_take_finer_steps_until_the_error_is_small() -> None:
    plant = CONTROLLERS["sld"].plant(arm())
    controller = CONTROLLERS["sld"].make(plant)
    rows = loop_rows({"payload": np.asarray([0.8, 1.0, 1.2])}, np.radians(40.0))
    setup = LoopSetup(plant, controller, CONTROLLERS["sld"].main_gain, SECONDS, dt=0.05)
    chosen, error = integrated_setup(setup, rows, "auto")
    exact = positions(
        LoopSetup(plant, controller, setup.main_gain, SECONDS, 0.05, integration=with_tolerance(1e-7)), rows
    )

    def worst(one: LoopSetup) -> float:
        return float(np.sqrt(((positions(one, rows) - exact) ** 2).mean(axis=1)).max())

    assert chosen.integration.tolerance is not None
    assert error.rms["position"] == pytest.approx(worst(chosen), rel=1e-6)
    assert error.small
    assert error.share == pytest.approx(worst(chosen) / whole_transformation(plant)["position"], rel=1e-6)
    assert worst(setup) > SMALL * whole_transformation(plant)["position"]


@pytest.mark.slow
def test_a_sweep_says_what_its_integration_leaves(tmp_path: Path) -> None:
    settings = SweepSettings(("pid",), "payload", "", 3, (30.0,), (1.0,), seconds=SECONDS, **TRUE_STATE)
    write_sweep(begun_sweep(arm(), settings), sweep_controllers(arm(), settings, tmp_path, quiet), tmp_path)
    error = json.loads((tmp_path / "sweep.json").read_text(encoding="utf-8"))["integration_error"]["pid"]
    assert 0.0 < error["outputs"]["position"]["rms"] < SMALL * whole_transformation(arm())["position"]
    assert "% of a whole transformation" in (tmp_path / "index.html").read_text(encoding="utf-8")
    # From the cache too.
    (again,) = sweep_controllers(arm(), settings, tmp_path, quiet)
    assert again.integration_error == error
