"""`smajax identify`: parameters with error bars."""

from __future__ import annotations

import shlex
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any

import typer

from smajax.cli import completion
from smajax.cli.options import FITS, Json, Open, Overwrite, browse, console, resumable, within

OWN = ("identify.html", "identify.json", "parameters.csv", "runs.csv", FITS)


def _goes_on(before: Mapping[str, Any], asked: Mapping[str, Any]) -> bool:
    """The same work, or the same with a posterior added."""
    return before == asked or before == {**asked, "--posterior": 0}


def identify_command(
    experiment: Annotated[Path, typer.Argument(help="experiment.toml, or the folder that holds it")],
    out: Annotated[
        Path, typer.Option(help="folder for identify.html and identify.json; fits are kept there as they go")
    ] = Path("identified"),
    starts: Annotated[
        int, typer.Option(callback=within(0), help="points of the box that fits may start from; 0: as declared")
    ] = 64,
    profile: Annotated[
        str,
        typer.Option(
            help="parameters to draw a profile of, with commas, or `all`", autocompletion=completion.unknowns_declared
        ),
    ] = "",
    robust: Annotated[bool, typer.Option("--robust", help="Huber's loss: samples far off count less")] = False,
    design: Annotated[bool, typer.Option("--design", help="say which run to do next")] = False,
    posterior: Annotated[
        int,
        typer.Option(callback=within(0), help="draws of each of 8 Markov chains, 1000 or so; needs the extra `bayes`"),
    ] = 0,
    overwrite: Overwrite = False,
    json_out: Json = False,
    open_page: Open = False,
) -> None:
    """Fit the unknowns of an experiment to its runs, with error bars, and say what the runs cannot tell.

    An effect is part of the model when the experiment names one of its parameters ("latent_heat.enthalpy"). Ctrl-C loses
    nothing: the same command with the same --out goes on from the fits as they were.

    Example:  smajax identify experiment.toml --out identified --profile all --design
    """
    from smajax.core.runtime import prepare

    prepare()
    from smajax.cli.progress_display import displayed
    from smajax.cli.result_folder import FolderTaken, check_path, claimed
    from smajax.core.files import json_text
    from smajax.core.progress import Message
    from smajax.data.experiment.errors import ExperimentError
    from smajax.data.experiment.fingerprint import asked_of
    from smajax.data.experiment.load import load_experiment
    from smajax.data.model_catalogue import CATALOGUE
    from smajax.fit.experiment_problem import free_by_name
    from smajax.fit.identify import identify
    from smajax.report.identify_page import write_identified
    from smajax.report.identify_record import record
    from smajax.report.identify_words import conclusions, estimate_rows, posterior_rows

    check_path(out)
    loaded = load_experiment(experiment, CATALOGUE)
    unknowns = list(free_by_name(loaded, [run for run in loaded.runs if run.role == "fit"]))
    profiled = unknowns if profile == "all" else [part.strip() for part in profile.split(",") if part.strip()]
    command = f"smajax identify {shlex.quote(str(experiment))} --out {shlex.quote(str(out))} --starts {starts}"
    command += f" --profile {','.join(profiled)}" * bool(profiled) + " --robust" * robust + " --design" * design
    command += f" --posterior {posterior}" * bool(posterior)
    # A profile and a design add to the same result, and so does a posterior where there was none: the fits serve again.
    asked = {**asked_of(loaded), "--starts": starts, "--robust": robust, "--posterior": posterior}
    kept = "Fits are kept as they go: the same command goes on from there."
    try:
        with (
            resumable(kept, out, FITS),
            claimed(out, "identify", asked, OWN, overwrite, _goes_on),
            displayed(console(), hint=not json_out) as progress,
        ):
            if any((out / "fits").glob("*.npz")):
                progress(Message(f"Fits kept in {out / 'fits'} are gone on with where they are of the same work."))
            found = identify(
                loaded,
                starts=starts,
                profiled=profiled,
                robust=robust,
                design=design,
                draws=posterior,
                memory=out / "fits",
                progress=progress,
                command=command,
            )
            page = write_identified(found, out)
    except (FolderTaken, ExperimentError):
        raise
    except ValueError as error:
        raise typer.BadParameter(str(error)) from None
    if json_out:
        typer.echo(json_text(record(found)), nl=False)
    else:
        typer.echo(f"\n{found.title or found.experiment}")
        for sentence in [*conclusions(found), *found.weak]:
            typer.echo(f"  {sentence}")
        rows = estimate_rows(found)
        wide = max(28, *(len(row[0]) for row in rows))
        for row in rows:
            typer.echo(f"  {row[0]:<{wide}} {row[1]} {row[2]}" + (f"  ({row[-1]})" if row[-1] else ""))
        for row in posterior_rows(found):
            value = f"{row[1]} {row[2]}".strip()
            typer.echo(
                f"  posterior: {row[0]:<{wide}} {value}, 95 % {row[3]}, R-hat {row[4]}, {row[5]} independent draws"
            )
        for one in found.suggestions[:1]:
            typer.echo(f"  Next run: {one.what}")
        typer.echo(f"Report: {page.resolve()}")
    if open_page:
        browse(page)
