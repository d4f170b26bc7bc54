"""The sweep: its runs are single closed loops, its folder is whole, and what is finished is not computed again."""

from __future__ import annotations

import csv
import dataclasses
import io
import json
from pathlib import Path
from typing import Any

import jax
import numpy as np
import pytest
import xarray as xr
from PIL import Image

from smajax.control.closed_loop import simulate_closed_loop
from smajax.control.compose import compose
from smajax.control.figures_of_merit import MERIT_UNITS, Merit, merit
from smajax.control.gains_file import Gains
from smajax.control.least_time import least_reach_times
from smajax.control.load_equation import moving_load
from smajax.control.measured_state import Sensor
from smajax.control.presets import CONTROLLERS
from smajax.control.reference import clock, constant
from smajax.control.signal_path import Interface, interface_of
from smajax.control.sweep.batched_loops import LoopSetup, closed_loops
from smajax.control.sweep.grid import Grid, loop_rows, sweep_ratios
from smajax.control.sweep.run_sweep import (
    TRUE_STATE,
    SweepSettings,
    begun_sweep,
    may_resume,
    sweep_controllers,
    sweep_settings_for,
)
from smajax.core.parameters import get_parameters, set_parameters
from smajax.model.rigs import arm
from smajax.model.system import System
from smajax.report.sweep_folder import numbered_png, write_sweep
from smajax.report.sweep_numbers import IN_PICTURE, comparison_digest, digest_of
from tests.helpers.in_browser import HOSTILE, faults
from tests.helpers.machine_code import by_machine_code

pytestmark = pytest.mark.usefixtures("blank_pictures")

RATIOS = ("payload_ratio", "supply_ratio")
# One step a sample, so that a loop is that of `simulate_closed_loop`.
SETTINGS = SweepSettings(
    ("vsc3",), "payload", "supply", 2, (0.0, 30.0), (1.0,), seconds=3.0, tolerance=None, **TRUE_STATE
)


def run_sweep(system: System, settings: SweepSettings, out: Path, command: str = "") -> None:
    write_sweep(begun_sweep(system, settings), sweep_controllers(system, settings, out), out, command=command)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("sweep")
    run_sweep(arm(), SETTINGS, out, f"smajax sweep --out {HOSTILE}")
    return out


def test_a_run_of_a_sweep_equals_the_single_loop(folder: Path) -> None:
    with (folder / "vsc3.csv").open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert "switches_per_second" in rows[0], "a number per second says so by its name"
    assert len(rows) == 2 * 2 * 2
    row = rows[-1]
    assert (row["payload_ratio"], row["supply_ratio"], row["set_point_deg"]) == ("2", "2", "30")
    system = arm()
    names = ["payload_mass", "amplifier_gain"]
    doubled = dict(zip(names, 2.0 * np.asarray(get_parameters(system, names)), strict=True))
    plant = set_parameters(system, doubled)
    controller = CONTROLLERS["vsc3"].make(system)
    loop = by_machine_code(simulate_closed_loop)(plant, controller, constant(clock(3.0, 0.01), np.radians(30.0)), 0.01)
    one = merit(loop, plant)
    assert float(row["energy_J"]) == pytest.approx(float(one.energy), rel=1e-5)
    assert float(row["overshoot_deg"]) == pytest.approx(float(np.degrees(one.overshoot)), rel=1e-5, abs=1e-6)
    assert float(row["peak_temperature_degC"]) == pytest.approx(float(one.peak_temperature), rel=1e-5)


def test_the_folder_has_page_pictures_tables_and_record(folder: Path) -> None:
    page = (folder / "index.html").read_text(encoding="utf-8")
    assert page.count('src="data:image/png;base64,') == 3
    assert page.count('srcset="data:image/png;base64,') == 2  # of what does not move, for a telephone
    assert page.count('<figure class="series"') == 1
    assert 'href="vsc3.csv"' in page
    assert "Ambient: 0.5 to 2 times the assumed 20 °C is an error of -10 to +20 K." in page
    for name in ("comparison.png", "vsc3_maps.png", "vsc3_lines.png", "vsc3.csv"):
        assert (folder / name).stat().st_size > 300
    record = json.loads((folder / "sweep.json").read_text(encoding="utf-8"))
    assert record["sweep"]["loops"] == 8
    assert record["sweep"]["failed"] == {"vsc3": 0}
    assert not list(folder.rglob("*.part*"))


def test_the_data_set_holds_every_row(folder: Path) -> None:
    with xr.open_dataset(folder / "sweep.nc", engine="scipy") as found, open(folder / "vsc3.csv") as file:
        rows = list(csv.DictReader(file))
        assert found["overshoot"].size == len(rows) == 8
        for row in rows:
            (gain,) = (float(row[name]) for name in row if name.endswith("_ratio") and name not in RATIOS)
            at = {name: float(row[name]) for name in RATIOS} | {"gain_ratio": gain}
            at["set_point"] = np.radians(float(row["set_point_deg"]))
            one = found.sel(controller="vsc3").sel(at, method="nearest")
            assert float(one["energy"]) == pytest.approx(float(row["energy_J"]), rel=1e-5)
            assert np.degrees(float(one["overshoot"])) == pytest.approx(float(row["overshoot_deg"]), rel=1e-5, abs=1e-6)
        assert {name: one.attrs["units"] for name, one in found.data_vars.items()} == {
            **MERIT_UNITS,
            "failed_at": "s",
            "least_time": "s",
            "least_time_own_limit": "s",
        }
        assert [field.name for field in dataclasses.fields(Merit)] == list(MERIT_UNITS)


def test_half_the_supply_is_out_of_reach_and_no_failure(folder: Path) -> None:
    """And where the plant can reach the set point, the least time is that of the single run."""
    with (folder / "vsc3.csv").open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    weak = [row for row in rows if row["supply_ratio"] == "0.5"]
    assert len(weak) == 4
    assert {row["least_time_s"] for row in weak} == {""}
    last = rows[-1]
    believed = dict(zip(names := ["payload_mass", "amplifier_gain"], get_parameters(arm(), names), strict=True))
    plant = set_parameters(arm(), {name: 2.0 * float(value) for name, value in believed.items()})
    least = least_reach_times(plant, np.radians([float(last["set_point_deg"])]), 10.0, 3.0, 0.01)
    assert float(last["least_time_s"]) == pytest.approx(float(least[0]), abs=1e-9)
    assert last["least_time_s"] == last["least_time_own_limit_s"]
    record = json.loads((folder / "sweep.json").read_text(encoding="utf-8"))
    counted = record["sweep"]["settling_over_least_time"]["vsc3"]["all_controllers"]
    settled = sum(row["settling_time_s"] != "" for row in rows)
    assert (counted["unreachable"], counted["settled"], counted["never"]) == (4, settled, 4 - settled)
    page = (folder / "index.html").read_text(encoding="utf-8")
    assert "settling over least time" in page
    assert "whose set point its plant can reach (4 others not counted)" in page


@pytest.mark.slow
def test_one_mismatch_alone_is_swept_as_a_curve(tmp_path: Path, folder: Path, browser: Any) -> None:
    """Its loops are those of the map where the other mismatch is 1."""
    alone = dataclasses.replace(SETTINGS, second="", points=3)
    run_sweep(arm(), alone, tmp_path, f"smajax sweep {HOSTILE}")
    with (tmp_path / "vsc3.csv").open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert [(row["payload_ratio"], row["set_point_deg"]) for row in rows] == [
        (ratio, angle) for ratio in ("0.5", "1", "2") for angle in ("0", "30")
    ]
    assert not any("supply" in name for name in rows[0])
    system = arm()
    believed = np.asarray(get_parameters(system, ["payload_mass"]))[0]
    plant = set_parameters(system, {"payload_mass": 2.0 * believed})
    controller = CONTROLLERS["vsc3"].make(system)
    loop = by_machine_code(simulate_closed_loop)(plant, controller, constant(clock(3.0, 0.01), np.radians(30.0)), 0.01)
    assert float(rows[-1]["energy_J"]) == pytest.approx(float(merit(loop, plant).energy), rel=1e-5)
    with xr.open_dataset(tmp_path / "sweep.nc", engine="scipy") as found:
        assert found["energy"].dims == ("controller", "payload_ratio", "set_point", "gain_ratio")
        assert float(found["energy"][0, 2, 1, 0]) == pytest.approx(float(rows[-1]["energy_J"]), rel=1e-5)
    record = json.loads((tmp_path / "sweep.json").read_text(encoding="utf-8"))
    assert (record["sweep"]["mismatches"], record["sweep"]["loops"]) == (["payload"], 6)
    page = (tmp_path / "index.html").read_text(encoding="utf-8")
    assert "<h2>Mismatch of payload</h2>" in page
    assert "On all mismatches of payload it settles" in page
    assert faults(browser, tmp_path / "index.html") == []


def test_the_page_has_no_fault_in_a_browser(folder: Path, browser: Any) -> None:
    assert faults(browser, folder / "index.html") == []


def test_finished_controllers_are_cached(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    before = (folder / "vsc3.csv").read_bytes()

    def never(*_: object, **__: object) -> None:
        raise AssertionError("computed again")

    monkeypatch.setattr("smajax.control.sweep.run_sweep.closed_loops", never)
    run_sweep(arm(), SETTINGS, folder)
    assert (folder / "vsc3.csv").read_bytes() == before
    other = dataclasses.replace(SETTINGS, set_points=(0.0, 31.0))
    with pytest.raises(AssertionError, match="computed again"):
        run_sweep(arm(), other, folder)
    # Another law is another plant, though every parameter is the same.
    with pytest.raises(AssertionError, match="computed again"):
        run_sweep(arm("liang"), SETTINGS, folder)


def test_unknown_names_list_close_matches(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="backstepping2"):
        run_sweep(arm(), SweepSettings(("vsc4",)), tmp_path)
    with pytest.raises(ValueError, match="printed"):
        run_sweep(arm(), dataclasses.replace(SETTINGS, estimator="kalman"), tmp_path)
    for pair in (("payload", "wind"), ("payload", "payload"), ("", ""), ("wind", "")):
        with pytest.raises(ValueError, match="convection"):
            Grid(*pair, sweep_ratios(3), np.zeros(1), np.ones(1))
    with pytest.raises(ValueError, match="convection"):
        loop_rows({"wind": 1.2}, 0.0)


def test_an_odd_grid_has_the_unperturbed_plant_in_it() -> None:
    assert np.min(np.abs(sweep_ratios(15) - 1.0)) < 1e-12
    assert sweep_ratios(15)[[0, -1]] == pytest.approx([0.5, 2.0])


@pytest.mark.parametrize("name", sorted(CONTROLLERS))
def test_every_controller_has_its_main_gain(name: str) -> None:
    preset = CONTROLLERS[name]
    assert float(get_parameters(preset.make(arm()), [preset.main_gain])[0]) > 0.0


def test_noise_sample_time_and_delay_reach_the_loop() -> None:
    """A run with all three is the single loop with them; a period that is no whole number of steps is answered."""
    system, every = arm(), 2
    controller, gain = CONTROLLERS["vsc3"].make(system), CONTROLLERS["vsc3"].main_gain
    rows, sensor = loop_rows({}, 0.3), Sensor(noise_sigma=0.01)
    between = Interface(None, sensor, every, 3)
    setup = LoopSetup(system, controller, gain, seconds=2.0)
    found = closed_loops(dataclasses.replace(setup, interface=between, seed=5), rows).merits
    plain = closed_loops(setup, rows).merits
    key = jax.random.fold_in(jax.random.key(5), 0)
    wanted = constant(clock(2.0, 0.01), 0.3)
    loop = by_machine_code(simulate_closed_loop)(
        system, controller, wanted, 0.01, every, sensor=sensor, key=key, delay=3
    )
    # Judged while it runs, as its trajectory is afterwards.
    one = merit(loop, system)
    for field in dataclasses.fields(one):
        assert float(getattr(found, field.name)[0]) == pytest.approx(
            float(getattr(one, field.name)), rel=1e-6, abs=1e-8
        )
    assert abs(float(found.energy[0]) / float(plain.energy[0]) - 1.0) > 1e-3


def test_a_period_that_is_no_multiple_of_the_step_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="whole number"):
        run_sweep(arm(), dataclasses.replace(SETTINGS, period=0.015), tmp_path)


def test_only_controllers_may_be_added_to_a_folder() -> None:
    before = SETTINGS.record()
    assert json.loads(json.dumps(before)) == before
    assert may_resume(before, dataclasses.replace(SETTINGS, controllers=("pid", "vsc3")).record())
    assert not may_resume(before, dataclasses.replace(SETTINGS, controllers=("pid",)).record())
    assert not may_resume(before, dataclasses.replace(SETTINGS, seconds=4.0).record())
    tuned = (Gains("vsc3", {"boundary": 0.1}),)
    assert not may_resume(before, dataclasses.replace(SETTINGS, tuned=tuned).record())


def test_by_default_a_filter_reads_noise_and_steps_and_commands_are_late() -> None:
    """Of the arm those of the requirement, of another load the same strain of the wire; with the true state none of them."""
    default, true = sweep_settings_for(arm(), ["pid"]), sweep_settings_for(arm(), ["pid"], estimator="")
    assert (default.estimator, default.noise, default.quantum, default.delay) == ("adaptive", 0.1, 0.1, 1)
    assert "late and are told their states from the filter `adaptive`" in default.between
    assert "the angle with 0.1° of noise in steps of 0.1°." in default.between
    assert (true.estimator, true.noise, true.quantum, true.delay) == ("", 0.0, 0.0, 0)
    assert true.between == "Controllers are called every 10 ms and are told the true state, the angle without noise."
    assert sweep_settings_for(arm(), ["pid"], noise=0.2).quantum == 0.0
    spring = compose("flexinol_table_3_2", "bias_spring", "flexinol_voltage")
    strain = 1e-3 * sweep_settings_for(spring, ["pid"]).noise * float(moving_load(spring).contraction(spring.wire))
    assert strain == pytest.approx(np.radians(0.1) * float(moving_load(arm()).contraction(arm().wire)), rel=0.06)
    with pytest.raises(ValueError, match="a quantum is a size"):
        dataclasses.replace(default, quantum=-0.1).check(arm())


def test_a_counted_reading_reaches_the_loop() -> None:
    """A run with steps in its readings is the single loop with them."""
    system, rows = arm(), loop_rows({}, 0.3)
    controller, gain = CONTROLLERS["vsc3"].make(system), CONTROLLERS["vsc3"].main_gain
    between = interface_of(system, "", 0.0, 0.01, 0.01, 0, 5.0)
    assert between.sensor is not None
    assert float(between.sensor.quantum) == pytest.approx(np.radians(5.0))
    found = closed_loops(LoopSetup(system, controller, gain, 2.0, interface=between), rows).merits
    plain = closed_loops(LoopSetup(system, controller, gain, 2.0), rows).merits
    loop = by_machine_code(simulate_closed_loop)(
        system, controller, constant(clock(2.0, 0.01), 0.3), 0.01, sensor=between.sensor, key=jax.random.key(0)
    )
    assert float(found.energy[0]) == pytest.approx(float(merit(loop, system).energy), rel=1e-6)
    assert abs(float(found.energy[0]) / float(plain.energy[0]) - 1.0) > 1e-4


def test_mismatches_may_be_small() -> None:
    near = dataclasses.replace(SETTINGS, ratio_range=(0.9, 1.1), points=5)
    assert near.grid.ratios[[0, 2, 4]] == pytest.approx([0.9, 1.0, 1.1], abs=1e-12)
    assert (SETTINGS.line_ratios, near.line_ratios) == ((0.5, 0.8, 1.0, 1.25, 2.0), (0.9, 0.967, 1.0, 1.031, 1.1))
    with pytest.raises(ValueError, match=r"from below 1 to above 1, such as 0.9 to 1.1; not 1.1 to 0.9"):
        dataclasses.replace(near, ratio_range=(1.1, 0.9)).check(arm())


def test_the_record_has_a_digest_of_the_numbers_that_each_picture_draws(folder: Path) -> None:
    record = json.loads((folder / "sweep.json").read_text(encoding="utf-8"))
    assert set(record["pictures"]) == {path.name for path in folder.glob("*.png")}
    assert record["pictures"]["comparison.png"] == comparison_digest(record)
    maps = record["sweep"]["maps"]["vsc3"]
    assert record["pictures"]["vsc3_maps.png"] == digest_of(maps)
    maps["energy"]["worst"][1][1] *= 1.01
    assert record["pictures"]["vsc3_maps.png"] != digest_of(maps)
    record["controllers"]["vsc3"]["energy"][0] *= 1.01
    assert record["pictures"]["comparison.png"] != comparison_digest(record)


def test_a_picture_holds_the_digest_of_its_numbers_as_text(drawn: None) -> None:
    image = numbered_png(lambda figure: None, (1.0, 1.0), 50, digest_of([1.0, None]))
    with Image.open(io.BytesIO(image)) as picture:
        assert picture.info[IN_PICTURE] == digest_of([1.00001, None]) != digest_of([1.001, None])
