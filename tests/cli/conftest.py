"""Pages without pictures, for tests that read numbers and words."""

from __future__ import annotations

import base64
from typing import Any

import pytest

from smajax.report import simulate_page

# One white pixel.
BLANK = base64.b64decode(
    "iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAYAAAAfFcSJAAAADUlEQVR4nGP4////fwAJ+wP9CNHoHgAAAABJRU5ErkJggg=="
)


@pytest.fixture
def drawn() -> None:
    """Pictures of a run are drawn: they took half of the time of these tests, most of which look at none."""


@pytest.fixture(autouse=True)
def blank_pictures(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> None:
    def blank(*_: Any, **__: Any) -> bytes:
        return BLANK

    if "drawn" not in request.fixturenames:
        monkeypatch.setattr(simulate_page, "picture_of", blank)
