"""A command that was killed and resumed gives the undisturbed result (those that draw figures: tests/studies)."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.helpers.kills import COMMANDS, FAST, SLOW, kill_and_resume


@pytest.fixture(autouse=True, scope="module")
def programs_of_their_own(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """A program that is killed, or has no room, may leave half a compiled one behind: not where other tests read theirs."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("JAX_COMPILATION_CACHE_DIR", str(tmp_path_factory.mktemp("programs")))
        yield


@pytest.mark.parametrize(
    ("name", "kills"),
    [
        pytest.param(name, kills, marks=pytest.mark.slow)
        for name, kills in [("identify", FAST), *((name, SLOW) for name in COMMANDS)]
    ],
)
def test_a_killed_and_resumed_command_gives_the_undisturbed_result(tmp_path: Path, name: str, kills: int) -> None:
    kill_and_resume(tmp_path, name, kills)
