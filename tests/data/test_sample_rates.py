"""Logs of different sample rates."""

from __future__ import annotations

from pathlib import Path

import pytest

from smajax.data.experiment.draft import draft
from smajax.data.experiment.sample_rates import clock_step
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


@pytest.mark.parametrize(
    ("interval", "longest", "spread", "step", "why"),
    [
        (0.04, 32.0, 0.0, 0.04, "the logs' own interval"),
        (0.025, 50.0, 0.0, 0.025, "the logs' own interval"),
        (1.0 / 30.0, 60.0, 0.0, 0.0333333, "the logs' own interval"),
        (0.0499637, 60.0, 0.2, 0.05, "the logs' own interval"),
        (0.01, 60.0, 0.0, 0.05, "at the logs' own 0.01 s the longest would have more than 2,000 samples"),
        (0.04, 32.0, 3.0, 0.05, "the logs' own interval varies, and is 0.04 s mostly"),
    ],
)
def test_a_draft_keeps_the_interval_of_the_logs_where_that_makes_few_samples(
    interval: float, longest: float, spread: float, step: float, why: str
) -> None:
    assert clock_step(interval, longest, spread) == (step, why)


def test_a_draft_says_why_its_step_is_what_it_is(tmp_path: Path) -> None:
    for name, interval, count in (("a.csv", 0.04, 800), ("b.csv", 0.01, 6000)):
        rows = (f"{interval * n:.3f},{n % 7 / 2:.2f},{n % 11 / 10:.2f}" for n in range(count))
        (tmp_path / name).write_text("t [s],U [V],position [mm]\n" + "\n".join(rows) + "\n", encoding="utf-8")
    short = draft([tmp_path / "a.csv"], tmp_path / "e.toml")
    assert 'resampled: the logs\' own interval\nstep = "40 ms"' in short.text
    assert "sampling: every 0.04 s; the clock of the fit: 0.04 s, the logs' own interval (likely)" in short.messages
    long = draft([tmp_path / "b.csv"], tmp_path / "e.toml")
    assert (
        'resampled: at the logs\' own 0.01 s the longest would have more than 2,000 samples\nstep = "50 ms"'
        in long.text
    )
