"""Shared by all tests: float64, compiled programs shared by the workers of a run, and where the measured data are."""

from __future__ import annotations

import atexit
import gc
import io
import os
import shutil
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from tests.helpers.in_browser import FLAGS, NONE, chromium

# JAX and the package are imported where they are used: the process that hands tests to workers needs neither.

CACHE = "JAX_COMPILATION_CACHE_DIR"

# A compiled program is shared by the workers and the commands of one run, and by no other run. Set the variable to keep them.
if CACHE not in os.environ:
    os.environ[CACHE] = tempfile.mkdtemp(prefix="smajax-tests-")
    atexit.register(shutil.rmtree, os.environ[CACHE], ignore_errors=True)

# Most of the suite's time is compilation by XLA, of programs that run once for milliseconds: it does without LLVM's
# optimisation. Commands that a test starts inherit it. Every version of XLA knows this flag.
UNOPTIMISED = "--xla_backend_optimization_level=0"
if UNOPTIMISED.split("=")[0] not in os.environ.get("XLA_FLAGS", ""):
    os.environ["XLA_FLAGS"] = f"{os.environ.get('XLA_FLAGS', '')} {UNOPTIMISED}".strip()

# Machine code as well: LLVM's optimisation took a fifth of the time of all tests. Those of the engine have it (`optimised`).
UNOPTIMISED_LEVELS = {"codegen_level": 0, "speed_level": 0}
OPTIMISED_LEVELS: dict[str, int] = {}

# Each worker of the tests has a core of its own; a second process beside each would take the other's (`tests/core/test_worker_process.py` has one).
os.environ.setdefault("SMAJAX_WORKER", "none")

# Files that take longest, longest first (CPU time of a run without cached programs). A worker takes a whole file, in which the
# tests of a rig share traced and compiled programs; a long one begun last would keep one worker busy alone.
LONGEST = (
    "app/test_app_browser",
    "cli/test_cli_simulate",
    "simulation/test_integration_error",
    "fit/test_integration",
    "cli/test_faults_folder",
    "model/test_every_effect",
    "control/test_loops_on_loads",
    "fit/test_predict",
    "documentation/test_docs",
    "model/test_law_gradients",
    "control/test_estimators",
    "model/test_effects_material",
    "control/test_feedforward_pi",
    "simulation/test_compiled",
    "studies/test_figures",
    "documentation/test_notebooks",
    "control/",
    "fit/",
    "attribution/",
    "model/",
    "engine/",
    "simulation/",
)


def pytest_sessionstart(session: pytest.Session) -> None:
    """Of a process that runs tests, before the first array of JAX."""
    hands_out = session.config.getoption("numprocesses", None) and not hasattr(session.config, "workerinput")
    if hands_out:
        return
    keep_to_one_core(getattr(session.config, "workerinput", {}).get("workerid", ""))
    from smajax.core.runtime import prepare
    from smajax.engine import kernel

    prepare()
    OPTIMISED_LEVELS.update({name: kernel.COMPILE_OPTIONS[name] for name in UNOPTIMISED_LEVELS})
    kernel.COMPILE_OPTIONS.update(UNOPTIMISED_LEVELS)
    # Tracing makes millions of small objects that live: the collector looked at them again and again, a tenth of the time. Now it
    # looks at new ones alone; to look at all those that lived once took seconds each time.
    gc.set_threshold(100_000, 500, 50)


def keep_to_one_core(worker: str) -> None:
    """A worker (`gw0`, ...) by itself fills a core. With threads for all of them each worker's wait for cores that others use, a third of the time."""
    if not worker or not hasattr(os, "sched_setaffinity"):
        return
    cores = sorted(os.sched_getaffinity(0))
    os.sched_setaffinity(0, {cores[int(worker.removeprefix("gw")) % len(cores)]})


@pytest.fixture(scope="module")
def optimised() -> Iterator[None]:
    """Machine code as users have it, and no program that was compiled without optimisation."""
    from smajax.engine import kernel
    from smajax.engine.facade import _programs

    with pytest.MonkeyPatch.context() as patch:
        for name, level in OPTIMISED_LEVELS.items():
            patch.setitem(kernel.COMPILE_OPTIONS, name, level)
        remembered = dict(_programs)
        _programs.clear()
        yield
    _programs.clear()
    _programs.update(remembered)


@pytest.fixture(scope="session")
def measured_data() -> Path:
    """Folder of measured data of real wires; the test skips, saying so, where there is none."""
    folder = Path(os.environ.get("SMAJAX_DATA", Path(__file__).parents[1] / ".." / "shared" / "data"))
    if not folder.is_dir():
        pytest.skip(f"no measured data at {folder}: set SMAJAX_DATA to the folder that holds them")
    return folder


@pytest.fixture
def drawn() -> None:
    """Pictures are drawn in this test, in a file in which others do without (`blank_pictures`)."""


@pytest.fixture
def blank_pictures(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> None:
    """A page's pictures are blank, for tests of its words and numbers: to draw them took more than half of their time."""
    if {"drawn", "browser"} & set(request.fixturenames):
        return
    from matplotlib.figure import Figure
    from PIL import Image

    picture = io.BytesIO()
    Image.new("RGB", (2, 2), "white").save(picture, format="png")

    def savefig(_: Figure, stream: io.BytesIO, **__: Any) -> None:
        stream.write(picture.getvalue())

    monkeypatch.setattr(Figure, "savefig", savefig)
    # To make its axes takes as long as to draw them.
    monkeypatch.setattr("smajax.report.series_picture.as_picture", lambda *_, **__: picture.getvalue())


@pytest.fixture(scope="session")
def browser() -> Iterator[Any]:
    """A headless Chromium with an empty profile, which each page of its own context has too; skips where there is none."""
    playwright = pytest.importorskip(
        "playwright.sync_api", reason="playwright is not installed: pip install -e '.[dev]'"
    )
    found = chromium()
    if found is None:
        pytest.skip(NONE)
    with playwright.sync_playwright() as driver:
        running = driver.chromium.launch(executable_path=found, args=FLAGS)
        yield running
        running.close()


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """The longest files first."""
    items.sort(key=lambda item: next((n for n, name in enumerate(LONGEST) if name in item.nodeid), len(LONGEST)))
