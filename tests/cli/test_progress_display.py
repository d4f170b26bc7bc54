"""What a command says on stderr while it works."""

from __future__ import annotations

import json
import warnings
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from rich.progress import Progress as Bars
from typer.testing import CliRunner

from smajax.cli.main import app
from smajax.cli.progress_display import VARIABLE, _TimeLeft, displayed
from smajax.cli.terminal import console
from smajax.core.progress import Compiling, Event, Message, Progress, Stage, WarningMessage, as_progress, quiet
from smajax.data.experiment.errors import ExperimentError
from smajax.engine import program


def test_progress_is_silent_without_a_terminal(
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


def test_a_log_begins_with_the_command_before_its_libraries_are_loaded(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    words = ["predict", str(tmp_path / "none.toml"), str(tmp_path / "none.csv"), "--out", str(tmp_path / "out")]
    for setting, count in (("lines", 1), ("", 0), ("json", 0)):
        monkeypatch.setenv(VARIABLE, setting)
        ended = CliRunner().invoke(app, words)
        assert isinstance(ended.exception, ExperimentError)
        assert ended.output.count("predict: loading") == count
    monkeypatch.setenv(VARIABLE, "lines")
    assert "loading" not in CliRunner().invoke(app, ["predict", "--help"]).output


def test_the_hint_how_to_see_progress_is_given_once(
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


@pytest.mark.slow
def test_long_work_gives_the_hint_and_with_json_does_not(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
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


def test_a_stage_reports_that_it_waits_for_a_compilation(
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


def test_a_progress_bar_shows_that_a_program_is_compiled() -> None:
    waits = _TimeLeft()
    bar = Bars()
    bar.add_task("fitting", total=1.0, at=0.0)
    (task,) = bar.tasks
    assert waits.render(task).plain == ""
    waits.compiling = True
    assert waits.render(task).plain == "compiling, the first time only"
    bar.update(task.id, completed=1.0)
    assert waits.render(task).plain == ""


def test_a_warning_is_printed_wherever_stderr_leads(
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
