"""Every view of the app as axe checks it: dark on a telephone, those with results and plots light at a desk too."""

from __future__ import annotations

import json
import shutil
import threading
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
import uvicorn
from starlette.testclient import TestClient

from smajax.app.server import bound, make_app
from tests.app.conftest import TOKEN
from tests.helpers.in_browser import WIDTHS
from tests.helpers.model_files import fitted_model

STEPS = ("folder", "logs", "columns", "bench", "runs", "fit", "result", "predict", "tune", "download")
RECORD = Path(__file__).parents[2] / "studies" / "bias_spring_bench" / "report.json"
SERIOUS = ("serious", "critical")


@pytest.fixture
def served(folder: Path, drafted: TestClient) -> Iterator[str]:
    """The app on a socket, with an experiment, a report, its model and a tuning in the folder: its address without the token."""
    report, tuned = folder / "report", folder / "tuned-pid"
    report.mkdir()
    shutil.copy(RECORD, report)
    (report / "report.html").write_text("<!doctype html>", encoding="utf-8")
    fitted_model().save(report / "model.toml")
    tuned.mkdir()
    (tuned / "tune.html").write_text("<!doctype html>", encoding="utf-8")
    (tuned / "state.npz").write_bytes(b"")
    (tuned / "tune.json").write_text(json.dumps({"controller": "pid", "gains": {}}), encoding="utf-8")
    listening = bound(0)
    server = uvicorn.Server(
        uvicorn.Config(make_app(folder, TOKEN), log_level="error", access_log=False, lifespan="off", ws="none")
    )
    thread = threading.Thread(target=server.run, kwargs={"sockets": [listening]})
    thread.start()
    yield f"http://127.0.0.1:{listening.getsockname()[1]}"
    server.should_exit = True
    thread.join()
    listening.close()


def serious(axe: Any, page: Any, what: str) -> list[str]:
    """Findings of axe from serious on, in sentences."""
    found = [one for one in axe.run(page).response["violations"] if one["impact"] in SERIOUS]
    return [f"{what}: {one['help']}: {node['html'][:120]}" for one in found for node in one["nodes"][:3]]


@pytest.mark.parametrize(
    ("scheme", "width", "steps"),
    [
        pytest.param("dark", WIDTHS[0], STEPS, marks=pytest.mark.slow, id="dark, on a telephone"),
        pytest.param("light", WIDTHS[1], ("runs", "result", "tune"), id="light, at a desk"),
    ],
)
def test_no_view_has_a_serious_finding(
    browser: Any, served: str, scheme: Any, width: int, steps: tuple[str, ...]
) -> None:
    axe = pytest.importorskip("axe_playwright_python.sync_playwright").Axe()
    context = browser.new_context(bypass_csp=True)
    wrong = []
    try:
        page = context.new_page()
        assert page.goto(f"{served}/?token={TOKEN}").ok
        page.emulate_media(color_scheme=scheme, reduced_motion="reduce")
        page.set_viewport_size({"width": width, "height": 900})
        for step in steps:
            assert page.goto(f"{served}/{step}").ok, step
            page.get_by_role("heading", level=1).wait_for()
            wrong += serious(axe, page, f"{step}, {scheme}, {width} px")
            assert page.evaluate("document.documentElement.scrollWidth <= innerWidth"), step
        assert page.goto(f"{served}/download").ok
        listed = page.locator("main").inner_text()
        assert "`" not in listed
        assert "tune.html" in listed
        assert "state.npz" not in listed  # which the command keeps for itself
        assert page.goto(f"{served}/tune").ok
        assert "pid" in page.locator("select[name=controller]").inner_text()
        assert wrong == []
        page.set_content("<p style='color: #aaa; background: #fff'>pale</p>")
        assert any("contrast" in one for one in serious(axe, page, "what it should find"))
    finally:
        context.close()
