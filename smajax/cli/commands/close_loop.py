"""`smajax close-loop` and `smajax demo`: from measured runs to the missing effect."""

from __future__ import annotations

import json
import shlex
from importlib import resources
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from smajax.cli import completion
from smajax.cli.options import (
    DEMOS,
    FITS,
    Json,
    Open,
    Overwrite,
    browse,
    console,
    resumable,
)

if TYPE_CHECKING:
    from smajax.attribution.findings import Findings

FINISHED_FITS = "Finished fits are kept: the same command goes on from there."
OWN = ("report.html", "report.json", "parameters.csv", "runs.csv", FITS)


def _loop(experiment: Path, out: Path, command: str, overwrite: bool, hint: bool) -> tuple[Findings, Path]:
    # Imported here so that `--help` does not wait for JAX; x64 is the caller's choice, and this is the caller.
    from smajax.core.runtime import prepare

    prepare()
    from smajax.attribution.close_loop import close_loop
    from smajax.cli.progress_display import displayed
    from smajax.cli.result_folder import check_path, claimed
    from smajax.data.experiment.fingerprint import asked_of
    from smajax.data.experiment.load import load_experiment
    from smajax.data.model_catalogue import CATALOGUE
    from smajax.report.narrative import narrated
    from smajax.report.write import write_report

    check_path(out)
    loaded = load_experiment(experiment, CATALOGUE)
    with (
        resumable(FINISHED_FITS, out, FITS),
        claimed(out, "close-loop", asked_of(loaded), OWN, overwrite),
        displayed(console(), hint) as progress,
    ):
        in_words = narrated(progress, loaded.output_unit, loaded.output_name)
        findings = close_loop(loaded, memory=out / "fits", progress=in_words, command=command)
        return findings, write_report(findings, out)


def _say(findings: Findings, page: Path) -> None:
    from smajax.report.narrative import narrate

    typer.echo(f"\n{findings.title}\nVerdict: {findings.verdict}")
    for sentence in narrate(findings).summary:
        typer.echo(f"  {sentence}")
    typer.echo(f"Report: {page.resolve()}")


def close_loop_command(
    experiment: Annotated[Path, typer.Argument(help="experiment.toml, or the folder that holds it")],
    out: Annotated[
        Path,
        typer.Option(help="folder for report.html, report.json, its tables as CSV; finished fits are kept there too"),
    ] = Path("report"),
    overwrite: Overwrite = False,
    json_out: Json = False,
    open_page: Open = False,
) -> None:
    """Fit the base model, find what it lacks, add it, and report the error before and after.

    A few minutes where little is missing, half an hour where several effects are. Ctrl-C loses nothing: the same command with
    the same --out goes on from the fits that are finished.

    Example:  smajax close-loop experiment.toml --out report
    """
    command = f"smajax close-loop {shlex.quote(str(experiment))} --out {shlex.quote(str(out))}"
    findings, page = _loop(experiment, out, command, overwrite, not json_out)
    if json_out:
        from smajax.report.json_file import findings_to_json

        typer.echo(json.dumps(findings_to_json(findings)))
    else:
        _say(findings, page)
    if open_page:
        browse(page)


def demo(
    out: Annotated[Path, typer.Option(help="folder for the reports")] = Path("demo-report"),
    only: Annotated[
        str | None, typer.Option(help=f"one of {', '.join(DEMOS)}", autocompletion=completion.demos)
    ] = None,
    overwrite: Overwrite = False,
    json_out: Json = False,
    open_page: Open = False,
) -> None:
    """The main job on two virtual benches shipped with the package: one lacks an effect, the other lacks nothing.

    Each bench was made by a simulator that shares no code with this one; what it really contains lies in truth.toml,
    which the loop does not read and which is printed after each verdict.

    Example:  smajax demo --only latent --out demo-report
    """
    if only is not None and only not in DEMOS:
        raise typer.BadParameter(f"there is no demo `{only}`; choose one of {', '.join(DEMOS)}.", param_hint="--only")
    pages: list[Path] = []
    records = {}
    for name in DEMOS if only is None else (only,):
        with resources.as_file(resources.files("smajax") / "data" / "demo" / name) as folder:
            if not json_out:
                typer.echo(f"\n=== {name} ===")
            findings, page = _loop(
                folder / "experiment.toml", out / name, f"smajax demo --only {name}", overwrite, not (json_out or pages)
            )
            if json_out:
                from smajax.report.json_file import findings_to_json

                records[name] = findings_to_json(findings)
            else:
                _say(findings, page)
                typer.echo("The truth, which the loop did not read:")
                for line in (folder / "truth.toml").read_text(encoding="utf-8").splitlines():
                    typer.echo(f"  {line}")
        pages.append(page)
    if json_out:
        typer.echo(json.dumps(records))
    if open_page:
        for page in pages:
            browse(page)
