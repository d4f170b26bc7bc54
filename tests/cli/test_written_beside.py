"""Pages written beside the search are whole when it ends, however it ends, and in their order."""

from __future__ import annotations

import os
import threading
import time
from collections.abc import Callable
from pathlib import Path

import pytest

from smajax.cli.written_beside import written_beside
from smajax.core import worker_process as module
from smajax.core.worker_process import VARIABLE, begin, worker_process
from tests.core.test_worker_process import PATIENCE, wait_for


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


def test_what_cannot_be_written_is_raised_once() -> None:
    written = []

    def write(page: str) -> None:
        if page == "first":
            raise OSError(page)
        written.append(page)

    with written_beside(write) as begin:
        begin("first")
        with pytest.raises(OSError, match="first"):
            begin("second")
        begin("third")
    assert written == ["third"]


def test_how_long_the_page_before_took_is_said() -> None:
    with written_beside(lambda _: time.sleep(0.05)) as begin:
        assert begin("first") == 0.0
        assert begin("second") >= 0.05


def page_of_a_process(known: str, folder: Path) -> None:
    (folder / known).write_text(str(os.getpid()), encoding="utf-8")


def _wait_for_page(page: Path) -> int:
    deadline = time.monotonic() + PATIENCE
    while not (page.is_file() and page.read_text(encoding="utf-8")):
        assert time.monotonic() < deadline
        time.sleep(0.01)
    return int(page.read_text(encoding="utf-8"))


@pytest.fixture
def second(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv(VARIABLE)
    monkeypatch.setattr(module, "available_cores", lambda: 2)


def test_a_page_is_written_by_the_second_process_where_that_is_asked_for(second: None, tmp_path: Path) -> None:
    with worker_process(), written_beside(page_of_a_process, tmp_path) as begin_page:
        begin_page("first", apart=True)
        assert _wait_for_page(tmp_path / "first") != os.getpid()
        assert begin_page("second") > 0.0
    assert _wait_for_page(tmp_path / "second") == os.getpid()
    with written_beside(page_of_a_process, tmp_path) as begin_page:  # there is none any more
        begin_page("third", apart=True)
    assert _wait_for_page(tmp_path / "third") == os.getpid()


def test_a_page_that_the_second_process_has_not_begun_is_written_here_if_no_other_follows(
    second: None, tmp_path: Path
) -> None:
    def interrupted() -> None:
        with written_beside(page_of_a_process, tmp_path) as begin_page:
            begin_page("last", apart=True)
            raise KeyboardInterrupt

    with worker_process():
        begin("long", time.sleep, (60.0,))
        wait_for("long")
        with written_beside(page_of_a_process, tmp_path) as begin_page:
            begin_page("superseded", apart=True)
            assert begin_page("second") == 0.0
            assert _wait_for_page(tmp_path / "second") == os.getpid()
            begin_page("superseded", apart=True)
        with pytest.raises(KeyboardInterrupt):
            interrupted()
    assert _wait_for_page(tmp_path / "last") == os.getpid()
    assert not (tmp_path / "superseded").exists()


def test_a_page_is_written_by_a_thread_where_the_second_process_has_ended_or_cannot_have_it(
    second: None, tmp_path: Path
) -> None:
    def local(known: str, folder: Path) -> None:
        page_of_a_process(known, folder)

    with worker_process():
        with written_beside(local, tmp_path) as begin_page:
            begin_page("local", apart=True)
            assert _wait_for_page(tmp_path / "local") == os.getpid()
        begin("long", time.sleep, (60.0,))
        wait_for("long")
        assert module._worker is not None
        module._worker._process.kill()
        assert module.taken("long") is None
        with written_beside(page_of_a_process, tmp_path) as begin_page:
            begin_page("ended", apart=True)
            assert _wait_for_page(tmp_path / "ended") == os.getpid()
