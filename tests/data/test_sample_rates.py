"""Logs of different sample rates."""

from __future__ import annotations

from pathlib import Path

from smajax.data.experiment.draft import draft
from tests.helpers.small_bench import log


def test_logs_of_different_rates_are_said_in_one_line_with_the_rates(tmp_path: Path) -> None:
    logs = [log(tmp_path / f"{name}.csv", interval=step) for name, step in (("a", 0.05), ("b", 0.02), ("c", 0.0505))]
    told = draft(logs, tmp_path / "e.toml").messages
    assert [one for one in told if "rates" in one] == [
        "sampling: the logs have different rates, 50 Hz (b.csv) and 20 Hz (a.csv and c.csv): faster ones are averaged over a step of the fit's clock, "
        "and of slower ones it takes straight lines between the samples"
    ]
    assert not any("rates" in one for one in draft(logs[::2], tmp_path / "e.toml").messages)
    many = [log(tmp_path / f"{k}.csv", interval=0.02) for k in range(4)]
    assert any(
        "50 Hz (4 logs) and 20 Hz (a.csv)" in one for one in draft([logs[0], *many], tmp_path / "e.toml").messages
    )
