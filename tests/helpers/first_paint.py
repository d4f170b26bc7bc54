"""Size of pages and when Chromium first shows something of them.

    python -m tests.helpers.first_paint report/report.html predicted/predict.html

Times are the least of nine visits in fresh tabs, 1400 px wide, from the disk (what else the machine does only adds to them): until something is shown,
and until the page has loaded.
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

from tests.helpers.in_browser import FLAGS, NONE, chromium

VISITS = 9
TIMES = """() => [performance.getEntriesByName("first-contentful-paint")[0].startTime,
    performance.getEntriesByType("navigation")[0].loadEventEnd]"""


def visited(browser: Any, page: Path) -> tuple[float, float]:
    """(first paint, loaded), ms."""
    context = browser.new_context(viewport={"width": 1400, "height": 900})
    try:
        shown = context.new_page()
        shown.goto(page.resolve().as_uri())
        shown.wait_for_function("() => performance.getEntriesByName('first-contentful-paint').length")
        paint, loaded = shown.evaluate(TIMES)
        return paint, loaded
    finally:
        context.close()


def main(pages: list[Path]) -> None:
    """A row of a Markdown table for each page."""
    from playwright.sync_api import sync_playwright

    found = chromium()
    if found is None:
        sys.exit(NONE)
    with sync_playwright() as driver:
        browser = driver.chromium.launch(executable_path=found, args=FLAGS)
        print("| page | size, kB | first paint, ms | loaded, ms |\n|---|---|---|---|")
        for page in pages:
            paints, loads = zip(*(visited(browser, page) for _ in range(VISITS)), strict=True)
            print(f"| `{page}` | {page.stat().st_size / 1000:.0f} | {min(paints):.0f} | {min(loads):.0f} |")
        browser.close()


if __name__ == "__main__":
    main([Path(one) for one in sys.argv[1:]])
