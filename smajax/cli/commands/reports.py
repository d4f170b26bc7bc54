"""`smajax reports`: one page that compares the reports of a folder."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

import typer

from smajax.cli.options import Json, Open, refused
from smajax.cli.terminal import browse, until_pipe_closes


def reports(
    folder: Annotated[
        Path, typer.Argument(help="folder with reports of close-loop in it or below it", exists=True, file_okay=False)
    ] = Path(),
    json_out: Json = False,
    open_page: Open = False,
) -> None:
    """Compare the reports of `close-loop` in a folder: verdict, effects, error before and after, held-out runs.

    Writes reports.html there, with a link to each report, and prints the same as text.

    Example:  smajax reports demo-report
    """
    from smajax.core.files import json_text
    from smajax.core.wording import aligned
    from smajax.report.index_page import HEAD, as_record, cells, write_index

    with refused("'FOLDER'"):
        page, rows, messages = write_index(folder)
    if json_out:
        typer.echo(json_text([as_record(row) for row in rows]), nl=False)
    else:
        with until_pipe_closes():
            for line in aligned([_short(HEAD, HEAD[0]), *(_short(cells(row), row.folder) for row in rows)]):
                typer.echo(line)
            for row in rows:
                typer.echo(f"{row.folder}: {row.title}; effects added: {', '.join(row.effects) or 'none'}")
            for message in messages:
                typer.echo(f"note: {message}")
            typer.echo(f"Page: {page.resolve()}")
    if open_page:
        browse(page)


def _short(line: Sequence[str], first: str) -> list[str]:
    """A line of the table for a terminal: the folder in the place of title and effects, which are long."""
    _, *numbers, _, written = line
    return [first, *numbers, written]
