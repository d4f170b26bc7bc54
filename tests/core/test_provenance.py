"""The commit that a result is made with."""

from __future__ import annotations

import os
import shutil
import subprocess
from pathlib import Path

import pytest

from smajax.core.provenance import git_state, provenance
from smajax.model.presets import build


@pytest.mark.skipif(shutil.which("git") is None, reason="no git here")
def test_the_state_of_a_repository_is_read_and_its_index_left_alone(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Were the index written, a command that is killed meanwhile would leave the user's repository locked."""

    def git(*words: str) -> None:
        who = ["-c", "user.name=n", "-c", "user.email=n@example.org"]
        subprocess.run(["git", *who, *words], cwd=tmp_path, check=True, capture_output=True)

    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("GIT_CEILING_DIRECTORIES", str(tmp_path.parent))
    for name in ("GIT_DIR", "GIT_INDEX_FILE", "GIT_WORK_TREE"):
        monkeypatch.delenv(name, raising=False)
    assert git_state() == ""
    git("init")
    (tmp_path / "log.csv").write_text("1")
    git("add", "log.csv")
    git("commit", "-m", "a log")
    commit = git_state()
    assert len(commit) == 40
    os.utime(tmp_path / "log.csv", (1e9, 1e9))  # the same content: a plain `git status` would refresh the index here
    before = (tmp_path / ".git" / "index").read_bytes()
    assert git_state() == commit
    assert (tmp_path / ".git" / "index").read_bytes() == before
    (tmp_path / "log.csv").write_text("2")
    assert git_state() == f"{commit}+changes"


def test_git_is_asked_once_for_all_results_of_a_process(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[str] = []

    def state() -> str:
        asked.append(str(Path.cwd()))
        return "a commit"

    monkeypatch.setattr("smajax.core.provenance.git_state", state)
    model = build("flexinol_table_3_2", "dead_weight", "voltage")
    monkeypatch.chdir(tmp_path)
    assert [provenance(model)["git"] for _ in range(3)] == ["a commit"] * 3
    assert len(asked) == 1
    (tmp_path / "other").mkdir()
    monkeypatch.chdir(tmp_path / "other")  # of another repository, as it may be
    provenance(model)
    assert len(asked) == 2
