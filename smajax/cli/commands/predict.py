"""`smajax predict`: measured runs against a kept model."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from smajax.cli.options import Decimal, Json, Open, Overwrite, texts
from smajax.cli.terminal import browse, command_line, console, resumable, say

if TYPE_CHECKING:
    from smajax.fit.prediction import Prediction

INPUTS = "mass='0.2 kg',ambient_temperature=25degC"
VALUES = "damping='20 N s/m',load_mass='0.2 kg'"


# More than 8 parameters: typer reads the options from them.
def predict_command(
    model: Annotated[Path, typer.Argument(help="model.toml of close-loop or identify, or the folder that holds it")],
    logs: Annotated[
        list[Path],
        typer.Argument(help="measured logs, a run each; or an experiment.toml, whose runs are all predicted"),
    ],
    inputs: Annotated[
        list[str] | None,
        typer.Option("--input", help="inputs that no log has, constant: mass='0.2 kg'; may be repeated"),
    ] = None,
    values: Annotated[
        list[str] | None,
        typer.Option("--set", help="parameters that differ in these runs: load_mass='0.2 kg'; may be repeated"),
    ] = None,
    decimal: Decimal = "",
    out: Annotated[Path, typer.Option(help="folder for predict.html, predict.json and runs.csv")] = Path("predicted"),
    overwrite: Overwrite = False,
    json_out: Json = False,
    open_page: Open = False,
) -> None:
    """Predict measured runs with a fitted model, and show the error, the band and where the model extrapolates.

    Columns are those of the logs that the model was fitted to; where a log has others they are guessed, as by `new-experiment`.
    Of a log that lacks a sensor which the model was fitted to, the others are compared, and the output that is missing is predicted alone.
    Nothing is fitted, but for the zero of a sensor that has one in each run; it is that of the average of the likely models.

    Example:  smajax predict report/model.toml logs/ramp.csv --out predicted
    """
    from smajax.core.runtime import prepare

    prepare()
    from smajax.cli.progress_display import displayed
    from smajax.cli.result_folder import check_path, claimed
    from smajax.core.files import json_text
    from smajax.core.progress import Stage
    from smajax.data.model_file.read import load_model
    from smajax.fit.predict import predict
    from smajax.report.next_steps import after_predict
    from smajax.report.predict_page import FILES, record, write_prediction

    check_path(out)
    constants, changed = texts("--input", inputs, INPUTS), texts("--set", values, VALUES)
    command = command_line()
    loaded = load_model(model)
    settings = {
        "model": str(model),
        "logs": [str(one) for one in logs],
        "inputs": constants,
        "values": changed,
        "decimal": decimal,
    }
    with resumable(), claimed(out, "predict", settings, FILES, overwrite), displayed(console()) as progress:
        progress(Stage("predicting the runs", 0.0))
        result = predict(loaded, logs, inputs=constants, parameters=changed, decimal=decimal)
        progress(Stage("predicting the runs", 1.0))
        page = write_prediction(result, out, command, after_predict(loaded, str(model), [str(one) for one in logs]))
    if json_out:
        typer.echo(json_text(record(result, command)), nl=False)
    else:
        _print(result)
        typer.echo(f"Page: {page.resolve()}")
    if open_page:
        browse(page)


def _print(result: Prediction) -> None:
    """The result for a terminal."""
    from smajax.core.wording import aligned
    from smajax.report.predict_words import HEAD, band_sentence, conclusions, run_rows

    for sentence in (*conclusions(result), band_sentence(result)):
        say(sentence)
    for line in aligned([list(HEAD), *map(list, run_rows(result))]):
        typer.echo(f"  {line}")
    for sentence in result.warnings:
        typer.echo(f"  note: {sentence}")
