"""`smajax figures`: the source's figures with the numbers that prove them."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated

import typer

from smajax.cli import completion
from smajax.cli.options import UNMET, Json, Open, Overwrite
from smajax.cli.terminal import browse, console, resumable

OWN = (".made-by", "index.html", "README.md", "figures.csv", "[MC][0-9].*", "[MC][0-9][0-9].*")


def figures(
    names: Annotated[
        list[str] | None,
        typer.Argument(
            help="chapters (chapter3, chapter4) and single figures (M7 C12); default all",
            autocompletion=completion.figures,
        ),
    ] = None,
    out: Annotated[Path, typer.Option(help="folder for the pictures, the numbers (JSON) and the table")] = Path(
        "figures"
    ),
    fast: Annotated[bool, typer.Option("--fast", help="coarser steps, fewer samples, the same claims")] = False,
    overwrite: Overwrite = False,
    json_out: Json = False,
    open_page: Open = False,
) -> None:
    """Draw the source's figures, each with the number that proves it, and print which claims hold, hold in part or fail.

    Exit code 3 when one that was asked for fails or holds in part. Figures that lie in the folder already stay on its page. After
    Ctrl-C the same command draws the figures that are missing.

    The figures are not part of the package `smajax`: a wheel brings them as `smajax_studies`, a checkout as `studies/source`.

    Example:  smajax figures M7 C12 --out figures
    """
    from smajax.core.runtime import prepare

    prepare()
    from smajax.cli.progress_display import displayed
    from smajax.cli.result_folder import claimed
    from smajax.cli.source_figures import load

    catalogue, write = load("catalogue"), load("write")
    try:
        requested = [row for name in names or catalogue.CHAPTERS for row in catalogue.rows(name)]
    except KeyError as error:
        raise typer.BadParameter(error.args[0], param_hint="NAME") from None
    setting = {"setting": "fast" if fast else "full"}
    resume = "Finished figures are cached: the same command resumes."
    with (
        resumable(resume, out, "[MC]*.json"),
        claimed(out, "figures", setting, OWN, overwrite),
        displayed(console(), hint=not json_out) as progress,
    ):
        drawn = write.draw(list(dict.fromkeys(requested)), out, fast, progress)
        page = write.write_pages(out)
    if json_out:
        typer.echo(
            json.dumps(
                {
                    one.row.name: {
                        "holds": one.holds,
                        "state": one.state,
                        "in_part": one.in_part,
                        "found": one.found,
                        "note": one.caveat,
                    }
                    for one in drawn
                }
            )
        )
    else:
        typer.echo(write.as_text(drawn))
        typer.echo(f"Page: {page.resolve()}")
    if open_page:
        browse(page)
    if not all(one.holds for one in drawn):
        raise typer.Exit(UNMET)
