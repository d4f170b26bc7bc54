"""The command line says what is wrong in one paragraph and exits with 2."""

from __future__ import annotations

import contextlib
import json
import os
import re
import signal
import subprocess
import sys
import warnings
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from rich.progress import Progress as Bars
from typer.testing import CliRunner

from smajax.cli import renamed
from smajax.cli.main import app, main
from smajax.cli.options import numbers, pairs, texts, understood
from smajax.cli.progress_display import VARIABLE, _TimeLeft, displayed
from smajax.cli.terminal import console
from smajax.control.compose import compose, with_values
from smajax.control.mismatch import MISMATCHES, variation_of
from smajax.control.tune.terms import TERMS
from smajax.core.parameters import parameter_values
from smajax.core.progress import Compiling, Event, Message, Progress, Stage, WarningMessage, as_progress, quiet
from smajax.engine import program
from smajax.model.presets import build
from tests.helpers.small_bench import Ended, smajax

DEMO = Path(__file__).parents[2] / "smajax" / "data" / "demo" / "latent"


def _run(*arguments: str, cwd: Path) -> Ended:
    """The command in a folder, without a process of its own, whose imports take longer than all that is tested here."""
    with contextlib.chdir(cwd):
        return smajax(*arguments)


def test_help_names_the_commands(tmp_path: Path) -> None:
    told = _run("--help", cwd=tmp_path)
    assert told.code == 0
    assert "close-loop" in told.out
    assert "demo" in told.out


def test_help_waits_for_nothing_heavy(tmp_path: Path) -> None:
    code = (
        "import sys\nfrom smajax.cli.main import app\ntry:\n    app(['--help'])\nexcept SystemExit:\n    pass\n"
        "print(sorted({'jax', 'numpy', 'matplotlib', 'pydantic', 'scipy', 'xarray'} & set(sys.modules)))"
    )
    told = subprocess.run([sys.executable, "-c", code], cwd=tmp_path, capture_output=True, text=True, timeout=60)
    assert told.stdout.strip().endswith("[]")


def test_effects_and_presets_are_listed_for_machines(tmp_path: Path) -> None:
    effects = json.loads(_run("effects", "--json", cwd=tmp_path).out)
    enthalpy = effects["latent_heat"]["parameters"]["latent_heat.enthalpy"]
    assert enthalpy["unit"] == "J/kg"
    assert effects["latent_heat"]["prior"] == {"class": "material", "odds": 0.1}
    assert {name: enthalpy["prior"][name] for name in ("base", "sigma", "unit", "of", "logarithmic")} == {
        "base": 0.0,
        "sigma": 2e4,
        "unit": "J/kg",
        "of": "",
        "logarithmic": False,
    }
    assert "data sheets" in enthalpy["prior"]["source"]
    assert effects["ambient_drift"]["parameters"]["ambient_drift.rate"]["prior"]["unit"] == "K per run"
    presets = json.loads(_run("presets", "--json", cwd=tmp_path).out)
    assert {"arm", "dead_weight", "bias_spring"} <= set(presets["loads"])
    assert presets["wire_sizes"].keys() == set(presets["wires"])
    assert presets["wire_sizes"]["niti_table_3_1"] == {
        "wire_diameter": {"value": 150e-6, "unit": "m"},
        "wire_length": {"value": 0.9, "unit": "m"},
    }
    told = _run("presets", cwd=tmp_path).out.splitlines()
    assert "  niti_table_3_1: diameter 0.15 mm, length 900 mm" in told
    lines = [next(line for line in told if line.startswith(f"  {drive}: ")) for drive in presets["drives"]]
    assert len({line.split(": ", 1)[1] for line in lines}) == len(lines)


def test_named_effects_and_those_of_an_equation_are_listed_alone(tmp_path: Path) -> None:
    told = json.loads(_run("effects", "latent_heat", "electrical", "--json", cwd=tmp_path).out)
    assert "latent_heat" in told
    assert {one["equation"] for name, one in told.items() if name != "latent_heat"} == {"electrical"}


def test_an_effect_is_listed_with_its_odds_and_widths(tmp_path: Path) -> None:
    told = _run("effects", "creep", "latent_heat", "sensor_offset", cwd=tmp_path).out
    assert "latent_heat  [heat; material, odds 0.1]" in told
    assert "      prior 0 ± 20000 J/kg; Elahinia 2004, Table 3.2, and NiTi data sheets: 24.2 kJ/kg" in told
    assert "      prior 5 s, times or over 4.5; " in told
    assert "      prior 0 ± 0.01 of the stroke; " in told
    misspelt = _run("effects", "latent_heats", cwd=tmp_path)
    assert misspelt.code == 2
    assert "did you mean 'latent_heat'?" in misspelt.said


def test_the_parameters_of_named_presets_are_all_listed(tmp_path: Path) -> None:
    """What the answer to a misspelt one sends to."""
    model = ("niti_table_3_1", "arm", "amplified_voltage")
    told = json.loads(_run("presets", *model, "--json", cwd=tmp_path).out)
    listed = {name: one["value"] for part in told.values() for name, one in part.items()}
    assert listed == pytest.approx(parameter_values(build(*model)))
    lines = _run("presets", *model, cwd=tmp_path).out.splitlines()
    assert any(line.split()[:3] == ["wire_length", "0.9", "m"] for line in lines)
    wrong = _run("presets", "arms", cwd=tmp_path)
    assert wrong.code == 2
    assert "no preset `arms`; did you mean 'arm'?" in wrong.said


def test_missing_experiment_file(tmp_path: Path) -> None:
    told = _run("close-loop", "nowhere.toml", "--out", "report", cwd=tmp_path)
    assert told.code == 2
    assert "nowhere.toml" in told.said
    assert "Traceback" not in told.said


def test_output_that_is_a_file(tmp_path: Path) -> None:
    (tmp_path / "report").write_text("mine")
    (tmp_path / "experiment.toml").write_text("title = 'x'")
    told = _run("close-loop", "experiment.toml", "--out", "report", cwd=tmp_path)
    assert told.code == 2
    assert "report" in told.said
    assert "Traceback" not in told.said
    assert (tmp_path / "report").read_text() == "mine"


def test_misspelt_parameter_is_named(tmp_path: Path) -> None:
    (tmp_path / "run.csv").write_text("t,v,x\n" + "\n".join(f"{k / 10},5,{k / 1e4}" for k in range(50)))
    (tmp_path / "experiment.toml").write_text(
        """
title = "typo"
[model]
wire = "flexinol_table_3_2"
load = "dead_weight"
drive = "voltage"
[unknown]
convection_coeficient = { low = "40 W/m^2/K", high = "400 W/m^2/K", start = "150 W/m^2/K" }
[sampling]
step = "100 ms"
[channels.voltage]
role = "input"
column = "v"
unit = "V"
[channels.position]
role = "output"
column = "x"
unit = "m"
noise = "0.1 mm"
[time]
column = "t"
unit = "s"
[[runs]]
name = "a"
role = "fit"
file = "run.csv"
"""
    )
    told = _run("close-loop", "experiment.toml", "--out", "report", cwd=tmp_path)
    assert told.code == 2
    assert "convection_coefficient" in told.said  # the nearest known name
    assert "Traceback" not in told.said


def test_ctrl_c_is_answered(tmp_path: Path) -> None:
    command = [
        sys.executable,
        "-c",
        "import signal; signal.signal(signal.SIGINT, signal.default_int_handler); from smajax.cli.main import main; main()",
        "demo",
        "--only",
        "complete",
        "--out",
        "out",
    ]
    # A shell that runs its tests in the background has them ignore Ctrl-C, and what they start as well.
    with subprocess.Popen(
        command,
        cwd=tmp_path,
        stderr=subprocess.PIPE,
        stdout=subprocess.DEVNULL,
        text=True,
        env={**os.environ, "SMAJAX_PROGRESS": "lines"},
    ) as run:
        assert run.stderr is not None
        assert "points of the box" in run.stderr.readline()  # the base fit has begun
        run.send_signal(signal.SIGINT)
        said = run.stderr.read()
    assert run.returncode == 130, said
    assert "Interrupted. Nothing was finished: the same command starts from the beginning." in said


@pytest.mark.parametrize("finished", [True, False])
def test_what_is_kept_is_said_only_where_something_is(tmp_path: Path, finished: bool) -> None:
    (tmp_path / "fits").mkdir()
    if finished:
        (tmp_path / "fits" / f"{'0f' * 16}.npz").write_text("")
    code = (
        "import pathlib, sys\nfrom smajax.cli.options import FITS\nfrom smajax.cli.terminal import resumable\n"
        "with resumable('Kept.', pathlib.Path(sys.argv[1]), FITS):\n    raise KeyboardInterrupt"
    )
    told = subprocess.run([sys.executable, "-c", code, str(tmp_path)], capture_output=True, text=True, check=False)
    assert told.returncode == 130
    assert ("Interrupted. Kept." in told.stderr) is finished


def test_ctrl_c_while_garbage_is_collected_ends_the_command() -> None:
    """What a callback of the collector raises is dropped by Python: Ctrl-C is given again until it is answered."""
    code = (
        "import gc, os, signal, time\nsignal.signal(signal.SIGINT, signal.default_int_handler)\n"
        "from smajax.cli.terminal import resumable\n"
        "def swallow(phase, info):\n    gc.callbacks.remove(swallow)\n    os.kill(os.getpid(), signal.SIGINT)\n"
        "    time.sleep(0.1)\n"
        "with resumable():\n    gc.callbacks.append(swallow)\n    gc.collect()\n    print('went on', flush=True)\n"
        "    time.sleep(20)"
    )
    told = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert "Exception ignored" in told.stderr
    assert told.stdout == "went on\n"
    assert told.returncode == 130
    assert "Interrupted." in told.stderr


def test_progress_is_silent_where_nobody_looks(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    for setting, told in (("", ""), ("lines", "fitting")):
        monkeypatch.setenv(VARIABLE, setting)
        with displayed(console()) as progress:
            progress(Stage("fitting", 0.0))
            progress(Message("one more thing"))
        said = capsys.readouterr().err
        assert told in said
        assert bool(said) is bool(told)


def test_how_to_see_progress_is_said_once_to_a_person_without_a_terminal(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.delenv(VARIABLE, raising=False)

    def said(hint: bool) -> str:
        with displayed(console(), hint) as progress:
            for share in (0.0, 1.0):
                progress(Stage("fitting", share))
        return capsys.readouterr().err

    assert said(True).count("SMAJAX_PROGRESS=lines") == 1
    assert said(False) == ""
    monkeypatch.setenv(VARIABLE, "none")
    assert said(True) == ""


def test_long_work_says_how_to_see_progress_and_for_a_machine_does_not(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv(VARIABLE, raising=False)
    words = ["figures", "M9", "--fast", "--out", str(tmp_path / "out")]
    for more, times in (([], 1), (["--json"], 0)):
        told = CliRunner().invoke(app, [*words, *more])
        assert told.exit_code == 0
        assert told.output.count("SMAJAX_PROGRESS=lines") == times
    assert json.loads(told.output)["M9"]["holds"]


class _AtOnce:
    """A timer that waits for nothing."""

    def __init__(self, seconds: float, function: Progress, args: tuple[Event]) -> None:
        self.start = lambda: function(*args)

    def cancel(self) -> None: ...


def test_a_stage_that_waits_for_a_compilation_says_so(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv(VARIABLE, "lines")
    monkeypatch.setattr("smajax.core.compiling.threading.Timer", _AtOnce)
    monkeypatch.setattr("smajax.engine.cache.folder", lambda: None)
    with displayed(console()) as progress:
        progress(Stage("fitting", 0.0))
        for power in (2, 3):  # programs that no other test has
            jax.jit(lambda x, power=power: jnp.sinc(x) ** power)(np.ones(7))
        progress(Stage("fitting", 1.0))
        progress(Stage("simulating", 0.0))
        # A program of our own, which is not looked for on the disk.
        program(lambda model, own: {"a": jnp.sinc(own["a"]) ** 5}, None, ("a",), engine="native")
    jax.jit(lambda x: jnp.sinc(x) ** 4)(np.ones(7))  # nobody looks any more
    said = [line.split("] ", 1)[1] for line in capsys.readouterr().err.splitlines() if line.startswith("[")]
    waits = "compiling, the first time only"
    assert said == ["fitting", waits, "simulating", waits]


def test_a_bar_says_that_a_program_is_compiled_and_until_when() -> None:
    waits = _TimeLeft()
    bar = Bars()
    bar.add_task("fitting", total=1.0, at=0.0)
    (task,) = bar.tasks
    assert waits.render(task).plain == ""
    waits.compiling = True
    assert waits.render(task).plain == "compiling, the first time only"
    bar.update(task.id, completed=1.0)
    assert waits.render(task).plain == ""


def test_a_warning_is_said_wherever_stderr_leads(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv(VARIABLE, "")
    with displayed(console()) as progress:
        progress(Stage("fitting", 0.0))
        progress(WarningMessage("check: is it in mm?"))
    assert capsys.readouterr().err == "warning: check: is it in mm?\n"


def test_a_callback_of_text_and_share_is_adapted_for_a_version_with_a_warning() -> None:
    calls: list[tuple[str, float]] = []

    def old(what: str, share: float) -> None:
        calls.append((what, share))

    with pytest.warns(DeprecationWarning, match="one event"):
        progress = as_progress(old)
    for event in (Stage("fitting", 0.5), Message("a sentence"), WarningMessage("is it in mm?"), Compiling(True)):
        progress(event)
    assert calls == [("fitting", 0.5), ("say: a sentence", 1.0), ("warn: is it in mm?", 1.0)]
    assert as_progress(quiet) is quiet
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert as_progress(progress) is progress


@pytest.mark.parametrize("command", ["simulate", "sweep", "tune", "identify", "close-loop", "figures", "bench"])
def test_every_option_that_takes_a_quantity_says_its_unit(command: str) -> None:
    """A plain number is asked for where it is a share of something alone."""
    told = " ".join(CliRunner().invoke(app, [command, "--help"]).output.split())
    assert re.findall(r"--([\w-]+) (?:<float>|FLOAT)", told) == ["tolerance"] * (command == "simulate")
    timed = {"simulate": 3, "sweep": 2, "tune": 2}.get(command, 0)
    assert len(re.findall(r"<s> (?:(?!--).)*without a unit in s", told.replace("--dt;", "dt;"))) == timed


@pytest.mark.parametrize("command", ["close-loop", "identify", "demo", "figures", "tune", "sweep", "simulate"])
def test_every_command_with_a_page_opens_it_on_the_same_word(command: str) -> None:
    told = " ".join(CliRunner().invoke(app, [command, "--help"], terminal_width=200).output.split())
    assert "--open / --no-open open the page in a browser when it is done [default: no-open]" in told


def test_a_page_is_opened_where_it_is_asked_for(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    opened: list[str] = []
    monkeypatch.setattr("webbrowser.open", opened.append)
    words = ["simulate", "--step", "1V:100ms", "--out", str(tmp_path / "out")]
    for more in ([], ["--no-open"], ["--open"]):
        assert CliRunner().invoke(app, [*words, *more]).exit_code == 0
        assert opened == [(tmp_path / "out" / "simulate.html").as_uri()] * (more == ["--open"])


def test_lists_and_pairs_of_numbers_take_units() -> None:
    np.testing.assert_allclose(
        numbers("--set-points", "-20,0.5 rad 10deg, 85", "deg"), [-20.0, np.degrees(0.5), 10.0, 85.0]
    )
    assert numbers("--gain-ratios", "50%,1") == (0.5, 1.0)
    limits = pairs(
        "--limits",
        ["settling_time=4000 ms,overshoot=2", "energy=0.02kJ peak_temperature=363.15K"],
        {name: term.unit for name, term in TERMS.items()},
        "overshoot=2deg",
    )
    assert limits == pytest.approx({"settling_time": 4.0, "overshoot": 2.0, "energy": 20.0, "peak_temperature": 90.0})
    told = texts("--variation", ["inertia=20%,", "damping = 0.35 payload=\N{PLUS-MINUS SIGN}5 %"])
    told |= {"convection_coefficient": "+-50%", "supply": "35%"}
    assert variation_of(told) == {"inertia": 0.2, "damping": 0.35, "supply": 0.35, "payload": 0.05, "convection": 0.5}


@pytest.mark.parametrize(
    ("typed", "unit", "told"),
    [
        ("6,5", "deg", "Set points: 6 and 5 deg."),
        ("-20,20,60", "deg", "Set points: -20, 20 and 60 deg."),
        ("1,5", "", "Set points: 1 and 5."),
        ("6, 5", "deg", ""),
        ("6.5 60deg", "deg", ""),
    ],
)
def test_a_comma_that_may_be_meant_for_a_point_is_told(typed: str, unit: str, told: str) -> None:
    assert understood("Set points", typed, numbers("--set-points", typed, unit or "1"), unit) == told


MAY_BE_WRONG = "What can differ between the plant and the controller's model: " + ", ".join(
    short if short == own else f"{short} ({own}{', in degC' if short == 'ambient' else ''})"
    for short, own in MISMATCHES.items()
)


def test_mismatches_have_the_same_words_in_every_command() -> None:
    found = set()
    for command in ("simulate", "sweep", "tune"):
        page = " ".join(CliRunner().invoke(app, [command, "--help"]).output.split())
        assert f"{MAY_BE_WRONG}. +20%" in page
        found.add(re.split(r" Example:| Options:", page[page.index(MAY_BE_WRONG) :])[0])
    assert len(found) == 1, found
    assert "1.2 times the value that the controller assumes (of 20 degC: 24 degC)" in found.pop()
    believed = compose("niti_table_3_1", "arm", "amplified_voltage", values={"ambient_temperature": "20 degC"})
    assert parameter_values(with_values(believed, {"ambient": "+20%"}))["ambient_temperature"] == pytest.approx(24.0)


@pytest.mark.parametrize(
    ("typed", "told"),
    [
        (
            "simulate --load dead_weight",
            "`load` is the second argument, without a name: smajax simulate niti_table_3_1 dead_weight",
        ),
        ("simulate --wire=mine --step 5V:1s", "`wire` is the first argument, without a name: smajax simulate mine"),
        (
            "simulate flexinol_table_3_2 --drive",
            "third argument, without a name: smajax simulate flexinol_table_3_2 arm DRIVE",
        ),
        ("tune --controller pid", "`controller` is an argument, without a name: smajax tune pid"),
        ("sweep --controller pid", "Possible options: --controllers"),
    ],
)
def test_an_argument_that_is_given_as_an_option_is_told_where_it_stands(typed: str, told: str) -> None:
    ended = CliRunner().invoke(app, typed.split())
    assert ended.exit_code == 2
    assert f"No such option: --{typed.partition('--')[2].split()[0].split('=')[0]}" in ended.output
    assert told in ended.output


def test_a_list_may_be_cut_short(tmp_path: Path) -> None:
    shell = f"{sys.executable} -m smajax effects | head -n 1; exit ${{PIPESTATUS[0]}}"
    told = subprocess.run(["bash", "-c", shell], cwd=tmp_path, capture_output=True, text=True, timeout=60, check=False)
    assert told.returncode == 0, told.stderr
    assert told.stdout.count("\n") == 1


@pytest.mark.parametrize(
    ("typed", "offered"),
    [
        ("tune v", ["vsc1", "vsc2", "vsc3"]),
        ("sweep --controllers pid,vsc1,vsc", ["pid,vsc1,vsc2", "pid,vsc1,vsc3"]),
        ("figures M1", [f"M{number}" for number in (1, *range(10, 20))]),
        ("simulate flexinol_table_3_2 dead", ["dead_weight"]),
        (
            "simulate flexinol_table_3_2 dead_weight voltage --set martensite_",
            ["martensite_start=", "martensite_finish="],
        ),
        ("sweep --over convection,a", ["convection,ambient"]),
        ("tune sld --variation inertia=0.2,c", ["inertia=0.2,convection="]),
        ("simulate --mismatch inertia=+20%,con", ["inertia=+20%,convection=", "inertia=+20%,convection_coefficient="]),
        ("tune sld --limits s", ["settling_time=", "steady_error="]),
        ("tune sld --objective w", ["worst"]),
        ("tune sld --by a", ["adam"]),
        ("demo --only l", ["latent"]),
        (
            f"identify {DEMO} --profile martensite_finish,a",
            ["martensite_finish,austenite_start", "martensite_finish,austenite_finish", "martensite_finish,all"],
        ),
        ("identify nowhere.toml --profile a", []),
    ],
)
def test_the_tab_key_offers_the_names_there_are(typed: str, offered: list[str]) -> None:
    words = f"smajax {typed}"
    asked = {"_SMAJAX_COMPLETE": "complete_bash", "COMP_WORDS": words, "COMP_CWORD": str(len(words.split()) - 1)}
    told = CliRunner().invoke(app, [], env=asked, prog_name="smajax")
    assert told.stdout.split() == offered, told.output


OLD = {("sweep", "--targets"): ("--set-points", "0.3"), ("", "robustness"): ("sweep", "0.4")}


@pytest.mark.parametrize(
    ("typed", "now", "told"),
    [
        ("sweep --targets 20,40 --out x", "sweep --set-points 20,40 --out x", ["--targets is --set-points now"]),
        ("robustness --targets=20", "sweep --set-points=20", ["robustness is sweep now", "--targets is --set-points"]),
        ("tune --targets 20", "tune --targets 20", []),  # of another command
        ("sweep --out robustness -- --targets", "sweep --out robustness -- --targets", []),
        ("--version", "--version", []),
    ],
)
def test_an_old_name_is_taken_for_the_new_one_and_told(typed: str, now: str, told: list[str]) -> None:
    found, said = renamed.with_new_names(typed.split(), OLD)
    assert found == now.split()
    assert [part in one for part, one in zip(told, said, strict=True)] == [True] * len(told)


def test_an_old_command_works_and_warns(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.setattr(
        "smajax.cli.main.with_new_names",
        lambda typed: renamed.with_new_names(typed, {("", "wires"): ("presets", "0.3")}),
    )
    monkeypatch.setattr("sys.argv", ["smajax", "wires"])
    with pytest.raises(SystemExit) as ended:
        main()
    out, err = capsys.readouterr()
    assert not ended.value.code
    assert "flexinol_table_3_2" in out
    assert err == "deprecated: wires is presets now; the old name goes in version 0.3\n"
