"""`smajax tune`: gains by gradient."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from smajax.cli import completion
from smajax.cli.options import (
    UNMET,
    Json,
    Open,
    Overwrite,
    alone,
    browse,
    command_line,
    console,
    numbers,
    pairs,
    quantity,
    resumable,
    texts,
    understood,
    within,
)

TUNED_AT = "-40,-20,0,20,40,60,85"


def tune(
    controller: Annotated[
        str,
        typer.Argument(
            help="pid, vsc1, vsc2, vsc3, nvsc, sld, backstepping1 or backstepping2",
            autocompletion=completion.controllers,
        ),
    ],
    set_points: Annotated[
        str | None, typer.Option(help=f"with commas, {alone('deg')}; default -40,-20,0,20,40,60,85")
    ] = None,
    variation: Annotated[
        list[str] | None,
        typer.Option(
            help="how wrong the plant may be: damping=20%,payload=50% (or 0.2, 0.5) of what the controller believes, both ways; "
            "may be repeated",
            autocompletion=completion.shares_of_mismatches,
        ),
    ] = None,
    objective: Annotated[
        str, typer.Option(help="nominal, worst or mean-variance", autocompletion=completion.objectives)
    ] = "worst",
    weights: Annotated[
        list[str] | None,
        typer.Option(
            help="of tracking_error, overshoot, settling_time, steady_error, energy, chatter, peak_temperature; default "
            "settling_time=1,overshoot=1,steady_error=2 (a second, a degree, half a degree)",
            autocompletion=completion.terms,
        ),
    ] = None,
    limits: Annotated[
        list[str] | None,
        typer.Option(
            help="of the same, met in every loop: settling_time=4,overshoot=2deg; in s, deg, J, V/s or degC where it says no unit",
            autocompletion=completion.terms,
        ),
    ] = None,
    by: Annotated[str, typer.Option(help="trust-region or adam", autocompletion=completion.rules)] = "trust-region",
    start: Annotated[
        Path | None, typer.Option(help="gains.json to begin from, in the place of the preset's gains")
    ] = None,
    starts: Annotated[
        int | None, typer.Option(callback=within(1), help="points that gains are moved from; default 6")
    ] = None,
    rounds: Annotated[int | None, typer.Option(callback=within(1), help="steps, at most; default 30")] = None,
    finish: Annotated[
        int | None,
        typer.Option(
            callback=within(0),
            help="generations of a search without slopes (CMA-ES) after that, 24 candidates each; default 60, 0 for none",
        ),
    ] = None,
    seconds: Annotated[float, quantity("length of each closed loop", "s", 0.1, 86_400.0)] = 10.0,
    estimator: Annotated[
        str,
        typer.Option(
            help="`printed` or `model` filter; none: told the true state", autocompletion=completion.estimators
        ),
    ] = "",
    noise: Annotated[float, quantity("noise of the angle's readings (1 sigma)", "deg", 0.0, 360.0)] = 0.0,
    period: Annotated[float, quantity("sample time of the controller, a multiple of 10 ms", "s")] = 0.01,
    delay: Annotated[int, typer.Option(callback=within(0), help="control periods until a command arrives")] = 0,
    seed: Annotated[int, typer.Option(callback=within(0), help="of starts, plants and noise")] = 0,
    out: Annotated[Path, typer.Option(help="folder for gains.json, the page, the pictures and the numbers")] = Path(
        "tune"
    ),
    fast: Annotated[
        bool, typer.Option("--fast", help="by default set points -20,20,60, 3 starts, 10 rounds, 10 generations")
    ] = False,
    overwrite: Overwrite = False,
    json_out: Json = False,
    open_page: Open = False,
) -> None:
    """Tune the gains of a controller of the arm, on many set points and plants at once: by gradient, then without slopes.

    Each loop is one step from the start, cold and at rest; moves between the set points are tried in the end and told.
    The gains are checked on plants and set points that tuning never saw. `smajax sweep --gains tune/gains.json` reads them.
    Exit code 3 when a limit is not met. Ctrl-C loses the round or generation under way alone: the same command goes on.

    What may be wrong of a plant: inertia (inertia_ratio), damping, convection (convection_coefficient), ambient
    (ambient_temperature, in degC), payload (payload_mass), supply (amplifier_gain). +20% is that much more than the
    controller believes (of 20 degC: 24 degC), -50% half of it, and 20% of a variation both ways.

    Example:  smajax tune sld --variation inertia=20%,damping=20%,convection=20% --limits settling_time=4,overshoot=2
    """
    from smajax.core.runtime import prepare

    prepare(cores=True)
    from smajax.cli.progress_display import displayed
    from smajax.cli.result_folder import FolderTaken, claimed
    from smajax.control.gains_file import GainsFileError, read_gains
    from smajax.control.mismatch import variation_of
    from smajax.control.tune.objective import REGULATION
    from smajax.control.tune.scenarios import check_variation
    from smajax.control.tune.settings import TuneSettings
    from smajax.control.tune.terms import TERMS
    from smajax.model.rigs import arm
    from smajax.report.tune_folder import OURS, STATE, ended, tune_into
    from smajax.report.tune_page import gain_rows, record

    try:
        begun = read_gains(start, arm()) if start is not None else None
        if begun is not None and begun.controller != controller:
            raise GainsFileError(f"gains file {start} is of {begun.controller}, not of {controller}.")
    except GainsFileError as error:
        raise typer.BadParameter(str(error), param_hint="--start") from None
    try:
        varied = variation_of(texts("--variation", variation, "damping=20%,payload=50%"))
        check_variation(varied)
    except ValueError as error:
        raise typer.BadParameter(str(error), param_hint="--variation") from None
    settings = TuneSettings(
        controller,
        numbers("--set-points", set_points if set_points is not None else "-20,20,60" if fast else TUNED_AT, "deg"),
        varied,
        objective,
        pairs("--weights", weights, {}, "settling_time=1,overshoot=1") or dict(REGULATION),
        pairs("--limits", limits, {name: term.unit for name, term in TERMS.items()}, "settling_time=4,overshoot=2deg"),
        8 if fast else 32,
        starts or (3 if fast else 6),
        rounds or (10 if fast else 30),
        by,
        (10 if fast else 60) if finish is None else finish,
        seconds,
        estimator,
        noise,
        period,
        delay,
        seed,
        4 if fast else 32,
        {} if begun is None else begun.values,
    )
    understood_as = understood("Set points", set_points, settings.set_points, "deg")
    if understood_as and not json_out:
        typer.echo(understood_as, err=True)
    kept = "Finished rounds are kept: the same command goes on."
    asked = {"tuning": controller}  # what else was asked lies in a file of the tuning's own, which it checks
    try:
        settings.check(arm())
        with (
            resumable(kept, out, STATE),
            claimed(out, "tune", asked, sorted(OURS), overwrite),
            displayed(console(), hint=not json_out) as progress,
        ):
            told = ended(arm(), settings, out)
            if told is None:
                told = record(tune_into(arm(), settings, out, command_line(), progress), command_line())
    except FolderTaken:
        raise
    except ValueError as error:
        raise typer.BadParameter(str(error)) from None
    page = out / "tune.html"
    for sentence in told["price"]:
        typer.echo(sentence, err=True)
    if json_out:
        typer.echo((out / "tune.json").read_text(encoding="utf-8"), nl=False)
    else:
        for sentence in told["conclusions"]:
            if sentence not in told["price"]:  # said already
                typer.echo(sentence)
        for row in gain_rows(told["gains"]):
            typer.echo(f"  {row[0]:<24} {row[1]:>10} -> {row[2]:<10} {row[3]}" + (f"  ({row[5]})" if row[5] else ""))
        typer.echo(f"Gains: {(out / 'gains.json').resolve()}")
        typer.echo(f"Page: {page.resolve()}")
    if open_page:
        browse(page)
    if settings.limits and not told["limits_met"]:
        raise typer.Exit(UNMET)
