"""Which steps are ticked, what the card of a tuning says, and what the last step exports."""

from __future__ import annotations

import json
import re
import subprocess
import sys
from pathlib import Path

import pytest
from starlette.testclient import TestClient

from smajax.app import jobs
from smajax.app.opened import opened
from tests.helpers.model_files import fitted_model

GAIN = {"before": 702.1927, "after": 1729.08, "unit": "V/m", "box": [9.14, 16500.0]}


def ticked(client: TestClient, step: str) -> list[str]:
    """The steps with a tick in the list, as the page of `step` has it."""
    text = client.get(f"/{step}").text
    marks = re.findall(r'<a href="/([a-z]+)[^>]*><span class="number" aria-hidden="true">(.)', text)
    return [name for name, mark in marks if mark == "✓"]


def fit(folder: Path) -> None:
    (folder / "report").mkdir()
    (folder / "report" / "report.html").write_text("<!doctype html>", encoding="utf-8")
    fitted_model().save(folder / "report" / "model.toml")


def tune(folder: Path, model: str) -> None:
    (folder / "tuned-pid").mkdir()
    (folder / "tuned-pid" / "tune.html").write_text("<!doctype html>", encoding="utf-8")
    record = {"controller": "pid", "headline": "The tuned gains settle.", "gains": {"proportional_gain": GAIN}}
    (folder / "tuned-pid" / "tune.json").write_text(json.dumps({**record, "model": model}), encoding="utf-8")
    (folder / "tuned-pid" / "gains.json").write_text("{}", encoding="utf-8")
    (folder / "tuned-pid" / "state.npz").write_bytes(b"")


def test_a_step_that_is_to_be_looked_at_has_its_tick_once_it_was_opened(folder: Path, client: TestClient) -> None:
    client.post("/logs", data={"use": ["first.csv", "second.csv", "third.csv"], "do": "draft"}, follow_redirects=False)
    assert ticked(client, "folder") == ["folder", "logs"]
    assert ticked(client, "columns") == ["folder", "logs", "columns"]
    assert ticked(client, "runs") == ["folder", "logs", "columns", "runs"]
    assert opened(folder) == {"columns", "runs"}
    hidden = folder / jobs.HIDDEN
    hidden.rename(folder / "kept")
    elsewhere = folder.parent / "elsewhere"
    elsewhere.mkdir()
    hidden.symlink_to(elsewhere)
    client.get("/bench")
    assert not list(elsewhere.iterdir())
    hidden.unlink()
    (folder / "kept").rename(hidden)
    fit(folder)  # by the command line: what was fitted was looked at, and the result was not
    assert ticked(client, "fit") == ["folder", "logs", "columns", "bench", "runs", "fit"]
    assert "result" in ticked(client, "result")


def test_the_card_of_a_tuning_says_what_was_tuned(folder: Path, drafted: TestClient) -> None:
    fit(folder)
    tune(folder, "report/model.toml")
    text = drafted.get("/tune").text
    assert "The tuned gains settle." in text
    cells = re.findall(r"<td[^>]*>([^<]*)</td>", text)
    assert cells[:4] == ["proportional gain", "702.2", "1729", "V/m"]


def test_a_model_and_a_controller_are_exported(
    folder: Path, drafted: TestClient, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(jobs, "PROGRAM", (sys.executable, "-S", "-c", "print('{}')"))

    def words(**form: str) -> tuple[tuple[str, ...], str]:
        answer = drafted.post("/download", data=form)
        assert answer.status_code == 200, re.findall(r'class="error lines">([^<]*)<', answer.text)
        job = jobs.last_job(folder)
        while job is not None and job.running:
            job = jobs.last_job(folder)
        assert job is not None
        assert job.command == "export"
        return job.words, job.out

    assert "Export" not in re.findall("<h2>(.*?)</h2>", drafted.get("/download").text)
    fit(folder)
    tune(folder, "report/model.toml")
    model = words(what="report/model.toml", to="fmu")
    assert model == (("report/model.toml", "--to", "fmu", "--overwrite"), "exported/report.fmu")
    gains = words(what="tuned-pid/gains.json", to="c", model="")
    own = ("tuned-pid/gains.json", "--to", "c", "--overwrite", "--model", "report/model.toml")
    assert gains == (own, "exported/tuned-pid_c")
    for wrong in ({"what": "../x", "to": "c"}, {"what": "report/model.toml", "to": "exe"}):
        assert drafted.post("/download", data=wrong).status_code == 422
    (folder / "exported" / "tuned-pid_c").mkdir(parents=True)
    (folder / "exported" / "tuned-pid_c" / "tuned_pid.c").write_text("int x;", encoding="utf-8")
    shown = drafted.get("/download").text
    assert "exported/tuned-pid_c/tuned_pid.c" in shown
    assert "state.npz" not in shown
    (folder / "tuned-pid" / "tune.json").write_text("{}", encoding="utf-8")  # of before the model was in it
    assert drafted.post("/download", data={"what": "tuned-pid/gains.json", "to": "c"}).status_code == 422


def test_the_last_step_is_shown_before_jax_is_loaded() -> None:
    """The names of a tuning's files come from a module of their own."""
    said = subprocess.run(
        [sys.executable, "-c", "import sys, smajax.app.pages.download; print('jax' in sys.modules)"],
        capture_output=True,
        text=True,
        check=True,
    )
    assert said.stdout.strip() == "False"
