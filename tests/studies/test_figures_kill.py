"""`smajax figures` that was killed and resumed gives the undisturbed figures."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.helpers.kills import FAST, kill_and_resume


def test_killed_and_resumed_figures_are_the_undisturbed_ones(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(
        "JAX_COMPILATION_CACHE_DIR", str(tmp_path / "programs")
    )  # one that is killed may leave half of one
    kill_and_resume(tmp_path, "figures", FAST)
