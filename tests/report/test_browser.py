"""Pages in a browser: whole, readable on a telephone and on a desk, asking nobody for anything; and each fault is seen.

Those of `identify`, `sweep` and `tune` are looked at where they are made: test_identify, test_sweep, test_tuning_folder; of figures: test_figures_page.
"""

from __future__ import annotations

import dataclasses
import io
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from smajax.control.run_request import LoopRequest, RunRequest, run_closed
from smajax.report.plain_page import table, whole
from smajax.report.simulate_page import write_run
from smajax.report.write import write_report
from tests.helpers.in_browser import HOSTILE, faults
from tests.helpers.made_findings import made_findings
from tests.helpers.often import often


def test_the_report_has_no_fault_in_a_browser(browser: Any, tmp_path: Path) -> None:
    found = made_findings()
    names = ("step", HOSTILE, "sine")
    runs = tuple(dataclasses.replace(run, name=name) for run, name in zip(found.runs, names, strict=True))
    assert faults(browser, write_report(dataclasses.replace(found, title=HOSTILE, runs=runs), tmp_path)) == []


@pytest.mark.slow
def test_the_page_of_a_run_has_no_fault_in_a_browser(browser: Any, tmp_path: Path) -> None:
    several = LoopRequest("pid", "30deg:3s,10deg:3s", mismatch={"convection_coefficient": "120"})
    ran = run_closed(RunRequest(dt=0.01), several)
    assert faults(browser, write_run(ran, tmp_path, HOSTILE, f"smajax simulate --out {HOSTILE}", animated=True)) == []


@pytest.mark.parametrize("of", often(["a run", "a report"], ["a report"]))
def test_a_table_that_continues_sideways_has_an_edge(of: str, browser: Any, folder: Path, tmp_path: Path) -> None:
    """A grey edge on the side where there is more, of tables that are wider than a telephone; none at their ends."""
    page = folder / "report.html"
    if of == "a run":
        ran = run_closed(RunRequest(dt=0.01), LoopRequest("pid", "30deg:1s,10deg:1s"))
        page = write_run(ran, tmp_path, "A run", "")
    shown = browser.new_page(viewport={"width": 400, "height": 900})
    shown.goto(page.as_uri())
    wide = [
        box
        for box in shown.query_selector_all(".scroll:has(table)")
        if box.evaluate("box => box.scrollWidth - box.clientWidth") > 80
    ]
    assert wide
    for box in wide:
        for where, left, right in ((0, False, True), (40, True, True), (1e6, True, False)):
            box.evaluate("(box, where) => { box.scrollLeft = where; }", where)
            with Image.open(io.BytesIO(box.screenshot())) as image:
                columns = np.median(np.asarray(image.convert("L")), axis=0)  # between the lines
            assert ((columns[1] < 200), (columns[-2] < 200)) == (left, right)
            assert columns[columns.size // 2] == 255
    narrow = tmp_path / "narrow.html"
    narrow.write_text(whole("A page", [table(["a", "b"], [["1", "2"]])]), encoding="utf-8")
    shown.goto(narrow.as_uri())
    with Image.open(io.BytesIO(shown.query_selector(".scroll").screenshot())) as image:
        columns = np.median(np.asarray(image.convert("L")), axis=0)  # between the lines
    assert columns.min() == 255


# What is wrong with a page -> what is said of it.
FAULTS = {
    "<p style='width:2000px'>wide</p>": "the page is",
    "<p style='font-size:8px'>small</p>": "text of 8 px",
    "<img alt=none src='data:image/png;base64,AAAA'>": "cannot be read",
    "<img alt=white style='width:400px' src=\"data:image/svg+xml,<svg xmlns='http://www.w3.org/2000/svg' width='400' "
    "height='400'/>\">": "a blank picture",
    "<img alt=away src='away.png'>": "asked for",
    "<table><tbody></tbody></table>": "a table without a row",
    "<table><tbody><tr><td>nan</td></tr></tbody></table>": "a cell says nan",
    "<table><thead><tr><th>a</th></tr></thead><tbody><tr><td>1</td></tr></tbody></table>": "a table that does not sort",
    # Too late for what makes tables sort.
    "<script>addEventListener('load', () => document.body.insertAdjacentHTML('beforeend', '<table class=sortable><thead>"
    "<tr><th>a</th></tr></thead><tbody><tr><td>1</td></tr></tbody></table>'))</script>": "does not say how it sorts",
    "<p>&lt;b&gt;</p>": "markup as text: <b>",
    "<p>&amp;#x27;</p>": "markup as text: &#x27;",
    "<script>no_such_name()</script>": "error: ",
    "<script>console.error('lost')</script>": "console: lost",
    HOSTILE: "ran as a program",
}


@pytest.mark.slow
def test_each_fault_of_a_page_is_detected(browser: Any, tmp_path: Path) -> None:
    # The last two columns are numbers, as which they are not marked.
    rows = [["b", "2", "9 ± 1", "never"], ["a", "10", "10 ± 1", "1e-5"], ["c", "", "–", "3 … 4"]]
    page, good = tmp_path / "page.html", table(["name", "value", "both", "box"], rows, (1,))

    def told(*parts: str) -> list[str]:
        page.write_text(whole("A page", [good, *parts]), encoding="utf-8")
        return faults(browser, page, "", (400,))

    assert told() == []
    assert [part for part, said in FAULTS.items() if not any(said in one for one in told(part))] == []
