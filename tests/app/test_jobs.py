"""A command as the app runs it: its events, its end, stopping and resuming, and a server that is gone meanwhile."""

from __future__ import annotations

import json
import math
import signal
import sys
import time as clock
from collections.abc import Callable
from pathlib import Path

import pytest
from starlette.testclient import TestClient

from smajax.app import jobs
from smajax.app.watched import MOST_ERRORS, Watched, after, watched
from smajax.core.progress import BestFit, Compiling, Message, Stage, WarningMessage, event_record

# In the place of `smajax`: it writes events until it is told to end, by a file or by Ctrl-C.
COMMAND = """
import json, os, pathlib, sys, time
def say(**event): print(json.dumps({**event, "at": time.time()}), file=sys.stderr, flush=True)
try:
    say(event="Stage", name="fitting", share=0.25)
    done = pathlib.Path("count")
    pathlib.Path("new").write_text(str(int(done.read_text()) + 1 if done.exists() else 1))
    os.replace("new", done)  # whole at once: Ctrl-C comes as soon as it is there
    while not pathlib.Path("end").exists():
        time.sleep(0.01)
    if "bad" in sys.argv:
        print("Error: no such log", file=sys.stderr)
        sys.exit(2)
    print(json.dumps({"words": sys.argv[1:]}))
except KeyboardInterrupt:
    print("Interrupted.", file=sys.stderr)
    sys.exit(130)
"""


@pytest.fixture
def small(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    script = tmp_path / "command.py"
    script.write_text(COMMAND, encoding="utf-8")
    monkeypatch.setattr(jobs, "PROGRAM", (sys.executable, "-S", str(script)))
    return tmp_path


def until(what: Callable[[], object]) -> None:
    end = clock.monotonic() + 60.0  # of a machine that does other things
    while not what():
        assert clock.monotonic() < end
        clock.sleep(0.01)


def last(project: Path) -> jobs.Job:
    job = jobs.last_job(project)
    assert job is not None
    return job


def test_a_command_runs_beside_the_server_and_its_end_is_known(small: Path) -> None:
    job = jobs.start(small, "close-loop", ["experiment.toml"], "report", {"series": []})
    assert job.running
    with pytest.raises(jobs.JobError, match="something is running"):
        jobs.start(small, "identify", [], "identified", {})
    until(lambda: watched(small, job).stage == "fitting")
    assert watched(small, job).share == 0.25
    (small / "end").touch()
    until(lambda: last(small).state == "finished")
    assert jobs.output_of(small)["words"] == ["close-loop", "experiment.toml", "--out", "report", "--json"]


def test_stop_is_ctrl_c_and_the_same_command_resumes(small: Path) -> None:
    job = jobs.start(small, "close-loop", ["experiment.toml"], "report", {})
    until((small / "count").exists)
    assert jobs.stop(small)
    until(lambda: last(small).state == "stopped")
    assert last(small).code == jobs.INTERRUPTED
    assert watched(small, job).said == ("Interrupted.",)
    assert not jobs.stop(small)
    again = jobs.start(small, job.command, job.words, job.out, job.about)
    assert watched(small, again).said == ()
    (small / "end").touch()
    until(lambda: last(small).state == "finished")
    assert (small / "count").read_text(encoding="utf-8") == "2"


def test_what_a_server_in_the_background_starts_is_stopped_too(small: Path) -> None:
    """A shell that starts the server in the background has it ignore Ctrl-C, which a program inherits from what starts it."""
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        jobs.start(small, "close-loop", ["experiment.toml"], "report", {})
    finally:
        signal.signal(signal.SIGINT, before)
    until((small / "count").exists)
    assert jobs.stop(small)
    until(lambda: last(small).state == "stopped")


def test_an_error_of_the_command_is_shown_as_it_says_it(small: Path) -> None:
    job = jobs.start(small, "predict", ["bad"], "predicted", {})
    (small / "end").touch()
    until(lambda: last(small).state == "failed")
    assert watched(small, job).said == ("Error: no such log",)


def test_a_server_that_is_gone_takes_nothing_with_it(small: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(jobs, "_wait", lambda process, folder: process.wait())  # nobody writes down how it ended
    jobs.start(small, "close-loop", [], "report", {})
    assert last(small).running  # as another server finds it
    until((small / "count").exists)
    assert jobs.stop(small)
    until(lambda: not last(small).running)
    assert last(small).state == "ended"  # to be resumed
    (small / "end").touch()
    jobs.start(small, "close-loop", [], "report", {})
    until(lambda: not last(small).running)
    assert last(small).state == "finished"  # it left its result


def test_what_the_page_starts_stops_and_resumes(small: Path, folder: Path, drafted: TestClient) -> None:
    assert drafted.post("/fit", data={"do": "start", "out": "../x"}).status_code == 422
    assert drafted.post("/fit", data={"do": "start", "budget": "soon"}).status_code == 422
    assert drafted.post("/fit", data={"do": "start", "command": "close-loop", "budget": "2"}).status_code == 200
    job = last(folder)
    assert job.words == ("experiment.toml", "--budget", "120s")
    assert [one["run"] for one in job.about["series"]] == ["first", "second"]
    until((folder / "count").exists)
    until(lambda: "of this stage" in drafted.get("/watch/fit").text or "for 0 s" in drafted.get("/watch/fit").text)
    assert 'data-running="yes"' in drafted.get("/watch/fit").text
    assert "it ends" not in drafted.get("/predict").text
    drafted.post("/fit", data={"do": "stop"})
    until(lambda: last(folder).state == "stopped")
    assert "Resume" in drafted.get("/fit").text
    (folder / "end").touch()
    drafted.post("/fit", data={"do": "resume"})
    until(lambda: last(folder).state == "finished")
    assert "Finished" in drafted.get("/fit").text


def seen(*events: object) -> Watched:
    found = Watched()
    for number, event in enumerate(events):
        line = event if isinstance(event, str) else json.dumps({**(event_record(event) or {}), "at": 10.0 * number})  # type: ignore[arg-type]
        found = after(found, line)
    return found


def test_events_become_a_record_of_the_fit() -> None:
    found = seen(
        Stage("starting", 0.0),
        Stage("starting", 1.0),
        Stage("fitting", 0.0),
        Compiling(True),
        Message("round 1"),
        WarningMessage("odd"),
        Stage("fitting", 0.5),
        BestFit("fitting", {"h": 80.0}, {"h": "W/(m^2 K)"}, (1e-3, math.nan)),
        "Error: no room",
    )
    assert found.stages == ("starting",)
    assert found.compiling
    assert found.sentences == ((False, "round 1"), (True, "odd"))
    assert found.said == ("Error: no room",)
    assert found.seconds_left(70.0) == pytest.approx(40.0 - 10.0)
    assert found.parameters == {"h": 80.0}
    ((at, errors),) = found.errors
    assert (at, errors[0]) == (70.0, 1e-3)
    assert math.isnan(errors[1])


def test_between_two_stages_nothing_is_done_to_the_whole() -> None:
    """A stage that has ended is not the one that runs: what comes next is compiled, and has no share yet."""
    ended = seen(Stage("fitting", 0.0), Stage("fitting", 0.5), Stage("fitting", 1.0))
    assert ended.between
    assert ended.seconds_left(40.0) is None
    assert not seen(Stage("fitting", 0.5)).between
    assert not after(ended, json.dumps({"event": "Stage", "name": "checking", "share": 0.0, "at": 50.0})).between


def test_the_curve_of_the_errors_stays_short() -> None:
    found = Watched()
    for number in range(3 * MOST_ERRORS):
        line = json.dumps({**(event_record(BestFit("fit", {}, {}, (float(number),))) or {}), "at": float(number)})
        found = after(found, line)
    assert len(found.errors) <= MOST_ERRORS
    assert found.errors[0][0] == 0.0
    assert found.errors[-1][0] == 3 * MOST_ERRORS - 1
