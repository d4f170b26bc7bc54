"""How often Python looks for garbage: seldom in our commands, as the user has it elsewhere."""

from __future__ import annotations

import gc
from collections.abc import Iterator

import pytest

from smajax.core.runtime import RARELY, collect_rarely, prepare


@pytest.fixture
def users() -> Iterator[tuple[int, ...]]:
    before = gc.get_threshold()
    yield before
    gc.set_threshold(*before)


def test_commands_look_for_garbage_seldom_and_a_script_as_it_did(users: tuple[int, ...]) -> None:
    prepare()
    assert gc.get_threshold() == users
    collect_rarely()
    assert gc.get_threshold()[:2] == RARELY[:2]  # the third one is no longer used by Python 3.14
