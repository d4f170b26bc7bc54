"""Gains in another loop: limit, filter and period of their file, another plant, the noise of a model file, set points out of reach."""

from __future__ import annotations

import dataclasses
import json
from pathlib import Path
from typing import Any
from unittest.mock import patch

import numpy as np
import pytest

from smajax.cli.commands.sweep import loop_of
from smajax.cli.plant_options import LoopPlants
from smajax.control.gains_file import Gains, GainsFileError, read_gains, write_gains
from smajax.control.loop_around import loop_around
from smajax.control.loop_dataset import SetPointWarning, simulate_loop_dataset
from smajax.control.loop_settings import LoopInUse, LoopSettings, joined
from smajax.control.model_as_plant import noise_of_file, plant_of, within_limit
from smajax.control.presets import CONTROLLERS
from smajax.control.reach import reach_of
from smajax.control.run_notes import InputLagLeftOut, gains_of_files
from smajax.control.run_request import LoopRequest, RunRequest, run_closed
from smajax.control.run_result import RunResult
from smajax.core.parameters import parameter_values
from smajax.data.model_file.of_presets import model_of_presets
from smajax.data.model_file.read import load_model
from smajax.data.model_file.record import ModelOutput, ModelParameter
from smajax.model.rigs import arm
from smajax.report.loop_words import limit_words, source_sentence, source_sentences
from smajax.report.note_words import note_sentences
from smajax.report.simulate_page import settings_rows
from tests.fit.test_predict import NOISE, kept_model
from tests.helpers.small_bench import refused, smajax

pytestmark = pytest.mark.usefixtures("blank_pictures")

GAINS: dict[str, Any] = {
    "format": "smajax gains 1",
    "controller": "pid",
    "gains": {"proportional_gain": 1200.0, "integral_gain": 200.0, "derivative_gain": 20.0, "unwinding_time": 0.5},
    "fixed": {"largest_voltage": {"value": 4.5, "unit": "V"}, "rate_filter": {"value": 0.05, "unit": "s"}},
    "loop": {"command_limit": {"value": 4.5, "unit": "V"}, "period": {"value": 0.02, "unit": "s"}, "delay_periods": 1},
}


@pytest.fixture
def gains(tmp_path: Path) -> Path:
    path = tmp_path / "gains.json"
    path.write_text(json.dumps(GAINS), encoding="utf-8")
    return path


def loop(gains: Path, **given: Any) -> RunResult:
    request = RunRequest(
        model=kept_model(volts=7.0),
        dt=0.01 if "loop" not in gains.read_text() else 0.02,
        values=given.pop("values", {}),
    )
    return run_closed(request, LoopRequest("", "5mm:1s", gains, noise=0.0, **given))


def test_a_loop_takes_limit_filter_and_period_of_the_gains_file_unless_an_option_says_otherwise(gains: Path) -> None:
    """On another model than the one of the gains, which was fitted to runs of up to 7 V."""
    own = loop(gains)
    assert own.loop is not None
    assert own.loop.command_limit == pytest.approx(4.5)
    assert (own.loop.period, own.loop.delay) == (0.02, 1)
    used = json.loads(own.data.attrs["gains"])
    assert (used["largest_voltage"], used["rate_filter"]) == (4.5, 0.05)
    assert float(own.data["voltage"].max()) == pytest.approx(4.5)
    (said,) = source_sentences(own.settings)
    assert said == (
        "As in the file of the gains of pid: the drive's limit of 4.5 V, a control period of 20 ms and a delay of 1 period, "
        "largest_voltage 4.5, rate_filter 0.05."
    )
    other = loop(gains, period=0.04, delay=0, values={"amplifier_limit": "9.6 V"})  # 6 V by its gain
    assert other.loop is not None
    assert other.loop.command_limit == pytest.approx(6.0)
    assert (other.loop.period, other.loop.delay) == (0.04, 0)
    assert float(other.data["voltage"].max()) > 4.6
    assert source_sentences(other.settings) == ("As in the file of the gains of pid: rate_filter 0.05.",)


def test_an_older_file_of_gains_is_read_and_what_it_means_is_said(gains: Path) -> None:
    older = {name: one for name, one in GAINS.items() if name not in ("fixed", "loop")}
    gains.write_text(json.dumps(older), encoding="utf-8")
    result = loop(gains)
    assert result.loop is not None
    assert result.loop.command_limit == pytest.approx(7.0)
    assert result.loop.period == 0.01
    assert "says neither limit, filter nor control period" in source_sentences(result.settings)[1]
    # The preset of the controller is scaled to a lower limit than the drive's, and the loop is that of no option.
    ends = "the controller's limit of 4.953 V (the drive's is 7 V), a control period of 10 ms, no delay and the true state without a filter."
    assert source_sentences(result.settings)[1].endswith(ends)


def test_plain_numbers_in_a_file_of_gains_are_said_on_an_arm_too(tmp_path: Path) -> None:
    """Its position is an angle: the units that were read with the file were taken for settings of its loop."""
    path = tmp_path / "gains.json"
    path.write_text('{"controller": "pid", "gains": {"proportional_gain": 10, "integral_gain": 4}}', encoding="utf-8")
    gains = read_gains(path, arm())
    own = LoopSettings(555.6, 0.01, 1, "adaptive", 0.0, position_unit="rad")
    (said,) = source_sentences(gains_of_files([gains], arm(), LoopSettings(), own, ["pid"]))
    assert said.startswith("The gains of pid are from a file that says neither limit, filter nor control period")
    assert "the controller's limit of 10 V (the drive's is 555.6 V)" in said
    result = run_closed(RunRequest(dt=0.01), LoopRequest("", "5deg:0.1s", path, noise=0.0))
    assert len([one for one in source_sentences(result.settings) if "says neither limit" in one]) == 1
    rewritten = json.loads(write_gains(path, gains, gains.units(arm()), {}).read_text(encoding="utf-8"))
    assert "loop" not in rewritten


def test_a_sweep_says_all_that_its_controllers_take_from_the_file_of_one_of_them() -> None:
    of_file = LoopSettings(555.6, 0.01, 0, "", 0.0, position_unit="rad")
    gains = Gains("pid", {"proportional_gain": 10.0}, {"largest_voltage": 10.0, "rate_filter": 0.02}, of_file)
    (said,) = source_sentences(gains_of_files([gains], arm(), LoopSettings(), of_file, ["pid", "sld"]))
    assert said == (
        "As in the file of the gains of pid, for all controllers of this sweep (pid and sld), which are compared in one loop: the drive's limit of 555.6 V, "
        "a control period of 10 ms, no delay and the true state without a filter, no noise (a controller's own limit holds where it is lower); "
        "--set amplifier_limit, --period, --delay, --estimator and --noise say another. "
        "For pid alone, as in its file: largest_voltage 10, rate_filter 0.02."
    )
    (said,) = source_sentences(gains_of_files([gains], arm(), LoopSettings(delay=1), of_file, ["pid"]))
    assert said == (
        "As in the file of the gains of pid: the controller's limit of 10 V (the drive's is 555.6 V), a control period of 10 ms and "
        "the true state without a filter, largest_voltage 10, rate_filter 0.02."
    )


@pytest.mark.parametrize(
    ("part", "entry", "said"),
    [
        ("loop", {"period": {"value": 0.0, "unit": "s"}}, "period must be a number, more than 0, not 0.0"),
        ("loop", {"period": {"value": 10.0, "unit": "ms"}}, "period is given in 'ms'; expected 's'"),
        ("loop", {"command_limit": "much"}, "command_limit must be a number"),
        ("loop", {"delay_periods": 0.5}, "delay_periods must be a whole number, 0 or more, not 0.5"),
        ("loop", {"filter": "kalman"}, "no filter 'kalman'"),
        ("loop", {"limit": 5.0}, "`loop` has no 'limit'"),
        ("loop", [], "`loop` must be a table"),
        ("fixed", {"rate_filter": {"value": 0.02, "unit": "ms"}}, "rate_filter is given in 'ms'; expected 's'"),
        ("fixed", {"rate": 0.02}, "pid has no fixed parameter 'rate'"),
        ("fixed", {"rate_filter": -1.0}, "outside of the bounds"),
    ],
)
def test_a_wrong_limit_filter_or_period_of_a_gains_file_is_an_error(
    gains: Path, part: str, entry: object, said: str
) -> None:
    gains.write_text(json.dumps({**GAINS, part: entry}), encoding="utf-8")
    with pytest.raises(GainsFileError, match=r"gains file") as error:
        read_gains(gains, kept_model().system)
    assert said in str(error.value)


def test_files_of_gains_that_differ_need_an_option_that_says_which() -> None:
    files = {"pid": LoopSettings(period=0.01), "sld": LoopSettings(period=0.02), "vsc1": LoopSettings()}
    with pytest.raises(
        ValueError, match=r"several values of period, 0.01 \(pid\) and 0.02 \(sld\): say which with --period"
    ):
        joined(files, LoopSettings())
    assert joined(files, LoopSettings(period=0.05)).period == 0.05
    assert joined({"vsc1": LoopSettings()}, LoopSettings()).period == 0.01


def test_a_sweep_is_on_a_filter_unless_options_or_a_file_say_the_true_state() -> None:
    assert loop_of((), LoopSettings()) == LoopInUse(delay=1, estimator="adaptive")
    assert loop_of((), LoopSettings(delay=0)) == LoopInUse(delay=0, estimator="adaptive")
    assert loop_of((), LoopSettings(estimator="")) == LoopInUse()
    assert loop_of((), LoopSettings(estimator="", delay=2)) == LoopInUse(delay=2)
    of_file = Gains("vsc3", {}, loop=LoopSettings(estimator="", period=0.02))
    assert loop_of((of_file,), LoopSettings()) == LoopInUse(period=0.02)
    assert loop_of((of_file,), LoopSettings(estimator="model")) == LoopInUse(None, 0.02, 1, "model")


def test_the_plant_may_be_another_model_than_the_controllers(tmp_path: Path, gains: Path) -> None:
    """The controller has its own model and limit; the plant has another heat capacity and an effect more."""
    heavier = kept_model(volts=7.0)
    heat = dataclasses.replace(heavier.parameters["specific_heat"], value=900.0)
    plant = dataclasses.replace(heavier, parameters={**heavier.parameters, "specific_heat": heat})
    there, same = loop(gains, plant=plant), loop(gains)
    assert [(one.name, one.assumed, one.true) for one in there.mismatches] == [("specific_heat", 500.0, 900.0)]
    assert same.mismatches == ()
    assert float(there.data["temperature"][25]) < float(same.data["temperature"][25]) - 5.0
    assert there.loop == same.loop
    path, model = plant.save(tmp_path / "plant.toml"), heavier.save(tmp_path / "model.toml")
    words: list[str | Path] = ["simulate", "--model", model, "--gains", gains, "--set-point", "5mm:1s", "--dt", "20ms"]
    arm = model_of_presets("niti_table_3_1", "arm", "amplified_voltage").save(tmp_path / "arm.toml")
    said = refused(*words, "--plant", arm, "--out", tmp_path / "out")
    assert "the plant has the load Arm (arm), and the controller's model the load DeadWeight" in said
    assert "--plant is for closed loops" in refused(
        "simulate", "--model", model, "--step", "5V:1s", "--plant", path, "--out", tmp_path / "out"
    )
    ended = smajax(*words, "--plant", path, "--out", tmp_path / "out", "--json")
    assert ended.code == 0, ended.said
    assert json.loads(ended.out)["mismatch"]["specific_heat"]["true"] == 900.0


def test_the_noise_is_that_of_the_model_file_unless_an_option_says_otherwise(gains: Path) -> None:
    request = RunRequest(model=kept_model(), dt=0.02, seconds=0.4)
    own = run_closed(request, LoopRequest("", "5mm:0.4s", gains))
    assert own.loop is not None
    assert own.loop.noise == NOISE
    assert source_sentences(own.settings)[0].startswith("The sensor has the noise of the model file, 0.1 mm (1 sigma)")
    assert "with 0.1 mm of noise" in own.data.attrs["between"]
    assert "without noise" in loop(gains).data.attrs["between"]
    other = run_closed(request, LoopRequest("", "5mm:0.4s", gains, noise="50 um"))
    assert other.loop is not None
    assert other.loop.noise == pytest.approx(5e-5)


def test_a_loop_reads_its_sensor_once_where_a_sample_of_the_fit_averages_several(tmp_path: Path) -> None:
    several = ModelOutput("position", "m", NOISE, False, None, 3e-4)
    kept = load_model(dataclasses.replace(kept_model(), outputs=(several,)).save(tmp_path / "model.toml"))
    assert kept.outputs == (several,)
    assert not kept.warnings
    source = noise_of_file(kept)
    assert source is not None
    assert source.noise == 3e-4
    assert source_sentence(source).startswith(
        "The sensor has the noise of the model file, 0.3 mm (1 sigma) of a single reading (a sample of its fit has 0.1 mm);"
    )


def test_of_two_limits_of_the_command_the_page_says_which_one_holds() -> None:
    drive = LoopSettings(command_limit=1000.0, command_unit="V")
    assert limit_words(drive) == "up to 1000 V"
    assert limit_words(drive, 8.7) == "up to 8.7 V, the limit of the controller; that of the drive is 1000 V"
    assert limit_words(drive, 2000.0) == "up to 1000 V, the limit of the drive; that of the controller is 2000 V"
    assert limit_words(drive, 1000.0) == "up to 1000 V"
    assert limit_words(LoopSettings(command_unit="A"), 2.0) == "up to 2 A"
    assert limit_words(LoopSettings()) == "no limit"


@pytest.mark.slow
def test_a_loop_without_a_file_of_gains_says_that_they_are_the_presets(gains: Path) -> None:
    request = RunRequest(model=kept_model(), dt=0.01, seconds=0.4)
    own = run_closed(request, LoopRequest("pid", "5mm:0.4s", noise=0.0))
    said = "the gains are those of the preset of pid, scaled from the arm to this load's stroke, force and time"
    assert [said in one for one in source_sentences(own.settings)] == [False, True]
    (limit,) = [row[1] for row in settings_rows(own) if row[0] == "limit of the command"]
    used = json.loads(own.data.attrs["gains"])["largest_voltage"]
    assert limit.startswith(f"up to {min(used, 5.0):.4g} V")
    assert not any("preset" in one for one in source_sentences(loop(gains).settings))
    arm = run_closed(RunRequest(dt=0.01, seconds=0.1), LoopRequest("pid", "40deg:0.1s"))
    assert "those of the preset of pid, and not tuned" in source_sentences(arm.settings)[0]
    assert settings_rows(arm)[0][1].startswith("up to 10 V, the limit of the controller; that of the drive is 5")


def test_a_set_point_out_of_reach_is_told_apart_from_a_controller_that_fails(tmp_path: Path, gains: Path) -> None:
    """3.5 V hold this wire within its transformation; a weak controller is no matter of reach."""
    kept = kept_model()
    request = RunRequest(model=kept, dt=0.02, values={"amplifier_limit": "5.6 V"})
    (note,) = note_sentences(run_closed(request, LoopRequest("", "20mm:6s", gains, noise=0.0)).notes)
    assert note.startswith(
        "The set point 20 mm is out of reach of every controller: with up to 3.5 V this load comes to rest between 0 and"
    )
    assert "a higher limit of the command" in note
    weak = {**GAINS, "gains": {**GAINS["gains"], "proportional_gain": 1.0, "integral_gain": 1.0}}
    gains.write_text(json.dumps(weak), encoding="utf-8")
    lazy = run_closed(RunRequest(model=kept, dt=0.02), LoopRequest("", "5mm:6s", gains, noise=0.0))
    assert not np.isfinite(lazy.merit["settling_time"])
    assert lazy.notes == ()
    tune: list[str | Path] = ["tune", "pid", "--model", kept.save(tmp_path / "m.toml"), "--out", tmp_path / "out"]
    said = refused(*tune, "--set", "amplifier_limit=5.6 V", "--set-point", "5mm,20mm")
    assert "The set point 20 mm is out of reach of every controller" in said
    assert not (tmp_path / "out").exists()


def test_an_arm_is_led_and_tuned_with_the_limit_of_its_amplifier(tmp_path: Path) -> None:
    """An arm that needs more than the 10 V of the presets: the limit of its runs, of --set and of --start is that of the controller."""
    plain = model_of_presets("niti_table_3_1", "arm", "voltage")  # without the amplifier of the source's arm
    kept = dataclasses.replace(plain, fitted_range={"voltage": (0.0, 17.0)})
    system, _ = plant_of(kept)
    reach = reach_of(system, CONTROLLERS["pid"].make(system))
    assert reach is not None
    assert reach.command == 17.0
    gains = tmp_path / "gains.json"
    gains.write_text(json.dumps({**GAINS, "fixed": {"largest_voltage": 6.0}, "loop": {}}), encoding="utf-8")
    tune: list[str | Path] = ["tune", "pid", "--model", kept.save(tmp_path / "m.toml"), "--set-point", "-20deg,60deg"]
    said = refused(*tune, "--start", gains, "--out", tmp_path / "out")
    assert "with up to 6 V this load comes to rest" in said
    assert "(--set amplifier_limit=... or largest_voltage of the gains file (--gains, --start))" in said
    said = refused(*tune, "--start", gains, "--set", "amplifier_limit=7V", "--out", tmp_path / "out")
    assert "with up to 7 V" in said  # --set goes first
    assert "(--set amplifier_limit=...)" in said
    # Of the default set points, which nobody typed, those out of reach are left out.
    with patch("smajax.control.tune.tuning_folder.tune_in_folder", side_effect=ValueError("tuning")) as begun:
        said = refused(*tune[:4], "--set", "amplifier_limit=13V", "--out", tmp_path / "out")
    assert "Of the default set points" in said
    assert "20, 40, 60, 85 deg are left out: with up to 13 V this load comes to rest between -45 and" in said
    points = begun.call_args.args[1].set_points
    assert points == (-40.0, -20.0, 0.0, 20.0, 40.0, 60.0, 85.0)[: len(points)]
    assert 0 < len(points) < 7
    weak = RunRequest(model=kept, dt=0.01, seconds=0.1, values={"amplifier_limit": "14 V"})
    run = run_closed(weak, LoopRequest("", "40deg:0.1s", gains, noise=0.0))
    assert json.loads(run.data.attrs["gains"])["largest_voltage"] == 14.0


def test_a_loop_around_a_model_is_without_the_delay_of_its_logs_and_says_the_option(tmp_path: Path) -> None:
    """With a model of which a delay of the recorded input was fitted: the loop is that of the model without it."""
    kept = kept_model(volts=7.0)
    late = dataclasses.replace(
        kept,
        effects=("input_delay", "input_clock"),
        likely=tuple(dataclasses.replace(one, effects=("input_delay", "input_clock")) for one in kept.likely),
        parameters={
            **kept.parameters,
            "input_delay.delay": ModelParameter(0.0185, "fitted", -0.5, 2.0),
            "input_clock.rate": ModelParameter(1e-4, "fitted", -0.05, 0.05),
        },
    )
    request = LoopRequest("pid", "5mm:0.2s", noise=0.0)
    own, without = (run_closed(RunRequest(model=one, dt=0.01), request) for one in (late, kept))
    np.testing.assert_array_equal(own.data["position"], without.data["position"])
    said = source_sentences(own.settings)
    (delay,) = [one for one in said if "input_delay" in one]
    assert delay.startswith(
        "The model's input_delay of 18.5 ms is of its logs, and left out of the loop. Where commands"
    )
    assert delay.endswith("give the loop its delay in control periods: --delay 2 at 10 ms each.")
    assert any(one.startswith("The model's input_clock is of the clocks of its logs") for one in said)
    early = source_sentence(InputLagLeftOut("input_delay", -0.0185))
    assert early.endswith(
        "-18.5 ms is of its logs, and left out of the loop: below zero it is a clock of the logs, and no delay of the bench."
    )
    file = late.save(tmp_path / "late.toml")
    options = LoopPlants(model=file, plant=late.save(tmp_path / "plant.toml"))
    plants = options.plants(0, others=False)
    assert isinstance(plants, dict)
    assert not any("input_" in name for name in plants)
    drawn = within_limit(late, late.plants(2))
    assert drawn.effects == options.bare().effects == options.system().effects == ()
    with pytest.raises(
        ValueError, match=r"leave the effect's values out of --set and --mismatch .*\(--delay, `delay=`\)"
    ):
        run_closed(
            RunRequest(model=kept, dt=0.01), dataclasses.replace(request, mismatch={"input_delay.delay": "20ms"})
        )


def test_a_file_of_gains_may_be_named_by_text(tmp_path: Path) -> None:
    """It was taken for gains, letter by letter."""
    plant = arm()
    own = parameter_values(loop_around(plant, "pid").controller)
    gains = Gains("pid", {name: 0.5 * own[name] for name in CONTROLLERS["pid"].box})
    path = write_gains(tmp_path / "gains.json", gains, gains.units(plant), {})
    by_text, by_path = (loop_around(plant, "pid", one).controller for one in (str(path), path))
    assert parameter_values(by_text) == parameter_values(by_path) != own


@pytest.mark.parametrize("set_point", [60, "120 deg"])
def test_a_set_point_beyond_the_end_stops_is_said(set_point: float | str) -> None:
    loop = loop_around(arm(), "pid")
    with pytest.warns(
        SetPointWarning, match=r"rad, and the load between its end stops from -0.7854 to 1.658 rad: a number is in rad"
    ):
        simulate_loop_dataset(loop, set_point, seconds=0.05, dt=0.01)
