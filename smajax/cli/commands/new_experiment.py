"""`smajax new-experiment`: a draft of an experiment file from logs."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated

import typer

from smajax.cli import completion
from smajax.cli.options import UNMET, Json


# More than 8 parameters: typer reads the options from them.
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
        str,
        typer.Option(help="of `smajax presets`; the bounds are around its parameters", autocompletion=completion.wires),
    ] = "",
    drive: Annotated[
        str,
        typer.Option(help="of `smajax presets`; determines the input channels", autocompletion=completion.drives),
    ] = "",
    model: Annotated[
        Path | None,
        typer.Option(help="a model.toml to begin from, in the place of presets; what it fitted is fitted again"),
    ] = None,
    decimal: Annotated[
        str, typer.Option(help="`,` or `.`: the decimal mark, for logs that do not determine it (`1,234`)")
    ] = "",
    overwrite: Annotated[bool, typer.Option("--overwrite", help="replace an existing file")] = False,
    json_out: Json = False,
) -> None:
    """Draft an experiment file from measured logs: guess columns, units and sampling, with the certainty of each guess.

    With three logs or more the last one is held out. Exit code 3 when the file cannot be loaded yet, with what is missing.

    Example:  smajax new-experiment logs/step1.csv logs/step2.csv logs/ramp.csv --out experiment.toml
    """
    if out.exists() and not overwrite:
        raise typer.BadParameter(f"{out} exists; give another name, or --overwrite.", param_hint="--out")
    if not out.parent.is_dir():
        raise typer.BadParameter(f"the folder {out.parent} does not exist.", param_hint="--out")
    if decimal not in ("", ",", "."):
        raise typer.BadParameter(f"`,` or `.`, not `{decimal}`.", param_hint="--decimal")
    if model is not None and (load or wire or drive):
        raise typer.BadParameter(
            "says wire, load and drive: leave --wire, --load and --drive out.", param_hint="--model"
        )
    from smajax.core.runtime import prepare

    prepare()
    from smajax.core.files import replace
    from smajax.data.experiment.draft import draft
    from smajax.data.experiment.draft_model import ModelChoice
    from smajax.data.experiment.errors import ExperimentError
    from smajax.data.experiment.load import load_experiment
    from smajax.data.model_catalogue import CATALOGUE

    result = draft(files, out, title, ModelChoice(load, wire, drive, model), decimal)
    replace(out, result.text)
    try:
        warnings, reason = list(load_experiment(out, CATALOGUE).warnings), ""
    except ExperimentError as error:
        warnings, reason = [], str(error)
    if json_out:
        record = {
            "file": str(out),
            "guessed": result.messages,
            "loads": not reason,
            "why": reason,
            "warnings": warnings,
        }
        typer.echo(json.dumps(record))
    else:
        for line in result.messages:
            typer.echo(f"  {line}")
        for line in warnings:
            typer.echo(f"  warning: {line}")
        if reason:
            typer.echo(f"It cannot be loaded yet: {reason}")
        typer.echo(f"Written: {out.resolve()}")
        if not reason:
            typer.echo(f"Next: check it, then `smajax close-loop {out} --out report`")
    if reason:
        raise typer.Exit(UNMET)
