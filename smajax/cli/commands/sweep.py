"""`smajax sweep`: robustness of controllers on the arm or on any load."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from smajax.cli import completion
from smajax.cli.loop_options import Delay, Estimator, LoopSeconds, Period
from smajax.cli.options import (
    Finely,
    Json,
    Noise,
    Open,
    Overwrite,
    alone,
    noise_option,
    numbers,
    refused,
    tolerance_of,
    understood,
    within,
)
from smajax.cli.plant_options import Changes, Drawn, DriveName, LawName, LoadName, ModelFile, PlantOptions, WireName
from smajax.cli.terminal import browse, command_line, console, resumable

if TYPE_CHECKING:
    from smajax.control.sweep.run_sweep import SweepSettings
    from smajax.model.system import System

SET_POINTS, FAST_AT, GAINS = "-40,-20,0,10,20,40,50,60,80", "-20,20,60", "0.5,0.7,1,1.4,2"  # of the arm
SEED = 0  # of plants drawn from a posterior
FEW, MANY = 3, 6  # set points of another load, with --fast and without


@dataclass(frozen=True)
class _Options:
    """Options of `sweep` as typed, where more than one decides."""

    plant: System
    controllers: str | None
    over: str | None
    points: int | None
    set_points: str | None
    gain_files: tuple[Path, ...]
    gain_ratios: str | None
    fast: bool

    def mismatches(self) -> tuple[str, str]:
        """Both names of --over, "" for the second where there is one alone. Raises typer.BadParameter."""
        from smajax.control.mismatch import mismatches_of, short_name
        from smajax.control.sweep.grid import check_mismatches

        there = tuple(mismatches_of(self.plant))
        over = self.over or "convection," + ("damping" if "damping" in there else "ambient")
        first, _, second = (part.strip() for part in over.strip(" ,").partition(","))
        if "=" in over:
            raise typer.BadParameter(
                f"names alone, as in `convection,damping`, not `{over}`: each goes from -50% to +100% in --points steps.",
                param_hint="--over",
            )
        if not first or "," in second:
            raise typer.BadParameter(
                f"one mismatch, or two with a comma between them, not `{over}`", param_hint="--over"
            )
        first, second = short_name(first), short_name(second)
        try:
            check_mismatches(first, second, there)
        except ValueError as error:
            raise typer.BadParameter(str(error), param_hint="--over") from None
        return first, second

    def settings(self, seconds: float | None, estimator: str, noise: str, period: float, delay: int) -> SweepSettings:
        """Raises typer.BadParameter."""
        from smajax.control.gains_file import GainsFileError, read_gains
        from smajax.control.position_unit import default_set_points, unit_of
        from smajax.control.scales import is_arm, seconds_for
        from smajax.control.sweep.run_sweep import sweep_settings_for

        with refused():
            unit = unit_of(self.plant)
        try:
            tuned = tuple(read_gains(path, self.plant) for path in self.gain_files)
        except GainsFileError as error:
            hint = (
                " Ratios of the main gain are `--gain-ratios`."
                if any(not one.suffix for one in self.gain_files)
                else ""
            )
            raise typer.BadParameter(f"{error}{hint}", param_hint="--gains") from None
        request = self.controllers or ",".join(dict.fromkeys(one.controller for one in tuned)) or "all"
        named = [part.strip() for part in request.split(",")]
        if self.set_points is not None:
            set_points = numbers("--set-points", self.set_points, unit.shown)
        elif is_arm(self.plant):
            set_points = numbers("", FAST_AT if self.fast else SET_POINTS)
        else:
            set_points = default_set_points(self.plant, FEW if self.fast else MANY)
        ratios = self.gain_ratios if self.gain_ratios is not None else "1" if self.fast else GAINS
        first, second = self.mismatches()
        return sweep_settings_for(
            self.plant,
            None if named == ["all"] else [*dict.fromkeys(part for part in named if part)],
            first=first,
            second=second,
            points=self.points or (3 if self.fast else 15),
            set_points=set_points,
            gain_ratios=numbers("--gain-ratios", ratios),
            seconds=seconds_for(self.plant) if seconds is None else seconds,
            estimator=estimator,
            noise=noise_option(noise, unit),
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
    wire: WireName = "",
    load: LoadName = "",
    drive: DriveName = "",
    law: LawName = "",
    values: Changes = None,
    model: ModelFile = None,
    drawn: Drawn = None,
    over: Annotated[
        str | None,
        typer.Option(
            help="the two mismatches of the maps, or one of curves; names alone: each goes from -50% to +100%; default convection,damping",
            autocompletion=completion.mismatches,
        ),
    ] = None,
    points: Annotated[
        int | None,
        typer.Option(
            callback=within(2),
            help="mismatches from 0.5 to 2 times (-50% to +100%) along each side of a map; default 15",
        ),
    ] = None,
    set_points: Annotated[
        str | None,
        typer.Option(
            "--set-points",
            "--set-point",
            help=f"with commas, {alone('deg (mm of a length)')}; default -40,-20,0,10,20,40,50,60,80, or six over the stroke of another load",
        ),
    ] = None,
    gains: Annotated[
        list[Path] | None,
        typer.Option(help="gains.json of `smajax tune`, in place of the preset's; may be repeated"),
    ] = None,
    gain_ratios: Annotated[
        str | None, typer.Option(help="multiples of the controller's main gain; default 0.5,0.7,1,1.4,2")
    ] = None,
    seconds: LoopSeconds = None,
    estimator: Estimator = "",
    noise: Noise = "",
    period: Period = 0.01,
    delay: Delay = 0,
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
    """Run controllers on perturbed plants, and compare them on every set point.

    By default on the arm of the source; with --model on a fitted model, and on plants drawn from its posterior; with --wire, --load and --drive on any load that moves, where the gains are those of the
    arm scaled to the load's stroke, force and time and to the drive's limit.

    After Ctrl-C the same command resumes with the controllers that are not finished.

    What can differ between the plant and the controller's model: inertia (inertia_ratio), damping, convection
    (convection_coefficient), ambient (ambient_temperature, in degC), payload (payload_mass), supply (amplifier_gain).
    +20% is 1.2 times the value that the controller assumes (of 20 degC: 24 degC), -50% half of it, and 20% of a variation
    is both ways. Of another load than the arm: those of these that it has, and its other parameters by their names.

    Example:  smajax sweep --controllers pid,sld --over convection,ambient --out sweep

    Example:  smajax sweep --model report/model.toml --controllers pid --gains tuned/gains.json

    Example:  smajax sweep --wire flexinol_ht_500um --load bias_spring --drive voltage --set-point 5mm,10mm --fast
    """
    from smajax.core.runtime import prepare

    prepare(cores=True)
    from smajax.cli.progress_display import displayed
    from smajax.cli.result_folder import FolderTaken, claimed
    from smajax.control.scales import is_arm
    from smajax.control.sweep.run_sweep import may_resume, sweep_controllers
    from smajax.core.provenance import digest
    from smajax.report.sweep_folder import as_text, files_of, write_sweep

    plant_options = PlantOptions(wire, load, drive, law, values or [], model)
    plant, plants = plant_options.system(), plant_options.draws(drawn, SEED, others=over is not None)
    options = _Options(plant, controllers, over, points, set_points, tuple(gains or ()), gain_ratios, fast)
    settings = replace(options.settings(seconds, estimator, noise, period, delay), tolerance=tolerance_of(tolerance))
    for sentence in (
        understood("Set points", set_points, settings.set_points, settings.unit),
        understood("Ratios of the main gain", gain_ratios, settings.gain_ratios),
    ):
        if sentence and not json_out:
            typer.echo(sentence, err=True)
    request = settings.record()
    if not is_arm(plant) or law or values:
        request["plant"] = digest(plant)[:16]
    if plants is not None:
        request["plants"] = digest(plants)[:16]
    resume = "Finished controllers are cached: the same command resumes."
    try:
        with (
            resumable(resume, out, "finished/*.npz"),
            claimed(out, "sweep", request, files_of(settings.controllers), overwrite, may_resume),
            displayed(console(), hint=not json_out) as progress,
        ):
            sweeps = sweep_controllers(plant, settings, out, progress, plants)
            results = write_sweep(plant, settings, sweeps, out, progress, command_line(), plants)
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
