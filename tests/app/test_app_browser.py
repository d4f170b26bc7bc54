"""The app in Chromium, with the server in a process of its own, on the demo's logs."""

from __future__ import annotations

import json
import os
import re
import signal
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from smajax.app.jobs import HIDDEN, last_job, stop
from smajax.app.project import EXPERIMENT, read_project
from smajax.data.experiment.schema import read_schema
from tests.helpers.command_line import DEMO
from tests.helpers.in_browser import WIDTHS

STEPS = ("folder", "logs", "columns", "bench", "runs", "fit", "result", "predict", "tune", "download")
PATIENCE = 600_000  # ms, for a machine that does other things


class App:
    """`smajax app` in a folder: its process and its address with the token."""

    def __init__(self, folder: Path) -> None:
        self.process = subprocess.Popen(
            [sys.executable, "-m", "smajax", "app", str(folder), "--no-open"], stdout=subprocess.PIPE, text=True
        )
        assert self.process.stdout is not None
        found = re.search(r"http://\S+", self.process.stdout.readline())
        assert found is not None
        self.address = found[0]
        self.base = self.address.split("/?")[0]

    def end(self, how: int = signal.SIGINT) -> None:
        self.process.send_signal(how)
        self.process.wait(timeout=60)
        if self.process.stdout is not None:
            self.process.stdout.close()


def tab(context: Any, wrong: list[str]) -> Any:
    page = context.new_page()
    page.set_default_timeout(PATIENCE)
    page.on("pageerror", lambda error: wrong.append(f"error: {error}"))
    page.on("console", lambda said: wrong.append(f"console: {said.text}") if said.type == "error" else None)
    return page


def shot(page: Any, name: str) -> None:
    if folder := os.environ.get("SMAJAX_SHOTS"):
        page.screenshot(path=Path(folder) / f"app-{name}.png", full_page=True)


def drawn(page: Any) -> None:
    """Every plot that is on the screen."""
    page.wait_for_function(
        "() => [...document.querySelectorAll('.plot')].every(p => p.querySelector('canvas') "
        "|| p.getBoundingClientRect().top > innerHeight || !p.offsetParent)"
    )


@pytest.fixture
def logs(tmp_path: Path) -> list[str]:
    bad = tmp_path / "bad.csv"
    bad.write_text("time_s,voltage_V\n0,1\n1\n2,x\n", encoding="utf-8")
    return [str(DEMO / f"{name}.csv") for name in ("steps", "triangle", "pulses")] + [str(bad)]


def no_wider(page: Any) -> None:
    """Than the window; waited for, since a page comes again by itself where another tab has changed the experiment."""
    page.wait_for_function("() => document.documentElement.scrollWidth <= innerWidth", timeout=5_000)


def test_logs_columns_bench_and_runs_from_the_keyboard_in_two_tabs(
    browser: Any, tmp_path: Path, logs: list[str]
) -> None:
    folder = tmp_path / "bench"
    folder.mkdir()
    app = App(folder)
    wrong: list[str] = []
    context = browser.new_context(viewport={"width": WIDTHS[1], "height": 900})
    try:
        page = tab(context, wrong)
        page.goto(app.address)
        assert "token" not in page.url
        page.get_by_role("link", name="Next: Logs").press("Enter")
        page.set_input_files("#upload input[type=file]", logs)
        page.locator("#e-files .error").wait_for()
        assert "bad.csv was not taken" in page.locator("#e-files").inner_text()
        assert sorted(one.name for one in (folder / "logs").iterdir()) == ["pulses.csv", "steps.csv", "triangle.csv"]
        assert [one for one in wrong if "422" not in one] == []  # the browser notes the answer to the bad file
        wrong.clear()
        drawn(page)
        shot(page, "logs")
        page.get_by_role("button", name="guess the columns").press("Enter")
        page.wait_for_url("**/columns")
        page.get_by_role("heading", name="position_mm").wait_for()  # once JAX is loaded
        other = tab(context, wrong)
        other.goto(f"{app.base}/columns")
        unit = page.locator("[name='channels.position.unit']")
        unit.fill("V")
        unit.press("Tab")
        page.locator("[id='e-channels.position'] .error").wait_for()
        assert read_schema(folder / EXPERIMENT).channels["position"].unit == "V"
        other.locator("[id='e-channels.position'] .error").wait_for()  # the other tab comes by itself
        assert other.locator("[name='channels.position.unit']").input_value() == "V"
        other.locator("[name='channels.position.unit']").fill("mm")
        other.keyboard.press("Tab")
        page.wait_for_function("() => document.getElementsByName('channels.position.unit')[0].value === 'mm'")
        assert page.locator(".error").count() == 0
        page.goto(f"{app.base}/runs")
        drawn(page)
        plot = page.locator(".run .plot").first
        plot.press("+")
        page.get_by_text("Only a part of this run").first.press("Enter")
        page.get_by_role("button", name="Take the part that the plot shows").first.press("Enter")
        page.get_by_text("Saved in experiment.toml").wait_for()
        run = read_schema(folder / EXPERIMENT).runs[0]
        assert (run.start, run.end) == ("15 s", "45 s")
        page.reload()
        assert page.locator(f"[name='runs.{run.name}.end']").input_value() == "45 s"
        for step in STEPS:
            page.goto(f"{app.base}/{step}")
            page.get_by_role("heading", level=1).wait_for()
            drawn(page)
            for width in WIDTHS:
                page.set_viewport_size({"width": width, "height": 900})
                shot(page, f"{step}-{width}")
                no_wider(page)
        assert wrong == []
    finally:
        context.close()
        app.end()
        stop(folder)  # of a test that failed: what runs outlives the server
    assert app.process.returncode in (0, 130, -signal.SIGINT)


@pytest.mark.slow
def test_the_whole_way_with_a_stop_and_a_killed_server(browser: Any, tmp_path: Path, logs: list[str]) -> None:
    folder = tmp_path / "bench"
    folder.mkdir()
    app = App(folder)
    wrong: list[str] = []
    context = browser.new_context(viewport={"width": WIDTHS[1], "height": 900})
    page = tab(context, wrong)

    def job_state() -> str:
        job = last_job(folder)
        return job.state if job else ""

    try:
        page.goto(f"{app.base}/logs?{app.address.split('?')[1]}")
        page.set_input_files("#upload input[type=file]", logs[:3])
        page.get_by_role("heading", name="logs/pulses.csv").wait_for()
        page.get_by_role("button", name="guess the columns").click()
        page.wait_for_url("**/columns")
        page.goto(f"{app.base}/bench")
        diameter = page.locator("[name='model.parameters.wire_diameter']")
        diameter.fill("0.31 mm")
        diameter.press("Tab")
        page.get_by_text("Saved in experiment.toml").wait_for()
        page.goto(f"{app.base}/fit")
        page.get_by_text("Which effects may be tried").click()
        page.get_by_label("only those that are ticked").check()
        page.get_by_label("latent heat of transformation").check()
        page.locator(".effects button").click()
        page.get_by_text("Which effects may be tried: 1 of").wait_for()
        assert read_schema(folder / EXPERIMENT).effects.only == ["latent_heat"]
        page.get_by_role("button", name="Start").click()
        page.get_by_role("heading", name="Best parameters so far").wait_for()  # live
        page.locator("#watching .plot canvas").first.wait_for()
        shot(page, "watch")
        page.get_by_role("button", name="Stop").click()
        page.get_by_text("Stopped", exact=True).wait_for()
        page.get_by_role("button", name="Resume").click()
        page.get_by_text("Running", exact=True).wait_for()
        app.end(signal.SIGKILL)
        page.get_by_text("The server does not answer").wait_for()
        assert job_state() in ("running", "finished")
        app = App(folder)
        page.goto(f"{app.base}/fit?{app.address.split('?')[1]}")
        page.get_by_role("link", name="Next: Result").click()
        page.get_by_role("heading", name="Verdict: explained").wait_for()
        shot(page, "result")
        assert json.loads((folder / "report" / "report.json").read_text(encoding="utf-8"))["verdict"] == "explained"
        with context.expect_page() as opened:
            page.get_by_role("link", name="Open the report").click()
        assert "latent heat" in opened.value.locator("body").inner_text()
        page.goto(f"{app.base}/predict")
        page.get_by_label("logs/pulses.csv").check()
        page.get_by_role("button", name="Predict").click()
        page.get_by_role("link", name="Open the prediction").wait_for()
        page.goto(f"{app.base}/tune")
        page.locator("[name=points]").fill("8")
        page.get_by_role("button", name="Tune").click()
        page.get_by_role("link", name="Open the tuning").wait_for()
        shot(page, "tune")
        page.goto(f"{app.base}/download")
        with page.expect_download() as got:
            page.get_by_role("link", name="model.toml", exact=True).first.click()
        assert got.value.suggested_filename == "model.toml"
        assert {one.command for one in read_project(folder, "").results} == {"close-loop", "predict", "tune"}
        assert (folder / HIDDEN).is_dir()
        assert [one for one in wrong if "ERR_CONNECTION" not in one and "Failed to fetch" not in one] == []
    finally:
        context.close()
        app.end()
        stop(folder)  # of a test that failed: what runs outlives the server
