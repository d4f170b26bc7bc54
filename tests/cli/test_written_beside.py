"""Pages written beside the search are whole when it ends, however it ends, and in their order."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable

import pytest

from smajax.cli.written_beside import written_beside


def _pages(write: Callable[[str], object], *pages: str) -> None:
    with written_beside(write) as begin:
        for page in pages:
            begin(page)


def test_the_caller_goes_on_while_a_page_is_written_and_the_last_one_is_whole_at_the_end() -> None:
    written, going_on = [], threading.Event()

    def write(page: str) -> None:
        assert going_on.wait(10.0)
        written.append(page)

    def interrupted() -> None:
        with written_beside(write) as begin:
            begin("first")
            assert not written
            going_on.set()
            begin("second")
            assert written[0] == "first"
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        interrupted()
    assert written == ["first", "second"]


def test_what_cannot_be_written_is_raised_at_the_next_page_but_not_at_the_end() -> None:
    """There the page of the whole result follows, which says it where it still is so."""

    def write(page: str) -> None:
        raise OSError(page)

    with pytest.raises(OSError, match="first"):
        _pages(write, "first", "second")
    _pages(write, "first")


def test_how_long_the_page_before_took_is_said() -> None:
    with written_beside(lambda _: time.sleep(0.05)) as begin:
        assert begin("first") == 0.0
        assert begin("second") >= 0.05
