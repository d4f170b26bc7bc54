"""The frame of every page that is written: one file, with its look and its scripts inside, and nothing fetched."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from pathlib import Path
from typing import Any

from jinja2 import Environment, FileSystemLoader, StrictUndefined
from markupsafe import Markup

TEMPLATES = Path(__file__).parent / "templates"
STATIC = Path(__file__).parent / "static"


@cache
def static(name: str) -> str:
    """The text of a file in `static/`."""
    return (STATIC / name).read_text(encoding="utf-8")


@cache
def environment() -> Environment:
    """That of the templates, in which what is inserted is escaped."""
    return Environment(
        loader=FileSystemLoader(TEMPLATES),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )


def _library() -> str:
    """uPlot with its licence, which goes with every copy, in the place of its first line."""
    return f"/* uPlot\n{static('uPlot-LICENSE.txt')}*/\n{static('uPlot.js').split(chr(10), 1)[1]}"


def parts_of_frame(plots: bool) -> dict[str, Any]:
    """What `frame.html` is given beside title, contents and content. plots: with what makes series move."""
    styles = ("look.css", *(("uPlot.css",) if plots else ()), "page.css")
    scripts = (*((_library(), static("plots.js"), static("series.js")) if plots else ()), static("page.js"))
    return {
        "style": Markup("\n".join(static(name) for name in styles)),
        "scripts": [Markup(one) for one in scripts],
    }


def framed(title: str, content: str, contents: Sequence[tuple[str, str]] = ()) -> str:
    """A page of `content`, HTML already. contents: (id, words) of its sections; beside them from four on."""
    plots = '<figure class="series' in content
    return (
        environment()
        .get_template("frame.html")
        .render(title=title, content=Markup(content), contents=contents, **parts_of_frame(plots))
    )
