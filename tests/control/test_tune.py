"""Tuning: its slopes are those of the cost, it improves a bad start, meets a limit, and goes on where it was stopped."""

from __future__ import annotations

import csv
import dataclasses
import json
import shutil
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import jax.numpy as jnp
import numpy as np
import pytest
from typer.testing import CliRunner

from smajax.cli.main import app
from smajax.cli.options import UNMET
from smajax.cli.result_folder import MARK
from smajax.control.closed_loop import simulate_closed_loop
from smajax.control.figures_of_merit import Merit, merit_by_set_point
from smajax.control.gain_search import regulation_cost
from smajax.control.gains_file import GainsFileError, read_gains
from smajax.control.presets import CONTROLLERS
from smajax.control.reference import resting
from smajax.control.sweep.batched_loops import LoopSetup, closed_loops
from smajax.control.sweep.grid import loop_rows
from smajax.control.sweep.run_sweep import SweepSettings, sweep_controllers
from smajax.control.tune import trust
from smajax.control.tune.cma_es import CmaEsState
from smajax.control.tune.evaluate import STEP, TuningProblem
from smajax.control.tune.moves import walk
from smajax.control.tune.multistart import Effort, MultistartState, begin, load, next_round
from smajax.control.tune.objective import Goal, rank, value_and_gradient
from smajax.control.tune.scenarios import between, held_out, tuned_on
from smajax.control.tune.settings import TuneSettings
from smajax.control.tune.terms import TERMS
from smajax.control.tune.tuning_folder import FILES, tune_in_folder
from smajax.core.display_units import digits
from smajax.core.parameters import get_parameters, parameters
from smajax.core.progress import Event
from smajax.model.rigs import arm
from smajax.model.system import System
from smajax.report.sweep_folder import write_sweep
from smajax.report.tune_folder import finished as ended
from smajax.report.tune_folder import write_tuning
from smajax.report.tune_page import met, price
from tests.helpers.in_browser import HOSTILE, faults

SECONDS, ROWS = 3.0, 10  # as the sweep of test_sweep.py: programs are compiled once
SCENARIOS = tuned_on([0.0, 30.0], {"damping": 0.2}, 0)
# The preset's loops swing on for a while, and a swing multiplies differences.
CALM = {"high_voltage": 9.0, "low_voltage": 3.0, "surface_slope": 3.0, "boundary": 1.0}
COMMAND = f"smajax tune --out {HOSTILE}"  # what somebody typed
SETTINGS = TuneSettings(
    "vsc3",
    (0.0, 30.0),
    {"damping": 0.2},
    limits={"overshoot": 0.1},
    tried=4,
    starts=2,
    rounds=4,
    finish=3,
    seconds=SECONDS,
    unseen=2,
)


def tune_into(system: System, settings: TuneSettings, out: Path, command: str = "") -> None:
    write_tuning(tune_in_folder(system, settings, out), out, command)


def silent(event: Event) -> None:
    """Progress that is shown to no one."""


@pytest.fixture(scope="module")
def surface() -> TuningProblem:
    return TuningProblem(CONTROLLERS["vsc3"], arm(), seconds=SECONDS, loops=16)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("tune") / "vsc3"
    tune_into(arm(), SETTINGS, out, COMMAND)
    return out


def slopes_are_those_of_differences(rig: TuningProblem, point: np.ndarray) -> None:
    step = 1e-6
    exact = rig.evaluate_gradients(point[None], SCENARIOS, 0.2)
    moved = np.concatenate([point + step * np.eye(len(point)), point - step * np.eye(len(point))])
    terms = rig.evaluate_gradients(moved, SCENARIOS, 0.2).terms
    ahead, behind = np.split(terms, 2)
    differences = np.moveaxis((ahead - behind) / (2.0 * step), 0, -1)
    scale = np.abs(differences).max(axis=(0, 2), keepdims=True) + 1e-3
    assert np.abs(differences).max() > 1.0
    np.testing.assert_allclose(exact.gradients[0] / scale, differences / scale, atol=2e-3)


def test_slopes_of_every_term_are_those_of_differences(surface: TuningProblem) -> None:
    slopes_are_those_of_differences(surface, surface.point(CALM))


@pytest.mark.slow
def test_slopes_of_a_controller_with_an_integral_are_those_of_differences() -> None:
    rig = TuningProblem(CONTROLLERS["pid"], arm(), seconds=SECONDS, loops=8 * 6)
    slopes_are_those_of_differences(rig, rig.before - 0.03)


def test_the_judged_terms_are_the_figures_of_merit(surface: TuningProblem) -> None:
    """The cost that is judged is the one of the searches in studies/gains, on the loops that a sweep runs."""
    seen = surface.evaluate(surface.before[None], SCENARIOS, STEP)
    rows = np.column_stack([SCENARIOS.rows, np.ones(SCENARIOS.size)])
    rows = rows[np.minimum(np.arange(ROWS), SCENARIOS.size - 1)]
    swept = closed_loops(LoopSetup(surface.system, surface.controller, surface.preset.main_gain, SECONDS), rows).merits
    for field in dataclasses.fields(swept):
        np.testing.assert_allclose(
            np.asarray(getattr(seen.merits, field.name))[0],
            getattr(swept, field.name)[: SCENARIOS.size],
            rtol=1e-6,
            atol=1e-7,
        )
    expected = np.asarray([float(regulation_cost(_one(swept, k), SECONDS)) for k in range(SCENARIOS.size)])
    assert Goal("worst").cost(seen.exact, SCENARIOS)[0] == pytest.approx(expected.max(), rel=1e-6)
    believed = expected[SCENARIOS.nominal].mean()
    assert Goal("nominal").cost(seen.exact, SCENARIOS)[0] == pytest.approx(believed, rel=1e-6)


def _one(merits: Merit, k: int) -> Merit:
    return dataclasses.replace(
        merits,
        **{field.name: np.asarray(getattr(merits, field.name))[k] for field in dataclasses.fields(merits)},
    )


@pytest.mark.parametrize("objective", ["nominal", "worst", "mean-variance"])
def test_the_slope_of_the_objective_is_that_of_differences(surface: TuningProblem, objective: str) -> None:
    """Through the augmented Lagrangian too: a limit with a multiplier."""
    goal = Goal(objective, limits={"overshoot": 0.5})
    seen = surface.evaluate_gradients(surface.point(CALM)[None], SCENARIOS, 0.2)
    given = (np.asarray([0.3]), np.full((1, SCENARIOS.size, 1), 0.7), np.asarray([4.0]))
    _, slope = value_and_gradient(goal, seen, SCENARIOS, *given)
    step = 1e-6
    for k in range(len(surface.names)):
        ends = [
            value_and_gradient(
                goal, seen._replace(terms=seen.terms + sign * step * seen.gradients[..., k]), SCENARIOS, *given
            )
            for sign in (1.0, -1.0)
        ]
        assert slope[0, k] == pytest.approx(float(ends[0][0][0] - ends[1][0][0]) / (2 * step), rel=1e-4, abs=1e-6)


@pytest.mark.parametrize("by", ["trust-region", "adam"])
def test_a_bad_start_is_improved(surface: TuningProblem, by: str) -> None:
    goal, effort = Goal("worst"), Effort(0, 1, 6, by=by)
    bad = surface.point({"high_voltage": 9.0, "low_voltage": 1.0, "surface_slope": 1.5, "boundary": 1.0})
    now = begin(surface, goal, SCENARIOS, effort, bad)
    while not now.ended:
        now = next_round(surface, goal, SCENARIOS, effort, now)
    first = now.costs[0, 0]
    assert now.best_rank[0] < 0.8 * first
    # What is kept is what is judged.
    again = surface.evaluate(now.best, SCENARIOS, STEP).exact
    assert rank(goal.cost(again, SCENARIOS), goal.excess(again))[0] == pytest.approx(now.best_rank[0], rel=1e-6)


def test_a_linear_program_finds_the_least_of_the_largest() -> None:
    """Two loops whose costs cross: max(1 + 2 d, 1.2 - d) is least at d = 0.2/3; a limit on the second moves it on."""
    scenarios = tuned_on([0.0, 1.0], {}, 0)
    terms, slopes = np.zeros((2, len(TERMS))), np.zeros((2, len(TERMS), 1))
    at = list(TERMS).index("settling_time")
    terms[:, at], slopes[:, at, 0] = (1.0, 1.2), (2.0, -1.0)
    centre = np.asarray([0.5])
    point, predicted = trust.step(Goal("worst"), terms, slopes, scenarios, centre, 0.3)
    assert point[0] - 0.5 == pytest.approx(0.2 / 3.0)
    assert predicted == pytest.approx(1.0 + 0.4 / 3.0)
    point, _ = trust.step(Goal("worst", limits={"settling_time": 1.1}), terms, slopes, scenarios, centre, 0.3)
    assert 0.05 - 1e-9 <= point[0] - 0.5 <= 0.1 + 1e-9
    point, _ = trust.step(Goal("worst"), terms, slopes, scenarios, centre, 0.01)
    assert point[0] - 0.5 == pytest.approx(0.01)


def test_a_limit_is_met(folder: Path) -> None:
    record = json.loads((folder / "tune.json").read_text(encoding="utf-8"))
    exceeded = record["checks"]["tuned on"]["limit_exceeded_by_share"]
    assert exceeded["before"] > 0.0, "the preset must not meet it, or the test says nothing"
    assert exceeded["after"] == 0.0
    assert record["checks"]["tuned on"]["after"]["overshoot"]["worst"] <= 0.1


def test_the_folder_is_whole(folder: Path) -> None:
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
    assert page.count('src="data:image/png') == 2
    assert page.count('srcset="data:image/png') == 1  # the same for a telephone
    record = json.loads((folder / "tune.json").read_text(encoding="utf-8"))["checks"]
    with (folder / "loops.csv").open(encoding="utf-8") as file:
        loops = list(csv.DictReader(file))
    assert len(loops) == 2 * sum(one["loops"] for one in record.values())
    for check, when in (("tuned on", "before"), ("beyond", "after")):
        errors = [float(one["steady_error [deg]"]) for one in loops if (one["check"], one["gains"]) == (check, when)]
        assert max(errors) == pytest.approx(record[check][when]["steady_error"]["worst"])


def test_a_share_of_the_airs_temperature_is_told_in_kelvins() -> None:
    told = TuneSettings("vsc3", (0.0,), {"damping": 0.2, "ambient": 0.2}).plants_sentence(20.0)
    assert "damping ±20 %, ambient ±4 K at once" in told


def test_moves_from_one_set_point_to_another_are_tried_and_told(folder: Path) -> None:
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
    loop = simulate_closed_loop(rig.system, gains, wanted, 0.005, every=2)
    (_, second) = merit_by_set_point(loop, rig.system)
    assert moves["after"]["overshoot_deg"][0] == pytest.approx(np.degrees(float(second.merit.overshoot)), abs=1e-6)
    told = " ".join(record["conclusions"])
    assert "one step from the start, cold and at rest" in told
    assert "In 1 move from one set point to another" in told
    assert "Slopes ended at a cost of" in told


def test_a_tuning_at_one_set_point_is_checked_at_another() -> None:
    for angle, other in ((20.0, 15.0), (-40.0, -35.0), (85.0, 80.0)):
        checks = held_out([angle], {}, 4, 0)
        assert np.degrees(checks["inside"].targets) == pytest.approx([other])
        told = dataclasses.replace(SETTINGS, set_points=(angle,), variation={}).held_out_sentence()
        assert told == "a set point 5° beside, the plant as believed"


def test_what_the_gains_cost_is_said_with_both_numbers() -> None:
    """Energy by less than half more, chatter four times as much, switches from none to three a second."""
    columns = list(TERMS)
    judged = np.ones((2, 3, len(columns)))
    judged[:, :, columns.index("energy")] = [[40.0], [50.0]]
    judged[:, :, columns.index("chatter")] = [[2.5], [10.0]]
    switches = np.asarray([[0.0, 0.0, 0.0], [2.0, 3.0, 4.0]])

    def tuned(after: int) -> Any:
        seen = SimpleNamespace(
            exact=judged[[0, after]], merits=SimpleNamespace(switches_per_second=switches[[0, after]])
        )
        return SimpleNamespace(checks={"tuned on": SimpleNamespace(seen=seen)})

    (said,) = price(tuned(1))
    assert (
        "chatter of the command from 2.5 to 10 V/s in the median loop; switches of the command from 0 to 3 a second"
        in said
    )
    assert "energy" not in said
    assert price(tuned(0)) == []


def test_a_limit_that_is_kept_by_never_arriving_is_said_to_be() -> None:
    settles, never = [2.0, 2.5], [np.inf, np.inf]

    def told(before: list[float], after: list[float], limits: dict[str, float]) -> str:
        seen = SimpleNamespace(merits=SimpleNamespace(settling_time=np.asarray([before, after])))
        found: Any = SimpleNamespace(settings=SimpleNamespace(limits=limits))
        check: Any = SimpleNamespace(scenarios=SimpleNamespace(size=2), seen=seen)
        return met(found, check, "tuned on")

    overshoot, both = {"overshoot": 0.1}, {"overshoot": 0.1, "settling_time": 4.0}
    plain = "Every limit is met in all 2 closed loops tuned on"
    assert told(settles, settles, overshoot) == f"{plain}."
    assert told(settles, settles, both) == f"{plain}."
    assert told(settles, never, overshoot).startswith(f"{plain}, but none of them settles (2 with the preset's gains)")
    assert "but only 1 of them settles (2 with" in told(settles, [2.0, np.inf], overshoot)
    assert "none of them settles (0 with" in told(never, never, overshoot)


def test_the_page_in_a_browser(folder: Path, browser: Any) -> None:
    assert faults(browser, folder / "tune.html") == []


@pytest.mark.parametrize(
    ("state", "count", "finished"),
    [(MultistartState, "round", 0), (MultistartState, "round", 2), (CmaEsState, "generations", 2)],
)
def test_a_tuning_goes_on_to_the_same_end(
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


def test_a_sweep_reads_the_gains(folder: Path, tmp_path: Path) -> None:
    gains = read_gains(folder / "gains.json", arm())
    written = json.loads((folder / "gains.json").read_text(encoding="utf-8"))["gains"]
    tuned = gains.put(arm())
    names = list(written)
    np.testing.assert_array_equal(get_parameters(tuned, names), [written[name]["value"] for name in names])
    assert {name: written[name]["unit"] for name in names} == {name: parameters(tuned)[name].unit for name in names}
    settings = SweepSettings(("vsc3",), "payload", "supply", 2, (0.0, 30.0), (1.0,), seconds=SECONDS, tuned=(gains,))
    write_sweep(arm(), settings, sweep_controllers(arm(), settings, progress=silent), tmp_path)
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
def test_a_wrong_gains_file_is_answered(text: str, told: str, tmp_path: Path) -> None:
    path = tmp_path / "gains.json"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(GainsFileError, match=r"gains file") as error:
        read_gains(path, arm())
    assert told in str(error.value)


@pytest.mark.parametrize(
    ("change", "told"),
    [
        ({"controller": "pdi"}, "did you mean 'pid'"),
        ({"set_points": (0.0, 200.0)}, "stops"),
        ({"set_points": (0.0, 0.0)}, "once"),
        ({"variation": {"inertai": 0.2}}, "did you mean 'inertia'"),
        ({"variation": {"inertia": 20.0}}, "share between 0 and 1"),
        ({"objective": "worts"}, "did you mean 'worst'"),
        ({"weights": {"overshot": 1.0}}, "did you mean 'overshoot'"),
        ({"weights": {"overshoot": 0.0}}, "one at least is more"),
        ({"limits": {"overshoot": -1.0}}, "more than 0"),
        ({"by": "adma"}, "did you mean 'adam'"),
        ({"finish": -1}, "none or more"),
        ({"period": 0.015}, "whole number"),
        ({"estimator": "kalman"}, "printed"),
        ({"start": {"boundary": 1.0}}, "surface_slope"),
        ({"seconds": 4.005}, "whole number of control periods"),
    ],
)
def test_wrong_settings_are_answered(change: dict[str, object], told: str) -> None:
    with pytest.raises(ValueError, match=r".") as error:
        dataclasses.replace(SETTINGS, **change).check(arm())  # type: ignore[arg-type]
    assert told in str(error.value)


def test_a_folder_that_holds_something_else_is_refused(folder: Path, tmp_path: Path) -> None:
    (tmp_path / "thesis.tex").write_text("mine")
    with pytest.raises(ValueError, match=r"something else \(thesis.tex\)"):
        tune_into(arm(), SETTINGS, tmp_path)
    assert [one.name for one in tmp_path.iterdir()] == ["thesis.tex"]
    with pytest.raises(ValueError, match=r"seconds: 3.0 there, 5.0 requested"):
        tune_into(arm(), dataclasses.replace(SETTINGS, seconds=5.0), folder)


def test_a_tuning_that_is_finished_is_told_again_without_a_loop(
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
    assert {one.name: one.read_bytes() for one in out.iterdir() if one.name != MARK} == {
        name: content for name, content in before.items() if name != MARK
    }
    assert ended(arm(), SETTINGS, out) == told


@pytest.mark.parametrize("name", ["loops.csv", "tune.html", "gains.json", "tune.json"])
def test_a_tuning_of_which_something_is_lost_or_edited_is_worked_out_again(
    folder: Path, tmp_path: Path, name: str
) -> None:
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
    command = [sys.executable, "-m", "smajax", "tune", "pdi", "--out", str(tmp_path / "out")]
    ended = subprocess.run(command, capture_output=True, text=True, check=False)
    assert ended.returncode == 2
    assert "did you mean 'pid'" in ended.stderr
    assert not (tmp_path / "out").exists()


def test_what_is_checked_was_not_tuned_on() -> None:
    varied = {"inertia": 0.2, "damping": 0.2}
    tuned = tuned_on([0.0, 30.0, 50.0], varied, 0)
    assert tuned.size == 3 * (1 + 4)
    assert int(tuned.nominal.sum()) == 3
    checks = held_out([0.0, 30.0, 50.0], varied, 8, 0)
    seen = {tuple(row) for row in tuned.rows}
    for check in checks.values():
        assert not seen & {tuple(row) for row in check.rows}
    assert np.abs(checks["inside"].rows[:, :2] - 1.0).max() <= 0.2
    assert between([30.0, 0.0, 50.0]) == [15.0, 40.0]
    assert tuned_on([0.0], dict.fromkeys(("inertia", "damping", "convection", "payload"), 0.1), 0).size == 17
