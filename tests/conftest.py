"""Shared by all tests: float64, and where the measured data are."""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from smajax.core.runtime import prepare
from tests.helpers.in_browser import FLAGS, NONE, chromium

prepare()


@pytest.fixture(scope="session")
def measured_data() -> Path:
    """Folder of measured data of real wires; the test skips, saying so, where there is none."""
    folder = Path(os.environ.get("SMAJAX_DATA", Path(__file__).parents[1] / ".." / "shared" / "data"))
    if not folder.is_dir():
        pytest.skip(f"no measured data at {folder}: set SMAJAX_DATA to the folder that holds them")
    return folder


@pytest.fixture
def browser() -> Iterator[Any]:
    """A headless Chromium with an empty profile; the test skips, saying so, where there is none."""
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
    """The whole loops first: begun last, one of them would keep a single worker busy when all else is done."""
    items.sort(key=lambda item: "test_close_loop" not in item.nodeid)
