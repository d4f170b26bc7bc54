"""A long compilation is said to go on until it ends, whatever other threads compile meanwhile."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager

import pytest
from jax import monitoring

from smajax.core import compiling as compiling_module
from smajax.core.compiling import COMPILED, REQUESTED, compilations_reported, compiling
from smajax.core.progress import Compiling, Event

LONG, SHORT = 0.4, 0.02


@pytest.fixture
def said(monkeypatch: pytest.MonkeyPatch) -> list[bool]:
    monkeypatch.setattr(compiling_module, "PATIENCE", 0.1)
    return []


@contextmanager
def _by_jax() -> Iterator[None]:
    """What JAX records of a compilation."""
    monitoring.record_event(REQUESTED)
    yield
    monitoring.record_event_duration_secs(COMPILED, 1.0)


BY = {"engine": compiling, "jax": _by_jax}


def _watched(said: list[bool], threads: int, by: Callable[[], AbstractContextManager[None]]) -> None:
    """One compilation of `LONG`, and short ones by so many other threads while it goes on."""

    def heard(event: Event) -> None:
        assert isinstance(event, Compiling)
        said.append(event.active)

    def short() -> None:
        end = time.monotonic() + LONG / 2.0
        while time.monotonic() < end:
            with by():
                time.sleep(SHORT)

    with compilations_reported(heard):
        others = [threading.Thread(target=short) for _ in range(threads)]
        for one in others:
            one.start()
        with by():
            time.sleep(LONG)
        for one in others:
            one.join()


@pytest.mark.parametrize("threads", [0, 1, 3])
@pytest.mark.parametrize("by", sorted(BY))
def test_a_long_compilation_is_reported_once_and_its_end(said: list[bool], threads: int, by: str) -> None:
    _watched(said, threads, BY[by])
    assert said[-1] is False
    assert said.count(True) == 1
    # What ends meanwhile does not say that nothing is compiled.
    assert said.index(False, said.index(True)) == len(said) - 1


def test_what_is_quick_is_not_reported_and_nothing_is_heard_afterwards(said: list[bool]) -> None:
    with compilations_reported(lambda event: said.append(event == Compiling(True))), compiling():
        pass
    assert True not in said
    heard = len(said)
    with compiling():
        time.sleep(0.15)
    assert len(said) == heard
