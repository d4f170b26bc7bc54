"""An experiment before any fit: what was read of each run, the model at the initial guess beside it, and what the runs determine."""

from __future__ import annotations

import dataclasses
import json
from pathlib import Path

import jax.numpy as jnp
import numpy as np
import pytest

import smajax as sma
from smajax.report.check_words import conclusions, run_rows, warnings
from tests.helpers.small_bench import bench, log, refused, smajax, table

pytestmark = pytest.mark.usefixtures("blank_pictures")


def test_the_model_at_the_initial_guess_is_the_simulators(tmp_path: Path) -> None:
    found = sma.check_experiment(sma.load_experiment(bench(tmp_path)))
    first, second = found.runs
    assert (first.role, second.role) == ("fit", "held-out")
    (one,) = first.series
    system = sma.set_parameters(
        sma.build("flexinol_table_3_2", "dead_weight", "voltage"), {"convection_coefficient": 100.0}
    )
    volts = jnp.asarray(first.inputs["voltage"])
    run = sma.simulate_dataset(system, {"voltage": volts}, dt=0.1, tolerance=1e-6)
    exact = run["reading"].to_numpy()
    assert np.abs(one.simulated - exact).max() < 0.2 * one.noise
    assert np.abs(first.states["temperature"] - run["temperature"].to_numpy()).max() < 1.0
    assert one.rmse == pytest.approx(float(np.sqrt(np.mean((one.measured - exact) ** 2))), rel=1e-2)
    assert found.rmse() == one.rmse  # of the fit runs, of which there is one
    assert found.checks.identifiable.rank == 1


def test_a_missing_sample_counts_for_nothing(tmp_path: Path) -> None:
    path = bench(tmp_path, ('noise = "0.1 mm"', 'noise = "0.1 mm"\nmissing = "skip"'))
    lines = (tmp_path / "a.csv").read_text().splitlines()
    gap = [",".join([*line.split(",")[:2], "nan"]) if 40 <= number < 60 else line for number, line in enumerate(lines)]
    (tmp_path / "a.csv").write_text("\n".join(gap))
    found = sma.check_experiment(sma.load_experiment(path))
    (one,) = found.runs[0].series
    missing = int(np.isnan(one.measured).sum())
    assert missing > 0
    assert np.isfinite(one.simulated).all()
    assert np.isfinite(one.rmse)
    head, rows = run_rows(found)
    assert rows[0][head.index("missing")] == str(missing)


def test_a_wire_that_stays_cold_is_said_to(tmp_path: Path) -> None:
    def said(first: float, second: float) -> list[str]:
        path = bench(tmp_path)
        log(tmp_path / "a.csv", top=first)
        log(tmp_path / "b.csv", top=second)
        found = sma.check_experiment(sma.load_experiment(path))
        return [one for one in conclusions(found) if "does not transform" in one]

    assert said(9.0, 8.0) == []
    assert "in B (it reaches 23" in "".join(said(9.0, 0.5))
    assert "in any run" in "".join(said(0.4, 0.5))


def test_the_command_writes_a_page_and_the_same_numbers(tmp_path: Path) -> None:
    path, out = bench(tmp_path), tmp_path / "out"
    ended = smajax("check", path, "--out", out)
    assert ended.code == 0, ended.said
    assert "can be read: 1 fit run and 1 held-out run of position, on a clock of 100 ms; 1 unknown to fit." in ended.out
    record = json.loads((out / "check.json").read_text())
    page = (out / "check.html").read_text()
    assert [run["name"] for run in record["runs"]] == ["A", "B"]
    assert (
        record["runs"][0]["outputs"]["position"]["rmse"]
        > 10.0 * record["runs"][0]["outputs"]["position"]["noise_sigma"]
    )
    assert all(sentence in ended.out for sentence in record["conclusions"])
    assert "smajax close-loop" in page
    assert ended.said.count("gives nothing of this bench") + ended.out.count("gives nothing of this bench") == 1
    # Once more, as a program asks for it; and an edited file is checked in the place of the one before.
    again = smajax("check", path, "--out", out, "--json")
    assert json.loads(again.out)["runs"] == record["runs"]
    path.write_text(path.read_text().replace('start = "100 W', 'start = "110 W'))
    assert (
        json.loads(smajax("check", path, "--out", out, "--json").out)["unknowns"]["convection_coefficient"]["start"]
        == 110.0
    )
    # But no other result.
    assert "--overwrite" in refused("identify", path, "--out", out)


def test_what_cannot_be_read_leaves_nothing(tmp_path: Path) -> None:
    path = bench(tmp_path, ('unit = "mm"', 'unit = "mmm"'))
    assert "mmm" in refused("check", path, "--out", tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_a_file_without_unknowns_is_checked_too(tmp_path: Path) -> None:
    """As one is that `close-loop` takes as it is."""
    path = bench(tmp_path)
    before, _, rest = path.read_text().partition("[unknown]")
    path.write_text(before + rest[rest.index("[sampling]") :])
    ended = smajax("check", path, "--out", tmp_path / "out")
    assert ended.code == 0, ended.said
    assert "0 unknowns to fit" in ended.out
    assert "Nothing is declared unknown" in ended.out


def test_a_zero_of_each_run_is_taken_off_and_shown(tmp_path: Path) -> None:
    path = bench(tmp_path, ('noise = "0.1 mm"', 'noise = "0.1 mm"\noffset = true'))
    held = np.loadtxt(tmp_path / "b.csv", delimiter=",", skiprows=1)
    plain = sma.check_experiment(sma.load_experiment(path))
    table(tmp_path / "b.csv", held[:, 0], held[:, 1], held[:, 2] + 7.0)
    moved = sma.check_experiment(sma.load_experiment(path))
    (before,), (after,) = plain.runs[1].series, moved.runs[1].series
    assert before.offset is not None
    assert after.offset is not None
    assert after.offset == pytest.approx(before.offset + 7e-3, abs=1e-6)
    assert after.rmse == pytest.approx(before.rmse, rel=1e-4)
    head, rows = run_rows(moved)
    assert float(rows[1][head.index("position, zero of the run (mm)")]) == pytest.approx(1e3 * after.offset, rel=1e-2)
    assert any("Each run's own zero is taken off." in one for one in conclusions(moved))


def test_a_run_without_numbers_is_named_and_not_taken_for_a_wire_at_rest(tmp_path: Path) -> None:
    found = sma.check_experiment(sma.load_experiment(bench(tmp_path)))
    run = found.runs[0]
    (one,) = run.series
    gone = dataclasses.replace(one, simulated=np.where(run.time > 5.0, np.nan, one.simulated), rmse=np.nan)
    cold = {name: np.where(run.time > 5.0, np.nan, values) for name, values in run.states.items()}
    broken = dataclasses.replace(found, runs=(dataclasses.replace(run, series=(gone,), states=cold), found.runs[1]))
    said = warnings(broken)
    assert any("no number for samples of A:" in text for text in said)
    assert not any("does not transform in A" in text for text in said)
    assert np.isnan(broken.rmse())
    assert not any("of the fit runs is off" in text for text in conclusions(broken))


def test_a_load_that_no_wire_stands_is_a_warning(tmp_path: Path) -> None:
    heavy = bench(tmp_path, ("[unknown]", '[model.parameters]\nload_mass = "75 kg"\n[unknown]'))
    (said,) = [
        one for one in warnings(sma.check_experiment(sma.load_experiment(heavy))) if "no wire carries more" in one
    ]
    assert "check the load" in said
    usual = sma.check_experiment(sma.load_experiment(bench(tmp_path / "usual")))
    assert not any("no wire carries more" in one for one in warnings(usual))
