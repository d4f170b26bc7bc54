"""The page of the source's figures in a browser."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from smajax.core.progress import quiet
from studies.source.catalogue import CHAPTERS
from studies.source.row import State
from studies.source.write import Drawn, as_page, draw, lying_in
from tests.helpers.in_browser import HOSTILE, faults


def test_pictures_of_figures_fit_a_narrow_window(browser: Any, tmp_path: Path) -> None:
    """Drawn here the panels stand below one another; a folder that an older version wrote has the wide picture alone."""
    (row,) = [row for row in CHAPTERS["chapter3"] if row.name == "M8"]
    page = tmp_path / "index.html"
    page.write_text(as_page(draw([row], tmp_path, True, quiet), tmp_path), encoding="utf-8")
    shown = browser.new_page(viewport={"width": 400, "height": 900})
    wider = "() => [...document.querySelectorAll('.scroll:has(img)')].map(box => box.scrollWidth - box.clientWidth)"
    shown.goto(page.as_uri())
    assert shown.evaluate(wider) == [0]
    (tmp_path / "M8.upright.png").unlink()
    page.write_text(as_page(lying_in(tmp_path), tmp_path), encoding="utf-8")
    shown.reload()
    assert shown.evaluate(wider)[0] > 100


def test_the_page_of_figures_has_no_fault_in_a_browser(browser: Any, tmp_path: Path) -> None:
    drawn = [Drawn(row, State.IN_PART, HOSTILE, HOSTILE, HOSTILE) for row in CHAPTERS["chapter3"][:4]]
    page = as_page(drawn, Path(__file__).parents[2] / "studies" / "chapter3")
    (tmp_path / "index.html").write_text(page, encoding="utf-8")
    assert faults(browser, tmp_path / "index.html") == []
