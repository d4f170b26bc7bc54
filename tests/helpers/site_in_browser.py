"""Opens every page of the built site in headless Chromium, as a telephone and as a desk show it, and says what is wrong.

    python -m tests.helpers.site_in_browser site

Passes, saying so, where there is no Chromium. Links between pages are looked at as files; `mkdocs --strict` has checked the rest.
"""

from __future__ import annotations

import functools
import http.server
import re
import sys
import threading
from collections.abc import Sequence
from pathlib import Path
from typing import Any
from urllib.parse import unquote, urldefrag, urljoin, urlparse

from tests.helpers.in_browser import FLAGS, NONE, WIDTHS, chromium

MODULES, EVERY = "reference/modules/", 12
HREF = re.compile(r'<(?:a|link|img|script)\b[^>]*?\b(?:href|src)="([^"]+)"')
# Tables and code move sideways within their boxes; the page itself must not.
CHECKS = """async () => {
  const wrong = [];
  const wide = document.documentElement.scrollWidth, window_ = document.documentElement.clientWidth;
  if (wide > window_) wrong.push(`the page is ${wide} px wide, the window ${window_}`);
  for (const image of document.querySelectorAll(".md-content img")) {
    image.loading = "eager";
    await image.decode().catch(() => wrong.push(`a picture that cannot be read: ${image.src}`));
    if (!image.alt) wrong.push(`a picture without a word for it: ${image.src}`);
  }
  for (const table of document.querySelectorAll(".md-content table"))
    if (!table.querySelector("td")) wrong.push(`a table without a row: ${table.textContent.trim().slice(0, 40)}`);
  if (document.querySelector("main") && document.querySelector("main").innerText.trim().length < 40) wrong.push("next to no text");
  return wrong;
}"""


class _Pages(http.server.SimpleHTTPRequestHandler):
    """Says nothing; a browser asks for an icon that a page of a command does not have."""

    def log_message(self, *_: object) -> None:
        pass

    def do_GET(self) -> None:
        if self.path == "/favicon.ico":
            self.send_response(204)
            self.end_headers()
        else:
            super().do_GET()


class _Server(http.server.ThreadingHTTPServer):
    """A browser that leaves a page while it is sent is no error."""

    daemon_threads = True

    def handle_error(self, request: object, client_address: object) -> None:
        if not isinstance(sys.exc_info()[1], ConnectionError):
            super().handle_error(request, client_address)  # type: ignore[arg-type]


def dead_links(site: Path) -> list[str]:
    """Links and sources of all pages that lead to no file of the site."""
    wrong = []
    for page in sorted(site.rglob("*.html")):
        here = page.relative_to(site).as_posix()
        if here == "404.html":  # whose links begin at the root of a server
            continue
        for target in set(HREF.findall(page.read_text(encoding="utf-8"))):
            if urlparse(target).scheme or target.startswith("#"):
                continue
            path = urlparse(urldefrag(urljoin(f"http://here/{here}", target)).url).path
            found = site / unquote(path).lstrip("/")
            if not (found / "index.html" if found.is_dir() else found).is_file():
                wrong.append(f"{here}: leads to {target}, which is not there")
    return wrong


def faults(browser: Any, address: str, pages: Sequence[str], width: int) -> list[str]:
    """Of all pages, one after the other, in a window of that width."""
    shown = browser.new_context(viewport={"width": width, "height": 900}).new_page()
    found: list[str] = []  # on the page that is open

    def asked(request: Any) -> None:
        if not request.url.startswith((address, "data:", "blob:")):
            found.append(f"asks for {request.url}")

    shown.on("console", lambda said: found.append(f"console: {said.text}") if said.type == "error" else None)
    shown.on("pageerror", lambda error: found.append(f"error: {error}"))
    shown.on("request", asked)
    wrong = []
    for page in pages:
        shown.goto(f"{address}/{page}")
        found += shown.evaluate(CHECKS)
        wrong += [f"{page}, {width} px: {one}" for one in found]
        found.clear()
    return wrong


def unsearched(browser: Any, site: Path) -> list[str]:
    """What is wrong with a search for a word that many pages have, where the site is read from a disk."""
    shown = browser.new_context(viewport={"width": 1400, "height": 900}).new_page()
    wrong: list[str] = []
    shown.on("console", lambda said: wrong.append(f"search: {said.text}") if said.type == "error" else None)
    shown.on("pageerror", lambda error: wrong.append(f"search: {error}"))
    for page in ("index.html", "reference/names.html"):
        shown.goto((site.resolve() / page).as_uri())
        found = shown.locator(".md-search-result__link")
        try:
            shown.click("input.md-search__input", timeout=20_000)
            shown.keyboard.type("martensite")
            found.first.wait_for(timeout=20_000)
        except Exception as error:
            wrong.append(f"{page}: from a disk the search finds nothing: {error}")
            continue
        target = unquote(urlparse(urldefrag(found.first.get_attribute("href")).url).path)
        if not Path(target).is_file():
            wrong.append(f"{page}: the search leads to {target}, which is not there")
    return wrong


def looked_at(site: Path) -> list[str]:
    """Every page but the sources of the repository, opened; of the pages of modules, which one template makes, every `EVERY`-th."""
    from playwright.sync_api import sync_playwright

    found = chromium()
    if found is None:
        print(f"{NONE}. No page of the site is opened.")
        return []
    pages = [page.relative_to(site).as_posix() for page in sorted(site.rglob("*.html"))]
    pages = [page for page in pages if not page.startswith("repository/") and page != "404.html"]
    modules = [page for page in pages if page.startswith(MODULES)]
    pages = [page for page in pages if not page.startswith(MODULES)] + modules[::EVERY]
    server = _Server(("127.0.0.1", 0), functools.partial(_Pages, directory=site))
    threading.Thread(target=server.serve_forever, daemon=True).start()
    try:
        with sync_playwright() as driver:
            browser = driver.chromium.launch(executable_path=found, args=FLAGS)
            address = f"http://127.0.0.1:{server.server_port}"
            wrong = [fault for width in WIDTHS for fault in faults(browser, address, pages, width)]
            wrong += unsearched(browser, site)
            browser.close()
    finally:
        server.shutdown()
    print(f"{len(pages)} pages opened at {' and '.join(map(str, WIDTHS))} px")
    return wrong


if __name__ == "__main__":
    built = Path(sys.argv[1])
    told = [*dead_links(built), *looked_at(built)]
    sys.exit("\n".join(told) if told else 0)
