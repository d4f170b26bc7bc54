"""Parts of a plain page: tables, lists, and the page around them, self-contained."""

from __future__ import annotations

import html
from collections.abc import Sequence
from pathlib import Path

# What makes a page of one file answer clicks: tables that sort, pictures that open at full size.
SCRIPT = (Path(__file__).parent / "interactive.js").read_text(encoding="utf-8")
CLICKED = (Path(__file__).parent / "interactive.css").read_text(encoding="utf-8")

STYLE = (
    "body{font:15px/1.5 system-ui,sans-serif;max-width:1080px;margin:2em auto;padding:0 1em;color:#1d1d1f;background:#fff}"
    "td,th{text-align:left;vertical-align:top;padding:.35em .7em;border-bottom:1px solid #e3e5e9}"
    "table{border-collapse:collapse;font-size:14px}td{overflow-wrap:break-word}.scroll{overflow-x:auto;margin:0 0 1em}"
    "td.n,th.n{text-align:right;font-variant-numeric:tabular-nums;white-space:nowrap}"
    "img{max-width:100%;display:block}.quiet{color:#626973}h2{margin-top:1.6em}"
    "p,ul{max-width:62em}p,ul,h1,h2,h3{overflow-wrap:anywhere}"
    # On a telephone a table is as wide as its words want, and moves sideways, rather than a word a line.
    "@media(max-width:720px){table{width:max-content}td,th{max-width:15em}}"
    "@media(max-width:520px){body{margin:1em auto;padding:0 .6em}td,th{padding:.3em .4em}}"
)


def table(head: Sequence[str], rows: Sequence[Sequence[str]], numbers: Sequence[int] = ()) -> str:
    """Cells are text; the columns `numbers` are set to the right. A head without a word is left out, and nothing sorts."""

    def cells(kind: str, row: Sequence[str]) -> str:
        return "".join(
            f"<{kind}{' class=n' if k in numbers else ''}>{html.escape(cell)}</{kind}>" for k, cell in enumerate(row)
        )

    body = "".join(f"<tr>{cells('td', row)}</tr>" for row in rows)
    top = f"<thead><tr>{cells('th', head)}</tr></thead>" if any(head) else ""
    return f"<div class=scroll><table{' class=sortable' if top else ''}>{top}<tbody>{body}</tbody></table></div>"


def bullets(sentences: Sequence[str]) -> str:
    """A list; nothing for none."""
    return f"<ul>{''.join(f'<li>{html.escape(one)}</li>' for one in sentences)}</ul>" if sentences else ""


def whole(title: str, parts: Sequence[str]) -> str:
    """The page of parts that are HTML already."""
    return (
        '<!doctype html><html lang="en"><meta charset="utf-8"><meta name="viewport" content="width=device-width, '
        f'initial-scale=1"><link rel="icon" href="data:,"><title>{html.escape(title)}</title>'
        f"<style>{STYLE}{CLICKED}</style>{''.join(parts)}<script>{SCRIPT}</script></html>\n"
    )
