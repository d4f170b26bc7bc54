"""Parts of a plain page: tables, lists, and the page around them, self-contained."""

from __future__ import annotations

import html
import re
from collections.abc import Sequence
from pathlib import Path

# What makes a page of one file answer clicks: tables that sort, pictures that open at full size.
SCRIPT = (Path(__file__).parent / "interactive.js").read_text(encoding="utf-8")
CLICKED = (Path(__file__).parent / "interactive.css").read_text(encoding="utf-8")

STYLE = (
    "body{font:15px/1.5 system-ui,sans-serif;max-width:1000px;margin:2em auto;padding:0 1em;color:#1d1d1f;background:#fff}"
    "td,th{text-align:left;vertical-align:top;padding:.35em .7em;border-bottom:1px solid #e3e5e9}"
    "table{border-collapse:collapse;font-size:14px;width:100%}td{overflow-wrap:break-word}.scroll{overflow-x:auto;margin:0 0 1em}"
    "table:not(.sortable) td+td{overflow-wrap:anywhere}table:not(.sortable) td:first-child{min-width:7em}"
    "td.n,th.n{text-align:right;font-variant-numeric:tabular-nums;white-space:nowrap}"
    "th.n{white-space:normal}img{max-width:100%;display:block;margin:0 auto}.quiet{color:#626973}h2{margin-top:1.6em}"
    "p,ul,h1,h2,h3{overflow-wrap:anywhere}"
    ".headline{font-size:1.2em;line-height:1.4;font-weight:600;border-left:4px solid #1f6fb2;padding:.1em 0 .1em .7em;margin:1em 0}"
    # On a telephone names and numbers break where they may, so that the numbers are on the screen; sentences keep some width,
    # and only a table that is too wide even so moves sideways.
    "@media(max-width:720px){td.w{white-space:normal!important}td.t{min-width:9em}}"
    "@media(min-width:721px){wbr{display:none}}"
    "@media(max-width:520px){body{margin:1em auto;padding:0 .6em}h1{font-size:1.5em}.headline{font-size:1.05em}table{font-size:13px}td,th{padding:.3em .35em}}"
)


SENTENCE = 30  # characters from which on a cell is no name


def breakable(text: str) -> str:
    """Escaped; a long name may go on in the next line after a `_`, `eps_L` may not."""
    return re.sub(r"_(?=\w{3})", "_<wbr>", html.escape(text))


def table(
    head: Sequence[str], rows: Sequence[Sequence[str]], numbers: Sequence[int] = (), links: Sequence[str] = ()
) -> str:
    """Cells are text; the columns `numbers` are set to the right. A head without a word is left out, and nothing sorts.

    links: where the first cell of each row leads, if anywhere.
    """

    def cells(kind: str, row: Sequence[str], first: int = 0) -> str:
        return "".join(
            f"<{kind}{_class(k, cell)}>{breakable(cell)}</{kind}>" for k, cell in enumerate(row) if k >= first
        )

    def _class(k: int, cell: str) -> str:
        if k in numbers:
            return ' class="n w"' if len(cell.split()) > 2 else " class=n"
        return " class=t" if len(cell) > SENTENCE else ""

    body = "".join(f"<tr>{cells('td', row)}</tr>" for row in rows)
    if links:
        body = "".join(
            f'<tr><td{_class(0, row[0])}><a href="{html.escape(link)}">{breakable(row[0])}</a></td>{cells("td", row, 1)}</tr>'
            for row, link in zip(rows, links, strict=True)
        )
    top = f"<thead><tr>{cells('th', head)}</tr></thead>" if any(head) else ""
    return f"<div class=scroll><table{' class=sortable' if top else ''}>{top}<tbody>{body}</tbody></table></div>"


def headline(sentence: str) -> str:
    """The answer, first thing below the title; nothing for none."""
    return f"<p class=headline>{html.escape(sentence)}</p>" if sentence else ""


def bullets(sentences: Sequence[str]) -> str:
    """A list, with what stands between backticks as code; nothing for none."""
    items = [re.sub(r"`([^`]+)`", r"<code>\1</code>", html.escape(one)) for one in sentences]
    return f"<ul>{''.join(f'<li>{one}</li>' for one in items)}</ul>" if items else ""


def whole(title: str, parts: Sequence[str]) -> str:
    """The page of parts that are HTML already."""
    return (
        '<!doctype html><html lang="en"><meta charset="utf-8"><meta name="viewport" content="width=device-width, '
        f'initial-scale=1"><link rel="icon" href="data:,"><title>{html.escape(title)}</title>'
        f"<style>{STYLE}{CLICKED}</style>{''.join(parts)}<script>{SCRIPT}</script></html>\n"
    )
