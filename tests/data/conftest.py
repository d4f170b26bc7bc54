"""A folder with an experiment file and its logs."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.helpers.bench_experiment import BENCH, write_run


@pytest.fixture
def bench(tmp_path: Path) -> Path:
    folder = tmp_path / "bench"
    folder.mkdir()
    write_run(folder / "a.csv")
    write_run(folder / "b.csv", count=720, seed=1)
    (folder / "experiment.toml").write_text(BENCH)
    return folder
