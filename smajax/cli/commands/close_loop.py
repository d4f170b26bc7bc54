"""`smajax close-loop`: from measured runs to the missing effect."""

from __future__ import annotations

import json
import shlex
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from smajax.cli import completion
from smajax.cli.options import FITS, UNMET, Json, Open, Overwrite, quantity
from smajax.cli.terminal import browse, console, resumable, say
from smajax.core.worker_process import OF_ATTRIBUTION, worker_process

if TYPE_CHECKING:
    from smajax.attribution.findings import Findings
    from smajax.data.experiment.record import Experiment

FINISHED_FITS = "Finished fits are cached: the same command resumes."
CONTROL = ("*_gains.json", "control_*.json", "control_*.html")
RECORD = "report.json"
MODELS = ("model.toml", "model.nc", "base_model.toml", "base_model.nc")
OWN = ("report.html", "report.json", "parameters.csv", "runs.csv", *MODELS, *CONTROL, FITS)


def load(experiment: Path) -> Experiment:
    """The experiment with its runs. Raises ExperimentError."""
    # Imported here so that `--help` does not wait for JAX; x64 is the caller's choice, and this is the caller.
    from smajax.core.runtime import collect_rarely, prepare

    prepare()
    collect_rarely()
    from smajax.data.open_experiment import open_experiment

    return open_experiment(experiment)


def run_close_loop(
    loaded: Experiment, out: Path, command: str, overwrite: bool, show_hint: bool
) -> tuple[Findings, Path]:
    """The findings and the path of their page, in the folder `out`. Raises FolderTaken."""
    from smajax.attribution.close_loop import close_loop
    from smajax.attribution.config import AttributionConfig
    from smajax.attribution.findings import Remaining
    from smajax.cli.budget import first_page
    from smajax.cli.progress_display import displayed
    from smajax.cli.result_folder import claimed
    from smajax.cli.written_beside import written_beside
    from smajax.data.experiment.fingerprint import fingerprint
    from smajax.report.narrative import narrated
    from smajax.report.write import write_report

    with (
        resumable(FINISHED_FITS, out, FITS),
        claimed(out, "close-loop", fingerprint(loaded), OWN, overwrite),
        displayed(console(), show_hint) as progress,
    ):
        in_words = narrated(progress, loaded.output_unit, loaded.output_name)
        shown = _rounds_shown(out)

        with written_beside(write_report, out, loaded.path) as begin_page:

            def interim(known: Findings) -> float:
                # A loop that resumes knows less at first than the page of the one that was stopped.
                # The second process makes programs during the search, in seconds; later it may be at a stage for minutes.
                apart = known.remaining is Remaining.SEARCH
                return begin_page(known, apart) if len(known.rounds) >= shown else 0.0

            config = AttributionConfig(first_page=first_page(AttributionConfig.first_page))
            findings = close_loop(
                loaded, memory=out / "fits", progress=in_words, command=command, config=config, interim=interim
            )
        return findings, write_report(findings, out, loaded.path)


def _rounds_shown(out: Path) -> int:
    """Rounds of the search on the page that is in the folder."""
    try:
        return len(json.loads((out / RECORD).read_text(encoding="utf-8"))["rounds"])
    except (OSError, ValueError, KeyError, TypeError):
        return 0


def print_findings(findings: Findings, page: Path) -> None:
    from smajax.attribution.verdict import unknowns_at_bounds
    from smajax.core.wording import verdict_text
    from smajax.report.narrative import narrate
    from smajax.report.narrative.verdict import doubt

    at_bounds = (*findings.coefficients_at_bounds, *unknowns_at_bounds(findings))
    said = verdict_text(findings.verdict, at_bounds, doubt=doubt(findings))
    _print_answer(findings.title, said, narrate(findings).summary, page)


def _print_answer(title: str, verdict: str, summary: Sequence[str], page: Path) -> None:
    typer.echo(f"\n{title}\nVerdict: {verdict}")
    for sentence in summary:
        say(sentence)
    typer.echo(f"Report: {page.resolve()}")


def _within(seconds: float, out: Path, json_out: bool) -> None:
    """The command without --budget, ended in that time; then the page says what is known. Exits with 3 where it was ended."""
    from smajax.cli.budget import run_within, without
    from smajax.cli.result_folder import MARK
    from smajax.core.wording import verdict_text

    shown, mark = out / RECORD, out / MARK
    before, claimed_before = _written(shown), _written(mark)
    code = run_within(seconds, without(sys.argv[1:], "--budget"))
    if code is not None:
        raise typer.Exit(code)
    resumes = "the same command resumes from the finished fits"
    now = _written(shown)  # none where --overwrite has deleted it
    anew = now is not None and now != before
    # A folder is claimed for one experiment: the page that was in it is of an earlier run of the same.
    same = now is not None and _written(mark) != claimed_before
    if not anew and not same:
        page = f"the page in {out} is of an earlier run" if shown.is_file() else "there is no page"
        if not any(out.glob(FITS)):
            resumes = "nothing was finished, so that the same command starts from the beginning: give it more time"
        typer.echo(f"The time was over before this run had a result to show: {page}, and {resumes}.", err=True)
        raise typer.Exit(UNMET)
    known = json.loads(shown.read_text(encoding="utf-8"))
    if json_out:
        typer.echo(json.dumps(known))
    else:
        at_bounds = [*known.get("coefficients_at_bounds", []), *known.get("unknowns_at_bounds", [])]
        said = verdict_text(known["verdict"], at_bounds, doubt=known.get("held_out_runs", ""))
        _print_answer(known["title"], said, known["summary"], out / "report.html")
    if anew:
        still = f"The time was over before: {known['remaining'] or 'the controllers were tuned'}"
    else:
        still = "The time was over before this run knew more than the earlier one, of which that is"
    typer.echo(f"{still}; {resumes}.", err=True)
    raise typer.Exit(UNMET)


def _written(path: Path) -> int | None:
    """When a file was written, ns; None where there is none."""
    return path.stat().st_mtime_ns if path.is_file() else None


def tune_on_models(
    findings: Findings,
    out: Path,
    controller: str,
    set_points: Sequence[float],
    command: str,
    truth: Path | None = None,
    quick: bool = False,
) -> Path:
    """Tune a controller on both models of the findings and judge the gains on the extended one, or on `truth`; the path of the page.

    `quick`: a search that takes half a minute, for a demonstration. Raises typer.BadParameter for a controller that this load cannot have, or set points that it cannot reach.
    """
    from smajax.cli.progress_display import displayed
    from smajax.control.tuned_on_models import QUICK, tuned_on_models
    from smajax.data.model_file.read import load_model
    from smajax.report.tuned_on_models_page import conclusions, write_comparison

    base, extended = findings.base_model, findings.extended_model
    if base is None or extended is None:
        raise typer.BadParameter(
            "the findings have no models to tune on: the base model was not fitted.", param_hint="--tune"
        )
    models = (
        {"base model": base, "extended model": extended} if extended.effects != base.effects else {"base model": base}
    )
    plant = ("extended model", extended) if truth is None else ("true model", load_model(truth))
    effort = QUICK if quick else None
    try:
        with resumable(), displayed(console(), hint=False) as progress:
            result = tuned_on_models(models, plant, controller, set_points, effort=effort, progress=progress)
    except (KeyError, ValueError) as error:
        raise typer.BadParameter(str(error.args[0]), param_hint="--tune") from None
    for sentence in conclusions(result):
        say(sentence, err=True)
    return write_comparison(result, out, command)


def check_tuning(loaded: Experiment, controller: str, set_points: str) -> tuple[float, ...]:
    """The set points in the unit that is shown, before anything is fitted. Raises typer.BadParameter."""
    from smajax.cli.options import numbers
    from smajax.control.position_unit import unit_of
    from smajax.control.presets import check_controller
    from smajax.control.signal_path import check_set_points
    from smajax.fit.base_model import base_model

    system = base_model(loaded)
    try:
        check_controller(controller, system)
        unit = unit_of(system)
    except (KeyError, ValueError) as error:
        raise typer.BadParameter(str(error.args[0]), param_hint="--tune") from None
    if not set_points:
        return ()
    found = numbers("--set-points", set_points, unit.shown)
    try:
        check_set_points(system, found)
    except ValueError as error:
        raise typer.BadParameter(str(error), param_hint="--set-points") from None
    return found


def close_loop_command(
    experiment: Annotated[Path, typer.Argument(help="experiment.toml, or the folder that holds it")],
    out: Annotated[
        Path,
        typer.Option(help="folder for report.html, report.json, its tables as CSV; finished fits are cached there too"),
    ] = Path("report"),
    tune: Annotated[
        str,
        typer.Option(
            help="then tune this controller on the extended model, and compare with gains tuned on the base model",
            autocompletion=completion.controllers,
        ),
    ] = "",
    set_points: Annotated[
        str,
        typer.Option(
            "--set-points",
            "--set-point",
            help="of --tune, with commas, without a unit in deg or mm; default three over what the models reach",
        ),
    ] = "",
    budget: Annotated[
        float | None,
        quantity("end in this time with what is known by then", "s", above=0.0, like="2min"),
    ] = None,
    overwrite: Overwrite = False,
    json_out: Json = False,
    open_page: Open = False,
) -> None:
    """Fit the base model, find the physical effects that it lacks, and report the error before and after.

    The page is there after the base fit, and is written again after the search and in the end. After Ctrl-C, and where --budget was
    too short (exit code 3), the same command with the same --out resumes from the finished fits.

    Example:  smajax close-loop experiment.toml --out report

    Example:  smajax close-loop experiment.toml --out report --tune pid --set-points 5mm,10mm
    """
    if set_points and not tune:
        raise typer.BadParameter("are those of a controller to be tuned: give --tune too.", param_hint="--set-points")
    if budget is not None:
        _within(budget, out, json_out)
        return
    from smajax.cli.result_folder import check_path

    check_path(out)
    command = f"smajax close-loop {shlex.quote(str(experiment))} --out {shlex.quote(str(out))}"
    with worker_process(OF_ATTRIBUTION):  # it starts while this one imports and reads
        loaded = load(experiment)
        targets = check_tuning(loaded, tune, set_points) if tune else ()
        findings, page = run_close_loop(loaded, out, command, overwrite, not json_out)
    if json_out:
        from smajax.report.json_file import findings_to_json

        typer.echo(json.dumps(findings_to_json(findings)))
    else:
        print_findings(findings, page)
    if tune:
        points = f" --set-points {shlex.quote(set_points)}" if set_points else ""
        shown = tune_on_models(findings, out, tune, targets, f"{command} --tune {tune}{points}")
        typer.echo(f"Controller: {shown.resolve()}", err=json_out)
    if open_page:
        browse(page)
