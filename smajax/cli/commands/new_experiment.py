"""`smajax new-experiment`: a draft of an experiment file from logs."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from smajax.cli import completion
from smajax.cli.options import UNMET, Decimal, Json, quantity, texts
from smajax.cli.terminal import say

if TYPE_CHECKING:
    from smajax.cli.draft_file import DraftFile

KNOWN = "wire_length='0.5 m',wire_diameter='0.31 mm'"


# More than 8 parameters and 80 lines: typer reads the options from them, and their help fills 45 lines.
def new_experiment(
    files: Annotated[
        list[Path],
        typer.Argument(help="a log a run, or one a sensor, paired by their names: CSV, text, .mat, Parquet, NetCDF"),
    ],
    out: Annotated[Path, typer.Option(help="the file to write")] = Path("experiment.toml"),
    title: Annotated[str, typer.Option(help="one line; default: the logs, wire, load and drive")] = "",
    load: Annotated[
        str,
        typer.Option(
            help="of `smajax presets`, with a reading that the logs have; default: of a position dead_weight, of a force blocked_wire, "
            "of an angle arm",
            autocompletion=completion.loads,
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
    decimal: Decimal = "",
    known: Annotated[
        list[str] | None,
        typer.Option("--known", help="parameters that you measured: wire_length='0.5 m'; may be repeated"),
    ] = None,
    ohms: Annotated[
        float | None, quantity("resistance of the cold wire, which gives its resistivities", "ohm", above=0.0)
    ] = None,
    ohms_per_metre: Annotated[
        float | None, quantity("the same as data sheets have it, of each metre", "ohm/m", above=0.0)
    ] = None,
    mass: Annotated[
        list[str] | None,
        typer.Option(
            "--mass",
            help="hanging mass, of an arm its payload, where no column has it: '500 g' of all runs, RUN='1 kg' of one, several after commas; may be repeated",
        ),
    ] = None,
    runs_of: Annotated[
        Path | None,
        typer.Option(
            "--with-runs-of",
            help="an experiment file whose text and runs are kept, with these logs as further fit runs of the same columns; --out is beside it",
        ),
    ] = None,
    overwrite: Annotated[bool, typer.Option("--overwrite", help="replace an existing file")] = False,
    json_out: Json = False,
) -> None:
    """Draft an experiment file from measured logs: guess columns, units and sampling, with the certainty of each guess.

    What is left to the presets is listed by how much it changes the outputs of the runs. With three logs or more the last one is held
    out. Exit code 3 when the file cannot be loaded yet, with what is missing.

    Example:  smajax new-experiment logs/steps.csv logs/triangle.csv logs/pulses.csv logs/ramp.csv --out experiment.toml

    Example:  smajax new-experiment logs/ramp.csv --with-runs-of experiment.toml --out again.toml

    Example:  smajax new-experiment logs/*.csv --known wire_length='0.5 m',wire_diameter='0.31 mm' --ohms 4.2ohm --mass ramp='500 g'
    """
    _check_options(out, overwrite, model is not None and bool(load or wire or drive))
    others_given = (title, load, wire, drive, model, decimal, known, ohms, ohms_per_metre)
    if runs_of is not None and any(others_given):
        raise typer.BadParameter(
            "says title, model, columns and values itself: leave their options out.", param_hint="--with-runs-of"
        )
    given, (masses, others) = texts("--known", known, KNOWN), _masses(mass or ())
    from smajax.core.runtime import prepare

    prepare()
    from smajax.cli.draft_file import write_draft
    from smajax.data.experiment.draft import draft
    from smajax.data.experiment.draft_facts import BenchFacts
    from smajax.data.experiment.draft_model import ModelChoice
    from smajax.data.experiment.extend import extended

    bench = BenchFacts(given, ohms, ohms_per_metre, masses, others)
    result = (
        draft(files, out, title, ModelChoice(load, wire, drive, model), decimal, bench)
        if runs_of is None
        else extended(runs_of, files, out, masses, others)
    )
    loaded = write_draft(result, out)
    if json_out:
        record = {
            "file": str(out),
            "guessed": result.messages,
            "loads": not loaded.reason,
            "why": loaded.reason,
            "warnings": loaded.warnings,
            "left_to_preset": [asdict(one) for one in loaded.ranking.influences] if loaded.ranking else [],
        }
        typer.echo(json.dumps(record))
    else:
        _print(result.messages, loaded, out, ranked=runs_of is None)
    if loaded.reason:
        raise typer.Exit(UNMET)


def _check_options(out: Path, overwrite: bool, twice: bool) -> None:
    """Raises typer.BadParameter. twice: the presets are named beside a model file."""
    if out.exists() and not overwrite:
        raise typer.BadParameter(f"{out} exists; give another name, or --overwrite.", param_hint="--out")
    if not out.parent.is_dir():
        raise typer.BadParameter(f"the folder {out.parent} does not exist.", param_hint="--out")
    if twice:
        raise typer.BadParameter(
            "says wire, load and drive: leave --wire, --load and --drive out.", param_hint="--model"
        )


def _masses(several: Sequence[str]) -> tuple[dict[str, str], str]:
    """(by run: `RUN=500 g`, once a run, whose name may hold anything; of all other runs: `500 g`). Several may stand after commas."""
    result: dict[str, str] = {}
    for one in (part for text in several for part in _after_commas(text)):
        run, sign, value = (part.strip() for part in one.rpartition("="))
        bare = not sign and value.lstrip("+.")[:1].isdigit()
        if not (bare or (run and value)) or run in result:
            raise typer.BadParameter(
                f"`500 g` for all runs, or each run once as in `ramp=500 g`, not `{one}`", param_hint="--mass"
            )
        result[run] = value
    return result, result.pop("", "")


def _after_commas(text: str) -> list[str]:
    """`a=1 kg,b=2 kg` as two; a comma in a name or in a number (`2,5 kg`) divides nothing."""
    parts = text.split(",")
    return parts if all("=" in part for part in parts) else [text]


def _print(messages: Sequence[str], loaded: DraftFile, out: Path, ranked: bool) -> None:
    """ranked: whether the file lists what was left to the presets by its influence."""
    from smajax.report.preset_words import NO_NUMBER, NOT_LOADED, sentence

    for line in messages:
        say(line)
    for line in loaded.warnings:
        say(f"warning: {line}")
    if loaded.reason:
        typer.echo(f"It cannot be loaded yet: {loaded.reason}")
    if ranked:
        known = NO_NUMBER if loaded.ranking is None else sentence(loaded.ranking, begun=loaded.begun)
        typer.echo(NOT_LOADED if loaded.reason else known)
    typer.echo(f"Written: {out.resolve()}")
    if not loaded.reason:
        typer.echo(
            f"Next: look at its runs and guesses by `smajax check {out}`, then `smajax close-loop {out} --out report`"
        )
