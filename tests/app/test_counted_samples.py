"""Logs without a time in the app: the plots have the time that the file gives, and a new draft keeps it."""

from __future__ import annotations

from pathlib import Path

import tomlkit

from smajax.app.edit import carried_over
from smajax.app.plots import series
from smajax.data.readers.read import read_table


def test_a_plot_counts_samples_or_has_the_time_between_them(tmp_path: Path) -> None:
    """What it shows is written as the part of a run that is used, in s."""
    (tmp_path / "log.csv").write_text("position_mm\n0.0\n0.5\n0.2\n")
    table = read_table(tmp_path / "log.csv")
    counted = series(table, "position_mm", "mm")
    assert (counted["x"], counted["x_name"], counted["x_unit"]) == ([0.0, 1.0, 2.0], "sample", "")
    timed = series(table, "position_mm", "mm", 0.02)
    assert (timed["x"], timed["x_name"], timed["x_unit"]) == ([0.0, 0.02, 0.04], "time", "s")


def test_a_new_draft_has_the_time_between_samples_of_the_old_file() -> None:
    old = tomlkit.parse('[time]\nkind = "sample"\n[sampling]\nstep = "20 ms"\n')
    new = tomlkit.parse('[time]\nkind = "sample"\n')
    carried_over(old, new)
    assert new["sampling"]["step"] == "20 ms"


def test_a_time_that_was_left_out_stays_out_with_its_clock() -> None:
    old = tomlkit.parse('[time]\nkind = "sample"\n')
    new = tomlkit.parse('[time]\ncolumn = "t"\n[sampling]\nstep = "7 s"\n')
    carried_over(old, new)
    assert new["time"] == {"kind": "sample"}
    assert "sampling" not in new
