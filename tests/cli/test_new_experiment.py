"""`smajax new-experiment`: an experiment file generated from logs loads without edits, and says what is missing."""

from __future__ import annotations

import json
import re
import tomllib
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import scipy.io
import xarray as xr
from typer.testing import CliRunner

from smajax.cli.main import app
from smajax.core.parameters import parameter_values
from smajax.data.experiment.column_guess import columns_of
from smajax.data.experiment.draft import draft
from smajax.data.experiment.errors import ExperimentError
from smajax.data.experiment.load import load_experiment
from smajax.data.model_catalogue import CATALOGUE
from smajax.data.readers.read import read_table
from smajax.data.readers.table import MeasuredDataError
from smajax.fit.base_model import base_model
from smajax.model.presets import build
from tests.helpers.command_line import DEMO
from tests.helpers.small_bench import log, smajax

run = CliRunner()


def test_a_template_loads_as_it_is(tmp_path: Path) -> None:
    logs = [str(DEMO / name) for name in ("steps.csv", "triangle.csv", "pulses.csv")]
    told = run.invoke(app, ["new-experiment", *logs, "--out", str(tmp_path / "e.toml"), "--json"])
    assert told.exit_code == 0, told.output
    assert json.loads(told.stdout)["loads"]
    begun_as, made = load_experiment(tmp_path / "e.toml", CATALOGUE), load_experiment(DEMO, CATALOGUE)
    assert [one.role for one in begun_as.runs] == ["fit", "fit", "held-out"]
    # What a role means stands once, and is true whatever the roles are.
    text = (tmp_path / "e.toml").read_text(encoding="utf-8")
    assert '\n# Runs of role "fit" are fitted; those of role "held-out" are not: ' in text
    assert re.findall('^role = "(?:fit|held-out)"(.*)$', text, re.MULTILINE) == ["", "", ""]
    np.testing.assert_array_equal(begun_as.runs[0].inputs["voltage"], made.runs[0].inputs["voltage"])
    np.testing.assert_array_equal(begun_as.runs[0].outputs["position"], made.runs[0].outputs["position"])
    assert run.invoke(app, ["new-experiment", *logs, "--out", str(tmp_path / "e.toml")]).exit_code == 2


def test_three_logs_are_two_fit_runs_and_a_held_out_one_without_a_warning_of_that(tmp_path: Path) -> None:
    """What the draft itself decides is said in its list of guesses, and is nothing to warn of."""
    logs = [str(DEMO / name) for name in ("steps.csv", "triangle.csv", "pulses.csv")]
    said = smajax("new-experiment", *logs, "--out", tmp_path / "e.toml").out
    assert "held out: the last run, pulses, to validate the fit of the other 2; a fourth log would be a third" in said
    assert [
        one
        for one in load_experiment(tmp_path / "e.toml", CATALOGUE).warnings
        if " fit run" in one or "held out" in one
    ] == []
    two = smajax("new-experiment", *logs[:2], "--out", tmp_path / "two.toml").out
    assert "warning: only 2 fit runs: " in two
    assert "warning: no run is held out: " in two


@pytest.mark.parametrize(
    ("heading", "asked"),
    [("displacement [mm]", "damping"), ("angle [deg]", "pulley_radius"), ("mass [g]", "wire_length")],
)
def test_a_template_lists_the_sizes_that_a_bench_should_give(tmp_path: Path, heading: str, asked: str) -> None:
    """With the preset's values, which may be taken as they stand."""
    headings = ["time [s]", "U [V]", heading] + ["displacement [mm]"] * heading.startswith("mass")
    rows = [[k / 10, 5.0 * (k % 20 > 9), *[3.0 + np.sin(k / 9)] * (len(headings) - 2)] for k in range(200)]
    log = "\n".join([",".join(headings), *(",".join(map(str, row)) for row in rows)])
    (tmp_path / "log.csv").write_text(log)
    guessed = draft([tmp_path / "log.csv"], tmp_path / "e.toml")
    assert any("the bench: the preset's wire_length" in line for line in guessed.messages)
    assert any("`--known wire_length=VALUE,... --overwrite`" in line for line in guessed.messages)
    head, _, rest = guessed.text.partition("[model.parameters]")
    known, _, tail = rest.partition("[unknown]")
    said = head + "[model.parameters]" + known.replace("\n# ", "\n")
    assert f"\n{asked} = " in said
    assert ("\nload_mass = " in said) == heading.startswith("displacement")
    (tmp_path / "e.toml").write_text(f"{said}[unknown]{tail}")
    model = tomllib.loads(said)["model"]
    before = parameter_values(build(model["wire"], model["load"], model["drive"]))
    after = parameter_values(base_model(load_experiment(tmp_path / "e.toml", CATALOGUE)))
    for name in model["parameters"]:
        assert after[name] == pytest.approx(before[name], rel=1e-3)


def test_a_template_refers_only_to_installed_files(tmp_path: Path) -> None:
    log = _bench_log(tmp_path / "log.csv", "Zeit/ms;U/V;Weg/mm", lambda k: str(100 * k))
    text = draft([log], tmp_path / "e.toml").text
    (page,) = re.findall("the page '(.*)'", text)
    assert f"- {page}: studies/parameters.md" in (Path(__file__).parents[2] / "mkdocs.yml").read_text(encoding="utf-8")
    assert not re.search(r"[\w/]+\.(md|html)\b", text)


def test_the_other_load_can_be_asked_for_and_a_wrong_one_is_refused(tmp_path: Path) -> None:
    rows = [f"{k / 10},{5.0 * (k % 20 > 9)},{3.0 + np.sin(k / 9)}" for k in range(200)]
    log = tmp_path / "log.csv"
    log.write_text("\n".join(["time [s],U [V],displacement [mm]", *rows]))
    out = tmp_path / "e.toml"
    told = run.invoke(app, ["new-experiment", str(log), "--load", "bias_spring", "--out", str(out)])
    assert told.exit_code == 0, told.output
    load_experiment(out, CATALOGUE)
    assert tomllib.loads(out.read_text(encoding="utf-8"))["model"]["load"] == "bias_spring"
    assert "# spring_stiffness = " in out.read_text(encoding="utf-8")
    refused = run.invoke(app, ["new-experiment", str(log), "--load", "arm", "--out", str(tmp_path / "f.toml")])
    assert refused.exit_code != 0
    assert re.search(r"of position: dead_weight or bias_spring (or \w+ )*does", str(refused.exception))
    assert not (tmp_path / "f.toml").exists()


def test_a_log_of_ambiguous_commas_gets_a_decimal_key(tmp_path: Path) -> None:
    rows = [f"{k};{5 * (k % 20 > 9)};{k // 100 + 1},{k % 100:03}" for k in range(200)]
    (tmp_path / "log.csv").write_text("\n".join(["time [s];U [V];displacement [mm]", *rows]))
    asked = ["new-experiment", str(tmp_path / "log.csv"), "--out", str(tmp_path / "e.toml")]
    untold = run.invoke(app, asked)
    assert untold.exit_code == 3
    assert "(`smajax new-experiment --decimal ,`)" in untold.output
    assert '\n# decimal = ","  #' in (tmp_path / "e.toml").read_text()
    told = run.invoke(app, [*asked, "--overwrite", "--decimal", ","])
    assert told.exit_code == 0, told.output
    assert tomllib.loads((tmp_path / "e.toml").read_text())["data"]["decimal"] == ","
    assert load_experiment(tmp_path / "e.toml", CATALOGUE).runs[0].output[-1] == pytest.approx(2.099e-3)
    wrong = run.invoke(app, [*asked, "--overwrite", "--decimal", ";"])
    assert wrong.exit_code == 2
    assert "`,` or `.`, not `;`" in wrong.output


def _angle_log(path: Path) -> Path:
    rows = [f"{k / 10},{5.0 * (k % 20 > 9)},{30.0 + 20.0 * np.sin(k / 9)}" for k in range(200)]
    path.write_text("\n".join(["time [s],U [V],angle [deg]", *rows]))
    return path


def test_bounds_are_those_of_the_chosen_wire(tmp_path: Path) -> None:
    log, out = str(_angle_log(tmp_path / "log.csv")), tmp_path / "e.toml"
    chosen = ["--wire", "flexinol_table_3_2", "--drive", "amplified_voltage"]
    told = run.invoke(app, ["new-experiment", log, *chosen, "--out", str(out)])
    assert told.exit_code == 0, told.output
    assert "as requested: wire and drive; the rest is a guess" in told.output
    loaded = load_experiment(out, CATALOGUE)
    assert (loaded.wire, loaded.load, loaded.drive) == ("flexinol_table_3_2", "arm", "amplified_voltage")
    boxes = {one.name: one for one in loaded.unknowns}
    assert boxes["specific_heat"].start == 322.0
    assert not any("box" in one for one in loaded.warnings)


def test_bounds_of_another_wire_are_a_warning(tmp_path: Path) -> None:
    """With the value, the box and the command that writes others."""
    text = draft([_angle_log(tmp_path / "log.csv")], tmp_path / "e.toml").text
    (tmp_path / "e.toml").write_text(text.replace("niti_table_3_1", "flexinol_table_3_2"))
    (told,) = [one for one in load_experiment(tmp_path / "e.toml", CATALOGUE).warnings if "box" in one]
    assert "outside the box of specific_heat = 322 J/(kg K) (box: 418 to 2510)" in told
    assert "`smajax new-experiment LOG --wire flexinol_table_3_2` writes its own" in told


@pytest.mark.parametrize(
    ("chosen", "words"),
    [
        (["--wire", "flexinol"], "there is no wire 'flexinol'; did you mean 'flexinol_"),
        (["--drive", "amplified"], "there is no drive 'amplified'; did you mean 'amplified_voltage'?"),
        (["--drive", "none"], "a coupon's temperature is prescribed"),
    ],
)
def test_presets_that_cannot_be_asked_for_are_refused(tmp_path: Path, chosen: list[str], words: str) -> None:
    log = str(_angle_log(tmp_path / "log.csv"))
    refused = run.invoke(app, ["new-experiment", log, *chosen, "--out", str(tmp_path / "e.toml")])
    assert refused.exit_code != 0
    assert words in refused.output + str(refused.exception)
    assert not (tmp_path / "e.toml").exists()


def _block(path: Path, name: str, every: float, values: np.ndarray) -> None:
    """A Simulink log of one signal, as a "Structure with time"."""
    time = every * np.arange(values.size)
    scipy.io.savemat(path, {name: {"time": time[:, None], "signals": {"values": values[:, None]}}})


def test_logs_may_call_their_columns_otherwise(tmp_path: Path) -> None:
    """Semicolons and decimal commas in one, milliseconds in another: each run says what is its own."""
    time = np.arange(400) / 50.0
    current, moved = 0.3 * (time % 4.0 > 1.0), 4.0 * np.sin(time) ** 2 + 0.3
    noisy = moved + 0.01 * np.random.default_rng(1).standard_normal(400)
    rows = [";".join(f"{v:.4f}".replace(".", ",") for v in row) for row in zip(time, current, noisy, strict=True)]
    (tmp_path / "a.csv").write_text("Zeit [s];Strom [A];Weg [mm]\n" + "\n".join(rows))
    rows = [f"{1e3 * t:.0f},{i:.4f},{x:.4f}" for t, i, x in zip(time, current, noisy, strict=True)]
    (tmp_path / "b.csv").write_text("t_ms,I_A,disp_mm\n" + "\n".join(rows))
    (tmp_path / "c.csv").write_text("t_ms,I_A,force_N\n" + "\n".join(rows))
    logs = [str(tmp_path / name) for name in ("a.csv", "b.csv")]
    told = run.invoke(app, ["new-experiment", *logs, "--out", str(tmp_path / "e.toml")])
    assert told.exit_code == 0, told.output
    assert "b.csv: t_ms: time in ms (sure: heading and unit)" in told.output
    text = (tmp_path / "e.toml").read_text()
    assert 'columns = { time = "t_ms", current = "I_A", position = "disp_mm" }' in text
    assert 'units = { time = "ms" }' in text
    first, second = load_experiment(tmp_path / "e.toml", CATALOGUE).runs
    np.testing.assert_allclose(second.time, first.time, rtol=0.0, atol=1e-9)
    np.testing.assert_allclose(second.inputs["current"], first.inputs["current"], rtol=0.0, atol=1e-9)
    np.testing.assert_allclose(second.outputs["position"], first.outputs["position"], rtol=0.0, atol=1e-9)
    lacks = run.invoke(app, ["new-experiment", *logs, str(tmp_path / "c.csv"), "--out", str(tmp_path / "f.toml")])
    assert "c.csv: no column 'Weg [mm]'; it has: t_ms, I_A, force_N" in str(lacks.exception)


def test_a_run_may_be_a_file_for_each_sensor(tmp_path: Path) -> None:
    """Pairs of .mat files at different rates, told apart by their names, also when they come in another order."""
    runs = ("Step01", "Step02_PR", "Ramp01")
    for k, name in enumerate(runs):
        _block(tmp_path / f"SensorInput_{name}.mat", "Board_DutyCycle", 0.01, 0.01 * (np.arange(3000) % 900 > 300 + k))
        moved = 0.004 * np.sin(np.arange(300) / (30 + k)) ** 2 + 1e-5 * np.random.default_rng(k).standard_normal(300)
        _block(tmp_path / f"SensorPosition_{name}.mat", "SensorPosition", 0.1, moved)
    logs = [str(tmp_path / f"Sensor{kind}_{name}.mat") for kind in ("Position", "Input") for name in runs]
    told = run.invoke(app, ["new-experiment", *logs, "--out", str(tmp_path / "e.toml")])
    assert told.exit_code == 0, told.output
    assert "Step02_PR of SensorPosition_Step02_PR.mat and SensorInput_Step02_PR.mat" in told.output
    assert "Board_DutyCycle: duty in 1 (likely" in told.output
    made = load_experiment(tmp_path / "e.toml", CATALOGUE)
    assert [(one.name, one.role) for one in made.runs] == list(zip(runs, ("fit", "fit", "held-out"), strict=True))
    assert made.step == 0.1
    for k, one in enumerate(made.runs):
        assert [file.name for file in one.files] == [f"SensorInput_{runs[k]}.mat", f"SensorPosition_{runs[k]}.mat"]
    alone = run.invoke(app, ["new-experiment", *logs[:-1], "--out", str(tmp_path / "f.toml")])
    assert isinstance(alone.exception, MeasuredDataError)
    assert "Ramp01, Step01, Step02_PR among SensorPosition_Step01.mat" in str(alone.exception)
    assert "Step01, Step02_PR among SensorInput_Step01.mat" in str(alone.exception)
    assert not (tmp_path / "f.toml").exists()


def test_files_of_a_run_may_have_a_time_column_of_one_name(tmp_path: Path) -> None:
    rows = [(k / 10, 5.0 * (k % 20 > 9), 3.0 * np.sin(k / 9)) for k in range(60)]
    for name, place in (("U [V]", 1), ("Displ [mm]", 2)):
        text = "\n".join(f"{row[0]},{row[place]}" for row in rows)
        (tmp_path / f"{name[0]}.csv").write_text(f"time [s],{name}\n{text}\n")
    logs = [tmp_path / "U.csv", tmp_path / "D.csv"]
    text = draft(logs, tmp_path / "e.toml").text
    assert 'files = { voltage = "U.csv", position = "D.csv" }' in text
    (tmp_path / "e.toml").write_text(text)
    (one,) = load_experiment(tmp_path / "e.toml", CATALOGUE).runs
    assert (one.name, one.inputs["voltage"][15]) == ("run", 5.0)
    (tmp_path / "D.csv").write_text((tmp_path / "D.csv").read_text().replace("time [s]", "Time [ms]"))
    with pytest.raises(
        MeasuredDataError, match=r"its time is 'Time \[ms\]' in ms, that of U\.csv is 'time \[s\]' in s"
    ):
        draft(logs, tmp_path / "e.toml")


@pytest.mark.parametrize(
    ("head", "row", "expected"),
    [
        ("Time [ms],U [mV],Displ [mm]", "{t},{v},{x}", {"time": "ms", "voltage": "mV", "position": "mm"}),
        (
            "t;T (C);Strain;Stress",
            "{t};{T};{e};{s}",
            {"time": "s", "temperature": "degC", "strain": "1", "stress": "MPa"},
        ),
        ("zeit,Winkel,PWM", "{t},{x},{p}", {"time": "s", "angle": "deg", "duty": "percent"}),
        (
            "seconds,Room temp,Temp,u",
            "{t},{T},{K},{v}",
            {"time": "s", "ambient_temperature": "degC", "temperature": "K", "voltage": "mV"},
        ),
    ],
)
def test_units_are_those_of_headings_and_magnitudes(
    tmp_path: Path, head: str, row: str, expected: dict[str, str]
) -> None:
    values = [
        {
            "t": 10 * k,
            "v": 5000 * (k % 20 > 9),
            "x": 3.1 + 10 * np.sin(k),
            "T": 30 + k,
            "e": 0.01 + k / 1e4,
            "s": 100 + k,
            "p": 40,
            "K": 300 + k,
        }
        for k in range(40)
    ]
    (tmp_path / "log.csv").write_text("\n".join([head, *(row.format(**one) for one in values)]))
    assert {one.quantity: one.unit for one in columns_of(read_table(tmp_path / "log.csv")) if one.quantity} == expected


def _bench_log(path: Path, head: str, clock: Callable[[int], str], end: str = "") -> Path:
    rows = (f"{clock(k)};{5 * (k % 40 > 19)};{10 * np.sin(k / 9):.3f}" for k in range(80))
    path.write_text("\n".join([head, *rows]) + end, encoding="utf-8")
    return path


@pytest.mark.parametrize(
    ("head", "clock", "unit"),
    [
        ("Timestamp;U [V];x [mm]", lambda k: f"2026-11-12 10:00:{k // 10:02}.{k % 10}00", "s"),
        ("Uhrzeit;Spannung/V;Weg/mm", lambda k: f"10:00:{k // 10:02},{k % 10}00", "s"),
        ("Zeit/ms;U/V;s/mm", lambda k: str(100 * k), "ms"),
        ("Zeit;U;Weg\nms;V;mm", lambda k: str(100 * k), "ms"),
    ],
)
def test_times_and_units_as_german_loggers_write_them(
    tmp_path: Path, head: str, clock: Callable[[int], str], unit: str
) -> None:
    guessed = draft([_bench_log(tmp_path / "log.csv", head, clock)], tmp_path / "e.toml")
    (tmp_path / "e.toml").write_text(guessed.text, encoding="utf-8")
    experiment = load_experiment(tmp_path / "e.toml", CATALOGUE)
    assert f'unit = "{unit}"' in guessed.text
    assert experiment.step == 0.1
    assert experiment.clocked
    assert np.ptp(experiment.runs[0].output) == pytest.approx(0.02, rel=0.01)
    assert experiment.runs[0].time[-1] == pytest.approx(7.9)


@pytest.mark.parametrize("end", ["\nEnde;5;1", "\n3;5;1"])
def test_an_unreadable_time_is_reported_first(tmp_path: Path, end: str) -> None:
    log = _bench_log(tmp_path / "log.csv", "Zeit;U [V];x [mm]", lambda k: str(k / 10), end)
    told = run.invoke(app, ["new-experiment", str(log), "--out", str(tmp_path / "e.toml")])
    first, *_, last = told.output.splitlines()
    why = (
        "line 82, column 'Zeit': 'Ende' is not a number"
        if "Ende" in end
        else "does not increase at line 82 (7.9 s then 3 s)"
    )
    assert "time: NOT READ: " in first
    assert why in first
    assert told.exit_code == 3  # and it is not sent on with a clock of counted samples
    assert "Next" not in last
    assert "It cannot be loaded yet" in told.output
    assert why in " ".join(told.output.splitlines()[1:])


def test_an_unknown_unit_is_reported_with_its_column(tmp_path: Path) -> None:
    log = _bench_log(tmp_path / "log.csv", "t/s;U/V;disp [furlonx]", lambda k: str(k / 10))
    told = draft([log], tmp_path / "e.toml").messages
    assert any(
        "named like a position, and its unit 'furlonx' is none of that: expected one like 'm'" in line for line in told
    )


def test_every_column_that_is_left_out_is_listed_with_its_line(tmp_path: Path) -> None:
    log = _bench_log(tmp_path / "log.csv", "Zeit/s;U/V;s/mm", lambda k: str(k / 10))
    lines = log.read_text().splitlines()
    more = ["F/N;note", *("oops;warm" if k == 50 else f"{k};warm" for k in range(1, 81))]
    log.write_text("\n".join(f"{a};{b}" for a, b in zip(lines, more, strict=True)))
    told = draft([log], tmp_path / "e.toml").messages
    assert any("F/N: left out (line 51, column 'F/N': 'oops' is not a number" in line for line in told)
    assert any("note: left out (line 2, column 'note': 'warm' is not a number" in line for line in told)


def test_files_that_began_at_different_clock_times_are_aligned(tmp_path: Path) -> None:
    for name, late in (("U [V]", 0), ("x [mm]", 20)):
        rows = [f"10:00:{(k + late) // 10:02}.{(k + late) % 10};{np.sin((k + late) / 9):.3f}" for k in range(60)]
        (tmp_path / f"{name[0]}.csv").write_text("\n".join([f"time;{name}", *rows]))
    (tmp_path / "e.toml").write_text(draft([tmp_path / "U.csv", tmp_path / "x.csv"], tmp_path / "e.toml").text)
    (one,) = load_experiment(tmp_path / "e.toml", CATALOGUE).runs
    assert (one.time[0], one.time[-1]) == pytest.approx((2.0, 5.9))
    np.testing.assert_allclose(one.inputs["voltage"], 1e3 * one.output)
    text = (tmp_path / "e.toml").read_text().replace('unit = "s"', 'unit = "ms"')
    (tmp_path / "e.toml").write_text(text)
    with pytest.raises(ExperimentError, match=r"holds clock times, which are read as seconds.*write unit = 's'"):
        load_experiment(tmp_path / "e.toml", CATALOGUE)


def test_an_input_that_no_column_gives_is_reported(tmp_path: Path) -> None:
    (tmp_path / "log.csv").write_text("time,displacement\n" + "\n".join(f"{k / 10},{np.sin(k / 9)}" for k in range(60)))
    guessed = draft([tmp_path / "log.csv"], tmp_path / "e.toml")
    assert any("voltage: MISSING" in line for line in guessed.messages)
    told = run.invoke(app, ["new-experiment", str(tmp_path / "log.csv"), "--out", str(tmp_path / "e.toml")])
    assert told.exit_code == 3
    assert "needs the input 'voltage'" in told.stdout.replace("\n", " ")


def test_units_that_a_file_states_come_before_magnitudes(tmp_path: Path) -> None:
    """A run that `smajax simulate` wrote: its position is an angle, and says so."""
    time = np.arange(60) / 10.0
    held = xr.Dataset(
        {"voltage": ("time", 5.0 * (time > 1.0), {"units": "V"}), "position": ("time", np.sin(time), {"units": "rad"})},
        {"time": ("time", time, {"units": "s"})},
    )
    held.to_netcdf(tmp_path / "run.nc", engine="scipy")
    found = {one.quantity: (one.key, one.unit) for one in columns_of(read_table(tmp_path / "run.nc"))}
    assert found == {"time": ("time", "s"), "voltage": ("voltage", "V"), "angle": ("position", "rad")}


def test_a_model_file_in_which_nothing_was_fitted_leaves_the_usual_unknowns(tmp_path: Path) -> None:
    model = tmp_path / "bench.toml"
    assert smajax("presets", "flexinol_table_3_2", "dead_weight", "voltage", "--out", model).code == 0
    text = model.read_text(encoding="utf-8")
    line = next(one for one in text.splitlines() if one.startswith("specific_heat"))
    model.write_text(text.replace(line, 'specific_heat = "450 J/kg/K"'), encoding="utf-8")
    runs = [log(tmp_path / f"{name}.csv") for name in ("a", "b")]
    table = [run.read_text(encoding="utf-8").replace("t,U,x", "t [s],U [V],x [mm]", 1) for run in runs]
    for run, content in zip(runs, table, strict=True):
        run.write_text(content, encoding="utf-8")
    ended = smajax("new-experiment", *runs, "--model", model, "--out", tmp_path / "experiment.toml")
    assert ended.code == 0, ended.said + ended.out
    experiment = load_experiment(tmp_path / "experiment.toml", CATALOGUE)
    names = {one.name for one in experiment.unknowns}
    assert "convection_coefficient" in names
    assert "specific_heat" not in names  # known since it was changed by hand
