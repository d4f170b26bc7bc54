"""`smajax sweep`: robustness of the controllers of the arm."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from smajax.cli import completion
from smajax.cli.options import (
    Finely,
    Json,
    Open,
    Overwrite,
    alone,
    numbers,
    quantity,
    tolerance_of,
    understood,
    within,
)
from smajax.cli.terminal import browse, command_line, console, resumable

if TYPE_CHECKING:
    from smajax.control.sweep.run_sweep import SweepSettings

SET_POINTS, GAINS = "-40,-20,0,10,20,40,50,60,80", "0.5,0.7,1,1.4,2"


@dataclass(frozen=True)
class _Options:
    """Options of `sweep` as typed, where more than one decides."""

    controllers: str | None
    over: str
    points: int | None
    set_points: str | None
    gain_files: tuple[Path, ...]
    gain_ratios: str | None
    fast: bool

    def mismatches(self) -> tuple[str, str]:
        """Both names of --over, "" for the second where there is one alone. Raises typer.BadParameter."""
        from smajax.control.mismatch import short_name
        from smajax.control.sweep.grid import check_mismatches

        first, _, second = (part.strip() for part in self.over.strip(" ,").partition(","))
        if "=" in self.over:
            raise typer.BadParameter(
                f"names alone, as in `convection,damping`, not `{self.over}`: each goes from -50% to +100% in --points steps.",
                param_hint="--over",
            )
        if not first or "," in second:
            raise typer.BadParameter(
                f"one mismatch, or two with a comma between them, not `{self.over}`", param_hint="--over"
            )
        first, second = short_name(first), short_name(second)
        try:
            check_mismatches(first, second)
        except ValueError as error:
            raise typer.BadParameter(str(error), param_hint="--over") from None
        return first, second

    def settings(self, seconds: float, estimator: str, noise: float, period: float, delay: int) -> SweepSettings:
        """Raises typer.BadParameter."""
        from smajax.control.gains_file import GainsFileError, read_gains
        from smajax.control.presets import CONTROLLERS
        from smajax.control.sweep.run_sweep import SweepSettings
        from smajax.model.rigs import arm

        try:
            tuned = tuple(read_gains(path, arm()) for path in self.gain_files)
        except GainsFileError as error:
            hint = (
                " Ratios of the main gain are `--gain-ratios`."
                if any(not one.suffix for one in self.gain_files)
                else ""
            )
            raise typer.BadParameter(f"{error}{hint}", param_hint="--gains") from None
        request = self.controllers or ",".join(dict.fromkeys(one.controller for one in tuned)) or "all"
        named = [part.strip() for part in request.split(",")]
        set_points = self.set_points if self.set_points is not None else "-20,20,60" if self.fast else SET_POINTS
        ratios = self.gain_ratios if self.gain_ratios is not None else "1" if self.fast else GAINS
        return SweepSettings(
            tuple(CONTROLLERS) if named == ["all"] else tuple(dict.fromkeys(part for part in named if part)),
            *self.mismatches(),
            self.points or (3 if self.fast else 15),
            numbers("--set-points", set_points, "deg"),
            numbers("--gain-ratios", ratios),
            seconds,
            estimator=estimator,
            noise=noise,
            period=period,
            delay=delay,
            tuned=tuned,
        )


# More than 8 parameters and 80 lines: typer reads the options from them.
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
        typer.Option(help="gains.json of `smajax tune`, in place of the preset's; may be repeated"),
    ] = None,
    gain_ratios: Annotated[
        str | None, typer.Option(help="multiples of the controller's main gain; default 0.5,0.7,1,1.4,2")
    ] = None,
    seconds: Annotated[float, quantity("length of each closed loop", "s", 0.1, 86_400.0)] = 10.0,
    estimator: Annotated[
        str,
        typer.Option(help="`printed` or `model` filter; default: the true state", autocompletion=completion.estimators),
    ] = "",
    noise: Annotated[float, quantity("noise of the angle's readings (1 sigma)", "deg", 0.0, 360.0)] = 0.0,
    period: Annotated[float, quantity("sample time of the controller, a multiple of 10 ms", "s")] = 0.01,
    delay: Annotated[int, typer.Option(callback=within(0), help="control periods until a command arrives")] = 0,
    tolerance: Finely = "auto",
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
    """Run controllers of the arm on perturbed plants, and compare them on every set point.

    After Ctrl-C the same command resumes with the controllers that are not finished.

    What can differ between the plant and the controller's model: inertia (inertia_ratio), damping, convection
    (convection_coefficient), ambient (ambient_temperature, in degC), payload (payload_mass), supply (amplifier_gain).
    +20% is 1.2 times the value that the controller assumes (of 20 degC: 24 degC), -50% half of it, and 20% of a variation
    is both ways.

    Example:  smajax sweep --controllers pid,sld --over convection,ambient --out sweep
    """
    from smajax.core.runtime import prepare

    prepare(cores=True)
    from smajax.cli.progress_display import displayed
    from smajax.cli.result_folder import FolderTaken, claimed
    from smajax.control.sweep.run_sweep import may_resume, sweep_controllers
    from smajax.model.rigs import arm
    from smajax.report.sweep_folder import as_text, files_of, write_sweep

    options = _Options(controllers, over, points, set_points, tuple(gains or ()), gain_ratios, fast)
    settings = replace(options.settings(seconds, estimator, noise, period, delay), tolerance=tolerance_of(tolerance))
    for sentence in (
        understood("Set points", set_points, settings.set_points, "deg"),
        understood("Ratios of the main gain", gain_ratios, settings.gain_ratios),
    ):
        if sentence and not json_out:
            typer.echo(sentence, err=True)
    resume = "Finished controllers are cached: the same command resumes."
    try:
        with (
            resumable(resume, out, "finished/*.npz"),
            claimed(out, "sweep", settings.record(), files_of(settings.controllers), overwrite, may_resume),
            displayed(console(), hint=not json_out) as progress,
        ):
            sweeps = sweep_controllers(arm(), settings, out, progress)
            results = write_sweep(arm(), settings, sweeps, out, progress, command_line())
    except FolderTaken:
        raise
    except ValueError as error:
        raise typer.BadParameter(str(error)) from None
    page = out / "index.html"
    if json_out:
        typer.echo((out / "sweep.json").read_text(encoding="utf-8"), nl=False)
    else:
        typer.echo(as_text(results))
        typer.echo(f"Page: {page.resolve()}")
    if open_page:
        browse(page)
