"""Every figure of the source in its fast setting: the claim holds, and the picture can be drawn."""

from __future__ import annotations

import math

import pytest
from matplotlib.figure import Figure

from smajax.figures.catalogue import CHAPTERS, rows
from smajax.figures.row import Row

ROWS = [row for chapter in CHAPTERS.values() for row in chapter]


@pytest.mark.parametrize("row", ROWS, ids=[row.name for row in ROWS])
def test_the_claim_holds(row: Row) -> None:
    result = row.work(True)
    assert result.holds, f"{row.claim}: {result.found}; {result.numbers}"
    assert all(math.isfinite(value) for value in result.numbers.values())
    figure = Figure(figsize=(9.0, 5.6))
    result.draw(figure)
    for axes in figure.axes:
        assert axes.get_ylabel(), f"{row.name}: an axis without a name"


def test_chapter_three_is_whole() -> None:
    assert [row.name for row in CHAPTERS["chapter3"]] == [f"M{k}" for k in range(1, 20)]


def test_an_unknown_figure_is_answered_with_the_list() -> None:
    with pytest.raises(KeyError, match="M19"):
        rows("M99")
