"""Every figure of the source in its fast setting: the claim has its state, and the picture can be drawn."""

from __future__ import annotations

import json
import math
import re
from collections import Counter
from pathlib import Path

import pytest
from matplotlib.figure import Figure

from smajax.report.drawing import UPRIGHT
from studies.source.catalogue import CHAPTERS, rows
from studies.source.row import Row, State
from studies.source.write import Drawn, as_markdown, as_page

# Claims that are not reached, for the source's own equations contradict them or the plant here differs: the row says why.
CONTRADICTED = {"C8", "C19"}
# Claims that hold not as the source words them, or with a value chosen for the one figure: the row says which, with numbers.
IN_PART = {"M5", "M12", "C2", "C9", "C10", "C12", "C16"}
ROWS = [row for chapter in CHAPTERS.values() for row in chapter]


# One controller of each kind, and of the rows of the dead weight the first, in every run of the tests; the others in `make test-all`.
OFTEN = {"C1", "C5", "C12", "C15"}
SELDOM = {row.name for row in ROWS if row.name[0] == "C"} - OFTEN | {"M12", "M13", "M14"}
MARKED = [pytest.param(row, id=row.name, marks=pytest.mark.slow if row.name in SELDOM else ()) for row in ROWS]


def expected(row: Row) -> State:
    if row.name in CONTRADICTED:
        return State.FAILS
    return State.IN_PART if row.name in IN_PART else State.HOLDS


@pytest.mark.parametrize("row", MARKED)
def test_the_claim_of_each_figure_has_its_state(row: Row) -> None:
    result = row.work(True)
    assert result.state is expected(row), f"{row.claim}: {result.found}; {result.numbers}"
    assert result.holds or result.caveat
    assert bool(result.in_part) == (result.state is State.IN_PART)
    assert all(math.isfinite(value) for value in result.numbers.values())
    figure = Figure(figsize=(9.0, 5.6))
    result.draw(figure)
    for axes in figure.axes:
        assert axes.get_ylabel(), f"{row.name}: an axis without a name"
    upright = Figure(figsize=(UPRIGHT, 5.6))
    result.draw(upright)
    assert upright.get_layout_engine() is not None
    assert {axes.get_subplotspec().get_gridspec().ncols for axes in upright.axes} == {1}, row.name  # type: ignore[union-attr]


def test_every_figure_of_chapter_three_has_a_row() -> None:
    assert [row.name for row in CHAPTERS["chapter3"]] == [f"M{k}" for k in range(1, 20)]


@pytest.mark.parametrize("chapter", sorted(CHAPTERS))
def test_the_figures_kept_in_studies_are_those_of_the_rows(chapter: str) -> None:
    """`smajax figures chapter3 --out studies/chapter3 --overwrite` writes them anew."""
    folder = Path(__file__).parents[2] / "studies" / chapter
    drawn = []
    for row in CHAPTERS[chapter]:
        kept = json.loads((folder / f"{row.name}.json").read_text(encoding="utf-8"))
        assert (kept["id"], kept["where"], kept["system"], kept["claim"]) == (
            row.name,
            row.where,
            row.system,
            row.claim,
        )
        assert kept["state"] == expected(row)
        assert bool(kept["in_part"]) == (kept["state"] == State.IN_PART)
        assert (folder / f"{row.name}.png").stat().st_size > 10_000
        drawn.append(Drawn(row, State(kept["state"]), kept["found"], kept["caveat"], kept["in_part"]))
    assert (folder / "README.md").read_text(encoding="utf-8") == as_markdown(drawn)
    page = as_page(drawn, folder)
    assert page.count("data:image/png;base64,") == len(drawn)
    assert "<script>" in page


def test_an_unknown_figure_is_answered_with_the_list() -> None:
    with pytest.raises(KeyError, match="M19"):
        rows("M99")


def test_the_page_of_parameters_is_that_of_the_presets() -> None:
    """Every number with its origin; `python -m studies.make_docs` writes it anew."""
    from studies.make_docs import OTHER, PAGE, page, page_of_controllers

    assert PAGE.read_text(encoding="utf-8") == page()
    assert OTHER.read_text(encoding="utf-8") == page_of_controllers()


def test_geometry_and_convergence_studies_hold_in_their_fast_setting() -> None:
    from studies.arm_geometry import main as geometry
    from studies.convergence import LIMITS
    from studies.convergence import main as convergence

    levers, strains, holds = geometry(fast=True)
    assert holds[abs(levers - 0.045).argmin(), abs(strains - 0.043).argmin()]
    assert not holds[:, 0].any(), "the printed eps_L reaches 85 degrees after all"
    for case, errors in convergence(fast=True).items():
        for which in (0, 1):
            at_default = errors[1][which]
            assert at_default < LIMITS[which], case
        order = math.log2(errors[0][1] / errors[2][1]) / 2.0
        assert 1.5 < order < 2.6, f"{case}: order {order}"


def test_the_page_of_claims_counts_the_three_states_and_names_each_claim_that_does_not_hold_whole() -> None:
    page = (Path(__file__).parents[2] / "docs" / "claims.md").read_text(encoding="utf-8")
    count = Counter(expected(row) for row in ROWS)
    assert (
        f"Of the source's {len(ROWS)} figures {count[State.HOLDS]} hold as the source words them, {count[State.IN_PART]} "
        f"[hold in part](#the-sources-figures) and {count[State.FAILS]} fail" in page
    )
    fail, _, part = page.partition("### The source's figures")[2].partition("### ")[0].partition("They hold in part")
    for state, text in ((State.FAILS, fail), (State.IN_PART, part)):
        assert set(re.findall(r"\[([MC]\d+)\]", text)) == {row.name for row in ROWS if expected(row) is state}
