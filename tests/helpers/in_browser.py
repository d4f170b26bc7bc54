"""What is wrong with a page as a browser shows it; used by the tests of every command that writes one."""

from __future__ import annotations

import os
import shutil
from collections.abc import Sequence
from pathlib import Path
from typing import Any

WIDTHS = (400, 1400)  # px: a telephone, a desk
CHECKS = Path(__file__).with_suffix(".js").read_text(encoding="utf-8")
# A title, or a name, that somebody gave.
HOSTILE = """<script>window.hacked=1</script><img src=x onerror="window.hacked=1"> "quoted" & 'so'"""
# As root a browser has no sandbox; the pages are our own.
FLAGS = ["--no-sandbox", "--disable-gpu", "--no-first-run", "--disable-background-networking", "--disable-sync"]

# The first has no window, and takes two thirds of the time.
NAMES = ("chromium-headless-shell", "chromium", "chromium-browser", "google-chrome")
NONE = f"none of {', '.join(NAMES)} is on the PATH; on Debian: apt-get install {NAMES[0]}"


def chromium() -> str | None:
    """Path of the browser that there is."""
    return next((path for name in NAMES if (path := shutil.which(name))), None)


def faults(browser: Any, page: Path, hostile: str = HOSTILE, widths: Sequence[int] = WIDTHS) -> list[str]:
    """In sentences, at each of the widths; `hostile` must be on the page as text. SMAJAX_SHOTS: a folder for pictures of it."""
    return [f"{width} px: {one}" for width in widths for one in _faults(browser, page, width, hostile)]


def _faults(browser: Any, page: Path, width: int, hostile: str) -> list[str]:
    wrong: list[str] = []
    address = page.resolve().as_uri()

    def asked(request: Any) -> None:
        if request.url != address and not request.url.startswith("data:"):
            wrong.append(f"asked for {request.url}")

    context = browser.new_context(viewport={"width": width, "height": 900})
    try:
        shown = context.new_page()
        shown.on("console", lambda said: wrong.append(f"console: {said.text}"))
        shown.on("pageerror", lambda error: wrong.append(f"error: {error}"))
        shown.on("request", asked)
        shown.goto(address)
        if shots := os.environ.get("SMAJAX_SHOTS"):
            shown.screenshot(path=Path(shots) / f"{page.stem}-{page.parent.name}-{width}.png", full_page=True)
        wrong += shown.evaluate(CHECKS, hostile)
        shown.keyboard.press("Escape")
        shown.wait_for_function("() => !document.querySelector('dialog')")
    finally:
        context.close()
    return wrong
