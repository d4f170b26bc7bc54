"""Parts of a plain page: tables, lists, and the page around them, self-contained."""

from __future__ import annotations

import html
import re
from collections.abc import Sequence

from smajax.report.frame import framed

MANY = 10  # runs, or candidates, beyond which the others are folded away
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


def with_code(text: str) -> str:
    """A sentence as HTML: what stands in backticks as code, and nothing else of it as markup."""
    return re.sub(r"`([^`]+)`", r"<code>\1</code>", html.escape(text))


def bullets(sentences: Sequence[str]) -> str:
    """A list, with what stands between backticks as code; nothing for none."""
    return f"<ul>{''.join(f'<li>{with_code(one)}</li>' for one in sentences)}</ul>" if sentences else ""


def folded(parts: Sequence[str], what: str) -> list[str]:
    """The first ten, and the others in a box that opens."""
    if len(parts) <= MANY:
        return list(parts)
    rest = f"<details><summary>{len(parts) - MANY} more {html.escape(what)}</summary>{''.join(parts[MANY:])}</details>"
    return [*parts[:MANY], rest]


def section_id(heading: str) -> str:
    """The anchor of a section, of its heading's HTML."""
    return re.sub(r"\W+", "-", html.unescape(re.sub(r"<[^>]+>", "", heading)).lower()).strip("-")


def whole(title: str, parts: Sequence[str], tone: str = "") -> str:
    """The page of parts that are HTML already: what stands before the first `<h2>` is the answer, and each `<h2>` begins a section.

    tone: of the answer, "good", "fair" or "poor"; "" for none.
    """
    first, *others = re.split(r"(?=<h2>)", "".join(parts))
    contents, sections = [("answer", "Answer")], []
    for number, other in enumerate(others, start=1):
        found = re.match(r"<h2>(.*?)</h2>", other, re.DOTALL)
        words = found[1] if found else ""
        place = f"{section_id(words) or 'part'}-{number}"
        plain = html.unescape(re.sub(r"<[^>]+>", "", words))
        contents.append((place, re.sub(r" \(.*\)$", "", plain)))  # the contents need no units
        sections.append(f'<section id="{place}">{other}</section>')
    return framed(
        title,
        f'<header class="{" ".join(["answer", *[tone] * bool(tone)])}" id="answer">{first}</header>{"".join(sections)}',
        contents,
    )
