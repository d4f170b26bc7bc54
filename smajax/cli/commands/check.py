"""`smajax check`: an experiment file and its logs, before any fit."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from smajax.cli.options import Json, Open, Overwrite
from smajax.cli.terminal import browse, command_line, console, resumable, say

if TYPE_CHECKING:
    from smajax.fit.experiment_check import ExperimentCheck


def _replaces(before: Mapping[str, Any], now: Mapping[str, Any]) -> bool:
    """Whatever was checked before: a check takes seconds, and is made again after each change of the file."""
    return True


def check_command(
    experiment: Annotated[Path, typer.Argument(help="experiment.toml, or the folder that holds it")],
    out: Annotated[Path, typer.Option(help="folder for check.html and check.json")] = Path("checked"),
    overwrite: Overwrite = False,
    json_out: Json = False,
    open_page: Open = False,
) -> None:
    """Read an experiment and its logs, and simulate every run at the initial guess; nothing is fitted.

    Says in seconds what looks wrong, what was read and in which units, how far the model is off where a fit begins, whether the wire
    transforms there, and which unknowns the runs determine; draws measured and simulated runs. An earlier check in --out is replaced.

    Example:  smajax check experiment.toml --open
    """
    from smajax.core.runtime import prepare

    prepare()
    from smajax.cli.progress_display import displayed
    from smajax.cli.result_folder import FolderTaken, check_path, claimed
    from smajax.core.files import json_text
    from smajax.core.progress import Stage
    from smajax.data.experiment.errors import ExperimentError
    from smajax.data.experiment.fingerprint import fingerprint
    from smajax.data.experiment.load import load_experiment
    from smajax.data.model_catalogue import CATALOGUE
    from smajax.fit.experiment_check import check_experiment
    from smajax.report.check_page import FILES, record, write_check
    from smajax.report.next_steps import after_check

    check_path(out)
    loaded, command = load_experiment(experiment, CATALOGUE), command_line()
    try:
        with (
            resumable(),
            claimed(out, "check", dict(fingerprint(loaded)), FILES, overwrite, _replaces),
            displayed(console(), hint=False) as progress,
        ):
            # Its sentences are part of what is printed in the end.
            found = check_experiment(loaded, lambda event: progress(event) if isinstance(event, Stage) else None)
            page = write_check(found, out, command, after_check(found, str(experiment)))
    except (FolderTaken, ExperimentError):
        raise
    except ValueError as error:
        raise typer.BadParameter(str(error)) from None
    if json_out:
        typer.echo(json_text(record(found, command)), nl=False)
    else:
        _print(found)
        typer.echo(f"Page: {page.resolve()}")
    if open_page:
        browse(page)


def _print(found: ExperimentCheck) -> None:
    """The result for a terminal: a run a column."""
    from smajax.core.wording import aligned
    from smajax.report.check_words import UNKNOWNS_HEAD, answer, by_columns, conclusions, run_rows, unknown_rows

    for sentence in (answer(found), *conclusions(found)):
        say(sentence)
    unknowns = [[list(UNKNOWNS_HEAD), *unknown_rows(found)]] if found.unknowns else []
    for rows in (by_columns(*run_rows(found)), *unknowns):
        typer.echo()
        for line in aligned(rows):
            typer.echo(f"  {line}".rstrip())
