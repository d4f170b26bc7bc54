"""Programs as users have them, and what the engine remembers in a process."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from smajax.engine import facade
from smajax.engine.facade import _programs


@pytest.fixture(scope="module", autouse=True)
def as_users_have_it(optimised: None) -> None:
    """Machine code with LLVM's optimisation, of which other tests do without (tests/conftest.py)."""


@pytest.fixture(autouse=True)
def said_anew(monkeypatch: pytest.MonkeyPatch) -> None:
    """A warning that an earlier test has seen is given again."""
    monkeypatch.setattr(facade, "_said", set())


@pytest.fixture
def forgetful() -> Iterator[None]:
    """Nothing remembered of programs, before and after."""
    remembered = dict(_programs)
    _programs.clear()
    yield
    _programs.clear()
    _programs.update(remembered)
