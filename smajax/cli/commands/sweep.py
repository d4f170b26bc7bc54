"""`smajax sweep`: robustness of the controllers of the arm."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from smajax.cli import completion
from smajax.cli.options import (
    Json,
    Open,
    Overwrite,
    alone,
    browse,
    command_line,
    console,
    numbers,
    quantity,
    resumable,
    understood,
    within,
)

SET_POINTS, GAINS = "-40,-20,0,10,20,40,50,60,80", "0.5,0.7,1,1.4,2"


def sweep(
    controllers: Annotated[
        str | None,
        typer.Option(
            help="pid, vsc1, vsc2, vsc3, nvsc, sld, backstepping1, backstepping2 (with commas), or `all`; default all, "
            "or those of the gains files",
            autocompletion=completion.several_controllers,
        ),
    ] = None,
    over: Annotated[
        str,
        typer.Option(
            help="the two mismatches of the maps, or one of curves; names alone: each goes from -50% to +100%",
            autocompletion=completion.mismatches,
        ),
    ] = "convection,damping",
    points: Annotated[
        int | None,
        typer.Option(
            callback=within(2),
            help="mismatches from 0.5 to 2 times (-50% to +100%) along each side of a map; default 15",
        ),
    ] = None,
    set_points: Annotated[
        str | None, typer.Option(help=f"with commas, {alone('deg')}; default -40,-20,0,10,20,40,50,60,80")
    ] = None,
    gains: Annotated[
        list[Path] | None,
        typer.Option(help="gains.json of `smajax tune`, in the place of the preset's; may be repeated"),
    ] = None,
    gain_shares: Annotated[
        str | None, typer.Option(help="shares of the controller's main gain; default 0.5,0.7,1,1.4,2")
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
    out: Annotated[
        Path,
        typer.Option(
            help="folder for index.html, the pictures, sweep.json, sweep.nc (every loop) and a CSV a controller"
        ),
    ] = Path("sweep"),
    fast: Annotated[
        bool, typer.Option("--fast", help="by default 3 x 3 mismatches, set points -20,20,60, gain 1")
    ] = False,
    overwrite: Overwrite = False,
    json_out: Json = False,
    open_page: Open = False,
) -> None:
    """Run controllers of the arm on plants that are not what they believe, and compare them on every set point.

    Ctrl-C loses nothing: the same command goes on.

    What may be wrong of a plant: inertia (inertia_ratio), damping, convection (convection_coefficient), ambient
    (ambient_temperature, in degC), payload (payload_mass), supply (amplifier_gain). +20% is that much more than the
    controller believes (of 20 degC: 24 degC), -50% half of it, and 20% of a variation both ways.

    Example:  smajax sweep --controllers pid,sld --over convection,ambient --out sweep
    """
    from smajax.core.runtime import prepare

    prepare(cores=True)
    from smajax.cli.progress_display import displayed
    from smajax.cli.result_folder import FolderTaken, claimed
    from smajax.control.gains_file import GainsFileError, read_gains
    from smajax.control.mismatch import short_name
    from smajax.control.presets import CONTROLLERS
    from smajax.control.sweep import check_mismatches
    from smajax.model.rigs import arm
    from smajax.report.sweep_folder import SweepSettings, as_text, files_of, goes_on, run_sweep

    try:
        tuned = tuple(read_gains(path, arm()) for path in gains or ())
    except GainsFileError as error:
        hint = " Shares of the main gain are `--gain-shares`." if any(not one.suffix for one in gains or ()) else ""
        raise typer.BadParameter(f"{error}{hint}", param_hint="--gains") from None
    asked = controllers or ",".join(dict.fromkeys(one.controller for one in tuned)) or "all"
    named = [part.strip() for part in asked.split(",")]
    names = tuple(CONTROLLERS) if named == ["all"] else tuple(dict.fromkeys(part for part in named if part))
    first, _, second = (part.strip() for part in over.strip(" ,").partition(","))
    if "=" in over:
        raise typer.BadParameter(
            f"names alone, as in `convection,damping`, not `{over}`: each goes from -50% to +100% in --points steps.",
            param_hint="--over",
        )
    if not first or "," in second:
        raise typer.BadParameter(f"one mismatch, or two with a comma between them, not `{over}`", param_hint="--over")
    first, second = short_name(first), short_name(second)
    try:
        check_mismatches(first, second)
    except ValueError as error:
        raise typer.BadParameter(str(error), param_hint="--over") from None
    settings = SweepSettings(
        names,
        first,
        second,
        points or (3 if fast else 15),
        numbers("--set-points", set_points if set_points is not None else "-20,20,60" if fast else SET_POINTS, "deg"),
        numbers("--gain-shares", gain_shares if gain_shares is not None else "1" if fast else GAINS),
        seconds,
        filtered=estimator,
        noise=noise,
        period=period,
        delay=delay,
        tuned=tuned,
    )
    for told in (
        understood("Set points", set_points, settings.set_points, "deg"),
        understood("Shares of the main gain", gain_shares, settings.gains),
    ):
        if told and not json_out:
            typer.echo(told, err=True)
    kept = "Finished controllers are kept: the same command goes on."
    record, own = settings.record(), files_of(names)
    try:
        with (
            resumable(kept, out, "finished/*.npz"),
            claimed(out, "sweep", record, own, overwrite, goes_on),
            displayed(console(), hint=not json_out) as progress,
        ):
            rows = run_sweep(arm(), settings, out, progress, command_line())
    except FolderTaken:
        raise
    except ValueError as error:
        raise typer.BadParameter(str(error)) from None
    page = out / "index.html"
    if json_out:
        typer.echo((out / "sweep.json").read_text(encoding="utf-8"), nl=False)
    else:
        typer.echo(as_text(rows))
        typer.echo(f"Page: {page.resolve()}")
    if open_page:
        browse(page)
