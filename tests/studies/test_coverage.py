"""Intervals hold the truth as often as they say, on data that the package did not make."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from studies.coverage import run


@pytest.mark.slow  # two minutes; the kept study is tested always
def test_intervals_hold_the_truth_as_often_as_they_say() -> None:
    """Forty repeated experiments by scipy's integration: within what chance allows of 95 %."""
    found = run.study(fast=True)
    assert 0.88 <= found["coverage_of_all"] <= 0.995
    assert all(abs(one) < 0.7 for one in found["bias_in_standard_errors"].values())
    assert all(abs(one) < 2e-3 for one in found["without_noise_relative_error"].values())
    assert max(1.0 / share for share in found["scipy"]["cost_over_ours"]) < 1.0 + 1e-4


def test_the_kept_study_tells_what_its_page_tells() -> None:
    kept = json.loads((Path(run.HERE) / "coverage.json").read_text(encoding="utf-8"))
    assert run.page(kept) == (Path(run.HERE) / "README.md").read_text(encoding="utf-8")
    assert min(kept["coverage"].values()) >= 0.90
    assert max(kept["coverage"].values()) <= 0.99
    assert max(abs(one) for one in kept["without_noise_relative_error"].values()) < 1e-4
