"""`smajax close-loop`: from measured runs to the missing effect."""

from __future__ import annotations

import json
import shlex
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from smajax.cli.options import FITS, Json, Open, Overwrite
from smajax.cli.terminal import browse, console, resumable

if TYPE_CHECKING:
    from smajax.attribution.findings import Findings

FINISHED_FITS = "Finished fits are cached: the same command resumes."
MODELS = ("model.toml", "model.nc", "base_model.toml", "base_model.nc")
OWN = ("report.html", "report.json", "parameters.csv", "runs.csv", *MODELS, FITS)


def run_close_loop(
    experiment: Path, out: Path, command: str, overwrite: bool, show_hint: bool
) -> tuple[Findings, Path]:
    # Imported here so that `--help` does not wait for JAX; x64 is the caller's choice, and this is the caller.
    from smajax.core.runtime import prepare

    prepare()
    from smajax.attribution.close_loop import close_loop
    from smajax.cli.progress_display import displayed
    from smajax.cli.result_folder import check_path, claimed
    from smajax.data.experiment.fingerprint import fingerprint
    from smajax.data.experiment.load import load_experiment
    from smajax.data.model_catalogue import CATALOGUE
    from smajax.report.narrative import narrated
    from smajax.report.write import write_report

    check_path(out)
    loaded = load_experiment(experiment, CATALOGUE)
    with (
        resumable(FINISHED_FITS, out, FITS),
        claimed(out, "close-loop", fingerprint(loaded), OWN, overwrite),
        displayed(console(), show_hint) as progress,
    ):
        in_words = narrated(progress, loaded.output_unit, loaded.output_name)
        findings = close_loop(loaded, memory=out / "fits", progress=in_words, command=command)
        return findings, write_report(findings, out)


def print_findings(findings: Findings, page: Path) -> None:
    from smajax.report.narrative import narrate

    typer.echo(f"\n{findings.title}\nVerdict: {findings.verdict}")
    for sentence in narrate(findings).summary:
        typer.echo(f"  {sentence}")
    typer.echo(f"Report: {page.resolve()}")


def close_loop_command(
    experiment: Annotated[Path, typer.Argument(help="experiment.toml, or the folder that holds it")],
    out: Annotated[
        Path,
        typer.Option(help="folder for report.html, report.json, its tables as CSV; finished fits are cached there too"),
    ] = Path("report"),
    overwrite: Overwrite = False,
    json_out: Json = False,
    open_page: Open = False,
) -> None:
    """Fit the base model, find the physical effects that it lacks, and report the error before and after.

    It takes a few minutes where little is missing, half an hour where several effects are. After Ctrl-C the same command with the
    same --out resumes from the finished fits.

    Example:  smajax close-loop experiment.toml --out report
    """
    command = f"smajax close-loop {shlex.quote(str(experiment))} --out {shlex.quote(str(out))}"
    findings, page = run_close_loop(experiment, out, command, overwrite, not json_out)
    if json_out:
        from smajax.report.json_file import findings_to_json

        typer.echo(json.dumps(findings_to_json(findings)))
    else:
        print_findings(findings, page)
    if open_page:
        browse(page)
