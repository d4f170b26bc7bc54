"""`smajax new-experiment`: an experiment file begun from logs."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated

import typer

from smajax.cli import completion
from smajax.cli.options import UNMET, Json


def new_experiment(
    files: Annotated[
        list[Path],
        typer.Argument(help="a log a run, or one a sensor, paired by their names: CSV, text, .mat, Parquet, NetCDF"),
    ],
    out: Annotated[Path, typer.Option(help="the file to write")] = Path("experiment.toml"),
    title: Annotated[str, typer.Option(help="one line; default: the file's name")] = "",
    load: Annotated[
        str,
        typer.Option(
            help="of a log with a position: dead_weight (default) or bias_spring", autocompletion=completion.loads
        ),
    ] = "",
    wire: Annotated[
        str, typer.Option(help="of `smajax presets`; the bounds are around its values", autocompletion=completion.wires)
    ] = "",
    drive: Annotated[
        str,
        typer.Option(
            help="of `smajax presets`; takes the input channels that it needs", autocompletion=completion.drives
        ),
    ] = "",
    decimal: Annotated[
        str, typer.Option(help="`,` or `.`: what stands before decimals, of logs that do not tell (`1,234`)")
    ] = "",
    overwrite: Annotated[bool, typer.Option("--overwrite", help="write over a file that is there")] = False,
    json_out: Json = False,
) -> None:
    """Begin an experiment file from measured logs: guess columns, units and sampling, and say how sure each guess is.

    From three logs on the last one is held out. Exit code 3 when the file does not load yet; what is missing is said.

    Example:  smajax new-experiment logs/step1.csv logs/step2.csv logs/ramp.csv --out experiment.toml
    """
    if out.exists() and not overwrite:
        raise typer.BadParameter(f"{out} exists; give another name, or --overwrite.", param_hint="--out")
    if not out.parent.is_dir():
        raise typer.BadParameter(f"the folder {out.parent} does not exist.", param_hint="--out")
    if decimal not in ("", ",", "."):
        raise typer.BadParameter(f"`,` or `.`, not `{decimal}`.", param_hint="--decimal")
    from smajax.core.runtime import prepare

    prepare()
    from smajax.core.files import replace
    from smajax.data.experiment.draft import begun
    from smajax.data.experiment.errors import ExperimentError
    from smajax.data.experiment.load import load_experiment
    from smajax.data.model_catalogue import CATALOGUE

    guessed = begun(files, out, title, load, wire, drive, decimal)
    replace(out, guessed.text)
    try:
        warnings, why = list(load_experiment(out, CATALOGUE).warnings), ""
    except ExperimentError as error:
        warnings, why = [], str(error)
    if json_out:
        typer.echo(
            json.dumps({"file": str(out), "guessed": guessed.told, "loads": not why, "why": why, "warnings": warnings})
        )
    else:
        for line in guessed.told:
            typer.echo(f"  {line}")
        for line in warnings:
            typer.echo(f"  warning: {line}")
        if why:
            typer.echo(f"It does not load yet: {why}")
        typer.echo(
            f"Written: {out.resolve()}"
            + ("" if why else f"\nNext: look at it, then `smajax close-loop {out} --out report`")
        )
    if why:
        raise typer.Exit(UNMET)
