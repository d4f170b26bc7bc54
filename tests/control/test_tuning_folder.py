"""A tuning's folder: its limit is met, its pages say what was found, and it resumes where it was stopped."""

from __future__ import annotations

import csv
import dataclasses
import json
import shutil
from pathlib import Path
from typing import Any

import jax.numpy as jnp
import numpy as np
import pytest
from typer.testing import CliRunner

from smajax.cli.main import app
from smajax.cli.options import UNMET
from smajax.cli.result_folder import LOCK, MARK
from smajax.control.closed_loop import simulate_closed_loop
from smajax.control.figures_of_merit import merit_by_set_point
from smajax.control.gains_file import GainsFileError, read_gains
from smajax.control.presets import CONTROLLERS
from smajax.control.reference import resting
from smajax.control.sweep.batched_loops import LoopSetup, closed_loops
from smajax.control.sweep.grid import loop_rows
from smajax.control.sweep.run_sweep import TRUE_STATE, SweepSettings, begun_sweep, sweep_controllers
from smajax.control.tune.cma_es import CmaEsState
from smajax.control.tune.evaluate import TuningProblem
from smajax.control.tune.folder_names import FILES
from smajax.control.tune.moves import walk
from smajax.control.tune.multistart import MultistartState, load
from smajax.control.tune.settings import TuneSettings
from smajax.control.tune.tuning_folder import tune_in_folder
from smajax.core.display_units import digits
from smajax.core.parameters import get_parameters, parameters
from smajax.core.progress import Event
from smajax.model.rigs import arm
from smajax.model.system import System
from smajax.report.sweep_folder import write_sweep
from smajax.report.tune_folder import finished as ended
from smajax.report.tune_folder import write_tuning
from tests.helpers.in_browser import HOSTILE, faults
from tests.helpers.machine_code import by_machine_code
from tests.helpers.small_bench import refused
from tests.helpers.tuning_rig import ROWS, SECONDS, SETTINGS

pytestmark = pytest.mark.usefixtures("blank_pictures")

COMMAND = f"smajax tune --out {HOSTILE}"  # what somebody typed


def tune_into(system: System, settings: TuneSettings, out: Path, command: str = "") -> None:
    write_tuning(tune_in_folder(system, settings, out), out, command)


def silent(event: Event) -> None:
    """Progress that is shown to no one."""


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("tune") / "vsc3"
    tune_into(arm(), SETTINGS, out, COMMAND)
    return out


def test_a_tuned_controller_meets_its_limit(folder: Path) -> None:
    record = json.loads((folder / "tune.json").read_text(encoding="utf-8"))
    exceeded = record["checks"]["tuned on"]["limit_exceeded_by_share"]
    assert exceeded["before"] > 0.0, "the preset must not meet it, or the test says nothing"
    assert exceeded["after"] == 0.0
    assert record["checks"]["tuned on"]["after"]["overshoot"]["worst"] <= 0.1


def test_the_folder_has_gains_page_tables_and_record(folder: Path) -> None:
    names = {one.name for one in folder.iterdir()}
    assert names == {
        "asked.json",
        "state.npz",
        "finish.npz",
        "gains.json",
        "tune.html",
        "tune.json",
        "loops.csv",
        "before_after.png",
        "descent.png",
    }
    page = (folder / "tune.html").read_text(encoding="utf-8")
    assert "overshoot" in page
    assert "another parameter wrong by 20 % (the air by 4 K)" in page
    assert page.count('src="data:image/png') == 3
    assert page.count('<figure class="series"') == 1
    assert page.count('srcset="data:image/png') == 1  # the same for a telephone
    record = json.loads((folder / "tune.json").read_text(encoding="utf-8"))["checks"]
    with (folder / "loops.csv").open(encoding="utf-8") as file:
        loops = list(csv.DictReader(file))
    assert len(loops) == 2 * sum(one["loops"] for one in record.values())
    for check, when in (("tuned on", "before"), ("beyond", "after")):
        errors = [float(one["steady_error [deg]"]) for one in loops if (one["check"], one["gains"]) == (check, when)]
        assert max(errors) == pytest.approx(record[check][when]["steady_error"]["worst"])


def test_moves_between_set_points_are_checked_and_reported(folder: Path) -> None:
    assert walk([0.0, -40.0, 85.0, 20.0]) == [-40.0, 85.0, 0.0, 20.0]
    assert len(walk(list(range(50)))) == 12
    record = json.loads((folder / "tune.json").read_text(encoding="utf-8"))
    moves = record["moves"]
    assert moves["set_points_deg"] == [0.0, 30.0]
    assert [len(moves[when]["overshoot_deg"]) for when in ("before", "after")] == [1, 1]
    # The same walk as `simulate` would run it.
    rig = TuningProblem(CONTROLLERS["vsc3"], arm(), seconds=SECONDS, loops=16)
    gains = read_gains(folder / "gains.json", arm()).put(rig.system)
    wanted = resting(jnp.asarray(np.radians(np.repeat([0.0, 30.0], [600, 601]))))
    loop = by_machine_code(simulate_closed_loop)(rig.system, gains, wanted, 0.005, every=2)
    (_, second) = merit_by_set_point(loop, rig.system)
    assert moves["after"]["overshoot_deg"][0] == pytest.approx(np.degrees(float(second.merit.overshoot)), abs=1e-6)
    told = " ".join(record["conclusions"])
    assert "one step from the start, cold and at rest" in told
    assert "In 1 move from one set point to another" in told
    assert "Slopes ended at a cost of" in told


def test_the_page_has_no_fault_in_a_browser(folder: Path, browser: Any) -> None:
    assert faults(browser, folder / "tune.html") == []


@pytest.mark.parametrize(
    ("state", "count", "finished"),
    [
        pytest.param(MultistartState, "round", 0, marks=pytest.mark.slow),
        (MultistartState, "round", 2),
        (CmaEsState, "generations", 2),
    ],
)
def test_a_stopped_tuning_resumes_to_the_same_result(
    folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, state: Any, count: str, finished: int
) -> None:
    out, wrote = tmp_path / "again", state.save

    def interrupted(self: Any, path: Path) -> None:
        wrote(self, path)
        if getattr(self, count) == finished:
            raise KeyboardInterrupt

    monkeypatch.setattr(state, "save", interrupted)
    with pytest.raises(KeyboardInterrupt):
        tune_into(arm(), SETTINGS, out)
    assert not (out / "gains.json").exists()
    monkeypatch.setattr(state, "save", wrote)
    tune_into(arm(), SETTINGS, out, COMMAND)
    one, other = (json.loads((place / "gains.json").read_text(encoding="utf-8")) for place in (folder, out))
    assert one == other
    ends = load(folder / "state.npz"), load(out / "state.npz")
    assert ends[0] is not None
    assert ends[1] is not None
    np.testing.assert_array_equal(ends[0].costs, ends[1].costs)
    assert ends[0].simulations == ends[1].simulations
    one, other = (json.loads((place / "tune.json").read_text(encoding="utf-8")) for place in (folder, out))
    assert one["search"] == other["search"]
    assert one["search"]["generations_without_slopes"] == SETTINGS.finish


def test_a_sweep_uses_the_tuned_gains(folder: Path, tmp_path: Path) -> None:
    gains = read_gains(folder / "gains.json", arm())
    written = json.loads((folder / "gains.json").read_text(encoding="utf-8"))["gains"]
    tuned = gains.put(arm())
    names = list(written)
    np.testing.assert_array_equal(get_parameters(tuned, names), [written[name]["value"] for name in names])
    assert {name: written[name]["unit"] for name in names} == {name: parameters(tuned)[name].unit for name in names}
    one_step = {"seconds": SECONDS, "tuned": (gains,), "tolerance": None, **TRUE_STATE}
    settings = SweepSettings(("vsc3",), "payload", "supply", 2, (0.0, 30.0), (1.0,), **one_step)
    write_sweep(begun_sweep(arm(), settings), sweep_controllers(arm(), settings, progress=silent), tmp_path)
    record = json.loads((tmp_path / "sweep.json").read_text(encoding="utf-8"))
    assert "gains from a file" in record["between"]
    rows = loop_rows({}, np.radians([0.0, 30.0] * (ROWS // 2)))
    energy = record["controllers"]["vsc3"]["energy"]
    for controller, same in ((tuned, True), (CONTROLLERS["vsc3"].make(arm()), False)):
        own = closed_loops(LoopSetup(arm(), controller, "surface_slope", SECONDS), rows).merits.energy[:2]
        assert (energy == pytest.approx(np.asarray(own).tolist(), rel=1e-6)) is same


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("{", "not JSON"),
        ("[1]", "`controller` and `gains`"),
        ('{"controller": "pdi", "gains": {}}', "did you mean 'pid'"),
        ('{"controller": "pid", "gains": {"proportional": 1}}', "proportional_gain"),
        ('{"controller": "pid", "gains": {"proportional_gain": "much"}}', "must be a number"),
        ('{"controller": "pid", "gains": {"proportional_gain": {"value": 1, "unit": "V/deg"}}}', "V/rad"),
        ('{"controller": "pid", "gains": {"proportional_gain": -1}}', "outside of the bounds"),
        ('{"controller": "pid", "gains": {}, "format": "smajax gains 9"}', "smajax gains 1"),
    ],
)
def test_a_wrong_gains_file_is_an_error(text: str, told: str, tmp_path: Path) -> None:
    path = tmp_path / "gains.json"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(GainsFileError, match=r"gains file") as error:
        read_gains(path, arm())
    assert told in str(error.value)


def test_a_folder_that_holds_something_else_is_refused(folder: Path, tmp_path: Path) -> None:
    (tmp_path / "thesis.tex").write_text("mine")
    with pytest.raises(ValueError, match=r"something else \(thesis.tex\)"):
        tune_into(arm(), SETTINGS, tmp_path)
    assert [one.name for one in tmp_path.iterdir()] == ["thesis.tex"]
    with pytest.raises(ValueError, match=r"seconds: 3.0 there, 5.0 requested"):
        tune_into(arm(), dataclasses.replace(SETTINGS, seconds=5.0), folder)


def test_a_finished_tuning_is_reported_again_without_a_simulation(
    folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    out = tmp_path / "again"
    shutil.copytree(folder, out)
    mark = {"command": "tune", "asked": {"tuning": "vsc3"}, "files": sorted(FILES)}
    (out / MARK).write_text(json.dumps(mark))
    before = {one.name: one.read_bytes() for one in out.iterdir()}
    told = json.loads(before["tune.json"])

    def never(*_: object, **__: object) -> None:
        raise AssertionError("computed again")

    monkeypatch.setattr("smajax.control.tune.settings.TuneSettings", lambda *_, **__: SETTINGS)
    monkeypatch.setattr("smajax.control.tune.tuning_folder.tune", never)
    monkeypatch.setattr("smajax.core.runtime.prepare", lambda **_: None)  # JAX has begun already
    again = CliRunner().invoke(app, ["tune", "vsc3", "--out", str(out)])
    assert again.exit_code == (0 if told["limits_met"] else UNMET), again.output
    for sentence in (*told["conclusions"], *told["price"]):
        assert sentence in again.output
    for name, gain in told["gains"].items():
        row = next(line.split() for line in again.output.splitlines() if line.split()[:1] == [name])
        assert row[1:4] == [digits(gain["before"]), "->", digits(gain["after"])]
    assert {one.name: one.read_bytes() for one in out.iterdir() if one.name not in (MARK, LOCK)} == {
        name: content for name, content in before.items() if name != MARK
    }
    assert ended(arm(), SETTINGS, out) == told


@pytest.mark.parametrize("name", ["loops.csv", "tune.html", "gains.json", "tune.json"])
def test_a_tuning_with_a_lost_or_edited_file_is_computed_again(folder: Path, tmp_path: Path, name: str) -> None:
    out = tmp_path / "again"
    shutil.copytree(folder, out)
    if name == "gains.json":
        gains = json.loads((out / name).read_text())
        gains["gains"]["boundary"]["value"] *= 1.01
        (out / name).write_text(json.dumps(gains))
    elif name == "tune.json":
        (out / name).write_text('{"gains": [')
    else:
        (out / name).unlink()
    assert ended(arm(), SETTINGS, out) is None
    with pytest.raises(ValueError, match=r"seconds: 3.0 there, 5.0 requested"):
        ended(arm(), dataclasses.replace(SETTINGS, seconds=5.0), out)


def test_a_wrong_name_ends_the_command_with_2(tmp_path: Path) -> None:
    assert "did you mean 'pid'" in refused("tune", "pdi", "--out", tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_the_record_says_what_the_integration_leaves_with_the_tuned_gains(folder: Path) -> None:
    error = json.loads((folder / "tune.json").read_text(encoding="utf-8"))["integration_error"]
    assert 0.0 < error["largest_rms_over_stroke"] < 0.01
    assert error["outputs"]["position"]["largest"] >= error["outputs"]["position"]["rms"] > 0.0
    assert error["how"] in (folder / "tune.html").read_text(encoding="utf-8")
