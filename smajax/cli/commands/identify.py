"""`smajax identify`: parameters with error bars."""

from __future__ import annotations

import shlex
from collections.abc import Mapping
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from smajax.cli import completion
from smajax.cli.options import FITS, Json, Open, Overwrite, within
from smajax.cli.terminal import browse, console, resumable, say

if TYPE_CHECKING:
    from smajax.fit.identify_result import Identified


class Presets(StrEnum):
    """What is done with values that the experiment file does not give."""

    HELD = "held"
    FITTED = "fitted"


OWN = ("identify.html", "identify.json", "parameters.csv", "runs.csv", "model.toml", "model.nc", FITS)


def _may_resume(before: Mapping[str, Any], now: Mapping[str, Any]) -> bool:
    """The same settings, or the same with a posterior added."""
    return before == now or before == {**now, "--posterior": 0}


# More than 8 parameters and 80 lines: typer reads the options from them, and their help fills 30 lines.
def identify_command(
    experiment: Annotated[Path, typer.Argument(help="experiment.toml, or the folder that holds it")],
    out: Annotated[Path, typer.Option(help="folder for identify.html and identify.json; fits are cached there")] = Path(
        "identified"
    ),
    starts: Annotated[
        int,
        typer.Option(callback=within(0), help="candidate starting points in the bounds; 0: the declared start alone"),
    ] = 64,
    profile: Annotated[
        str,
        typer.Option(
            help="parameters whose profile likelihood is drawn, with commas, or `all`",
            autocompletion=completion.unknowns_declared,
        ),
    ] = "",
    presets: Annotated[
        Presets,
        typer.Option(
            help="values that the file does not give: held at the preset's, or fitted within what data sheets leave open"
        ),
    ] = Presets.HELD,
    robust: Annotated[bool, typer.Option("--robust", help="Huber's loss: outliers have less weight")] = False,
    design: Annotated[bool, typer.Option("--design", help="suggest the next run")] = False,
    posterior: Annotated[
        int,
        typer.Option(callback=within(0), help="draws of each of 8 Markov chains, 1000 or so; needs the extra `bayes`"),
    ] = 0,
    overwrite: Overwrite = False,
    json_out: Json = False,
    open_page: Open = False,
) -> None:
    """Fit the unknowns of an experiment to its runs, with error bars, and name those that the runs do not determine.

    An effect is part of the model when the experiment names one of its parameters ("latent_heat.enthalpy"). After
    Ctrl-C the same command with the same --out resumes from the cached fits.

    Example:  smajax identify experiment.toml --out identified --profile all --design
    """
    from smajax.core.runtime import prepare

    prepare()
    from smajax.cli.progress_display import displayed
    from smajax.cli.result_folder import FolderTaken, check_path, claimed
    from smajax.core.files import json_text
    from smajax.core.progress import Message
    from smajax.data.experiment.errors import ExperimentError
    from smajax.data.experiment.fingerprint import fingerprint
    from smajax.data.experiment.load import load_experiment
    from smajax.data.model_catalogue import CATALOGUE
    from smajax.fit.experiment_problem import free_by_name
    from smajax.fit.identify import identify
    from smajax.fit.uncertain_presets import with_uncertain_presets
    from smajax.report.identify_page import write_identified
    from smajax.report.identify_record import record
    from smajax.report.narrative import narrated

    check_path(out)
    loaded = load_experiment(experiment, CATALOGUE)
    # The page and the record are of the file, whose bytes say the same of both.
    told = fingerprint(loaded)
    if presets is Presets.FITTED:
        loaded = with_uncertain_presets(loaded)
    unknowns = list(free_by_name(loaded, [run for run in loaded.runs if run.role == "fit"]))
    profiled = unknowns if profile == "all" else [part.strip() for part in profile.split(",") if part.strip()]
    command = f"smajax identify {shlex.quote(str(experiment))} --out {shlex.quote(str(out))} --starts {starts}"
    command += f" --profile {','.join(profiled)}" * bool(profiled) + " --robust" * robust + " --design" * design
    command += f" --posterior {posterior}" * bool(posterior) + " --presets fitted" * (presets is Presets.FITTED)
    # A profile and a design add to the same result, and so does a posterior where there was none: the cached fits are used.
    settings = {**told, "--starts": starts, "--robust": robust, "--posterior": posterior, "--presets": presets.value}
    try:
        with (
            resumable("Fits are cached: the same command resumes.", out, FITS),
            claimed(out, "identify", settings, OWN, overwrite, _may_resume),
            displayed(console(), hint=not json_out) as progress,
        ):
            if any((out / "fits").glob("*.npz")):
                progress(Message(f"Fits cached in {out / 'fits'} are used where they are of the same problem."))
            identified = identify(
                loaded,
                starts=starts,
                profiled=profiled,
                robust=robust,
                design=design,
                draws=posterior,
                memory=out / "fits",
                progress=narrated(progress),
                command=command,
            )
            page = write_identified(identified, out, loaded.path)
    except (FolderTaken, ExperimentError):
        raise
    except ValueError as error:
        raise typer.BadParameter(str(error)) from None
    if json_out:
        typer.echo(json_text(record(identified)), nl=False)
    else:
        _print(identified)
        typer.echo(f"Report: {page.resolve()}")
    if open_page:
        browse(page)


def _print(identified: Identified) -> None:
    """The result for a terminal."""
    from smajax.report.identifiability_words import weak_combinations
    from smajax.report.identify_words import answer, conclusions, estimate_rows, posterior_rows

    typer.echo(f"\n{identified.title or identified.experiment}")
    for sentence in [answer(identified), *conclusions(identified), *weak_combinations(identified.directions)]:
        say(sentence)
    rows = estimate_rows(identified)
    width = max(28, *(len(row[0]) for row in rows))
    for row in rows:
        typer.echo(f"  {row[0]:<{width}} {row[1]} {row[2]}" + (f"  ({row[-1]})" if row[-1] else ""))
    for row in posterior_rows(identified):
        value = f"{row[1]} {row[2]}".strip()
        typer.echo(f"  posterior: {row[0]:<{width}} {value}, 95 % {row[3]}, R-hat {row[4]}, {row[5]} independent draws")
    for suggestion in identified.suggestions[:1]:
        typer.echo(f"  Next run: {suggestion.what}")
