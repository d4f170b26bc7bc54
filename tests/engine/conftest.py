"""What the engine remembers in a process, for tests that ask what it says."""

from __future__ import annotations

import pytest

from smajax.engine import facade


@pytest.fixture(autouse=True)
def said_anew(monkeypatch: pytest.MonkeyPatch) -> None:
    """A warning that an earlier test has seen is given again."""
    monkeypatch.setattr(facade, "_said", set())
