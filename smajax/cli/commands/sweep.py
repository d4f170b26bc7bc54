"""`smajax sweep`: robustness of controllers on the arm or on any load."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from smajax.cli import completion
from smajax.cli.loop_options import (
    DelayOfSweep,
    FilterOfSweep,
    LoopSeconds,
    NoiseOfSweep,
    Period,
    QuantumOfSweep,
    noise_option,
)
from smajax.cli.options import (
    Finely,
    Json,
    Open,
    Overwrite,
    alone,
    numbers,
    refused,
    tolerance_of,
    understood,
    within,
)
from smajax.cli.plant_options import LoopPlants, PlantOptions, set_points_of, with_plant_options
from smajax.cli.terminal import browse, command_line, console, resumable

if TYPE_CHECKING:
    from smajax.control.gains_file import Gains
    from smajax.control.loop_settings import LoopInUse, LoopSettings
    from smajax.control.plants import Plants
    from smajax.control.sweep.run_sweep import SweepSettings
    from smajax.model.system import System

AXES = 2  # mismatches that a map has place for
SPREAD_FAST = 16  # plants of more mismatches, with --fast


def _tuned(files: Sequence[Path], options: PlantOptions) -> tuple[Gains, ...]:
    """The gains of --gains; without their limit of the command where --set gives one. Raises typer.BadParameter."""
    from smajax.control.gains_file import GainsFileError, read_gains

    bare = options.bare()
    try:
        with refused():
            tuned = tuple(read_gains(path, bare) for path in files)
    except GainsFileError as error:
        hint = " Ratios of the main gain are `--gain-ratios`." if any(not one.suffix for one in files) else ""
        raise typer.BadParameter(f"{error}{hint}", param_hint="--gains") from None
    return tuple(one.without_limit(bare) for one in tuned) if options.gives_limit else tuned


@dataclass(frozen=True)
class _Options:
    """Options of `sweep` as typed, where more than one decides."""

    controllers: str | None
    over: str | None
    points: int | None
    ratios: str | None
    set_points: str | None
    gain_ratios: str | None
    fast: bool
    seed: int

    def mismatches(self, plant: System) -> tuple[str, ...]:
        """The names of --over, none without the option. Raises typer.BadParameter."""
        from smajax.control.mismatch import check_known, mismatches_of, short_name
        from smajax.control.sweep.grid import check_mismatches

        if self.over is None:
            return ()
        if "=" in self.over:
            raise typer.BadParameter(
                f"names alone, as in `convection,damping`, not `{self.over}`: each goes from -50% to +100%, or as --ratios says.",
                param_hint="--over",
            )
        names = tuple(short_name(part.strip()) for part in self.over.strip(" ,").split(","))
        with refused("--over"):
            check_known(names, plant)
            check_mismatches(names, tuple(mismatches_of(plant, names)))
        if len(names) > AXES and self.points:
            raise typer.BadParameter(
                f"are the sides of a map, and {len(names)} mismatches are on plants spread over all of them: give --plants, their number.",
                param_hint="--points",
            )
        return names

    def plants(self, assumed: System, plant: LoopPlants, limit: float | None) -> Plants | None:
        """What the loops run on in the place of mismatches: of more than a map has axes plants that differ in all of them. Raises typer.BadParameter."""
        names = self.mismatches(assumed)
        if len(names) <= AXES or plant.plant is not None:  # which it refuses beside mismatches
            return plant.plants(self.seed, others=bool(names), limit=limit)
        from smajax.control.sweep.spread_plants import SPREAD, spread_plants

        count = (SPREAD_FAST if self.fast else SPREAD) if plant.drawn is None else plant.drawn
        if count < 1:
            raise typer.BadParameter(f"at least one, not {count}.", param_hint="--plants")
        with refused():
            return spread_plants(assumed, names, count, *self.ratio_range())

    def plants_in_words(self, assumed: System, plants: Plants | None) -> str:
        """What the record of a request says of plants: those of more than two mismatches are known by their number, names and range."""
        import numpy as np

        from smajax.core.provenance import digest

        names = self.mismatches(assumed)
        if len(names) <= AXES or not isinstance(plants, Mapping):
            return digest(plants)[:16]
        least, most = self.ratio_range()
        count = np.size(next(iter(plants.values())))
        return f"{count} over {', '.join(sorted(names))}, {least:g} to {most:g} times"

    def ratio_range(self) -> tuple[float, float]:
        """Least and largest mismatch, of --ratios or by default. Raises typer.BadParameter."""
        from smajax.control.sweep.grid import LEAST, MOST

        if self.ratios is None:
            return LEAST, MOST
        both = numbers("--ratios", self.ratios)
        if len(both) != 2:
            raise typer.BadParameter(f"two numbers, such as 0.9,1.1, not `{self.ratios}`", param_hint="--ratios")
        return both[0], both[1]

    def settings(self, plant: System, tuned: tuple[Gains, ...], **loop: Any) -> SweepSettings:
        """loop: further fields of `SweepSettings`. Raises typer.BadParameter."""
        from smajax.control.sweep.run_sweep import sweep_settings_for

        request = self.controllers or ",".join(dict.fromkeys(one.controller for one in tuned)) or "all"
        named = [part.strip() for part in request.split(",")]
        given: dict[str, Any] = {**set_points_of(plant, self.set_points, self.fast), "seed": self.seed, **loop}
        given["ratio_range"] = self.ratio_range()
        names = self.mismatches(plant)
        if 0 < len(names) <= AXES:
            given |= dict(zip(("first", "second"), (*names, ""), strict=False))
        if self.points or self.fast:
            given["points"] = self.points or 3
        if self.gain_ratios is not None or self.fast:
            given["gain_ratios"] = numbers("--gain-ratios", "1" if self.gain_ratios is None else self.gain_ratios)
        controllers = None if named == ["all"] else [*dict.fromkeys(part for part in named if part)]
        with refused():
            return sweep_settings_for(plant, controllers, tuned=tuned, **given)


def loop_of(tuned: Sequence[Gains], given: LoopSettings) -> LoopInUse:
    """Of the options, else of the files of gains, else of a sweep: a filter and a delay; without a filter neither. Raises ValueError."""
    from smajax.control.loop_settings import LoopInUse, joined
    from smajax.control.sweep.run_sweep import DELAY, FILTER

    files = {one.controller: one.loop for one in tuned}
    loop = joined(files, given, LoopInUse(delay=DELAY, estimator=FILTER))
    return loop if loop.estimator else joined(files, given)


def _sentences(tuned: Sequence[Gains], given: LoopSettings, plant: System, settings: SweepSettings) -> tuple[str, ...]:
    """What the loops take from the files of gains, and how the gains of presets follow the drive's limit."""
    from smajax.control.loop_settings import LoopInUse, settings_of
    from smajax.control.position_unit import unit_named
    from smajax.control.run_notes import gains_of_files, voltages_of_limit
    from smajax.report.loop_words import source_sentences

    sensor = [float(unit_named(settings.unit).to_own(one)) for one in (settings.noise, settings.quantum)]
    own = settings_of(plant, LoopInUse(None, settings.period, settings.delay, settings.estimator), *sensor)
    presets = set(settings.controllers) - {one.controller for one in tuned}
    limited = voltages_of_limit(plant) if presets else []
    return source_sentences([*gains_of_files(tuned, plant, given, own, settings.controllers), *limited])


# More than 8 parameters and 80 lines: typer reads the options from them.
@with_plant_options
def sweep(
    controllers: Annotated[
        str | None,
        typer.Option(
            help="such as pid,sld, or `all`; `smajax presets` lists them; default all, or those of the gains files",
            autocompletion=completion.several_controllers,
        ),
    ] = None,
    *,
    plant: LoopPlants,
    over: Annotated[
        str | None,
        typer.Option(
            help="the two mismatches of the maps, one of curves, or more, of which all differ at once on --plants plants; names alone: each goes from -50% to +100%, or as --ratios says; default convection,damping",
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
    ratios: Annotated[
        str | None,
        typer.Option(
            help="least and largest mismatch, plant over the controller's model, such as 0.9,1.1; default 0.5,2"
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
    estimator: FilterOfSweep = None,
    noise: NoiseOfSweep = "",
    quantum: QuantumOfSweep = "",
    period: Period = None,
    delay: DelayOfSweep = None,
    tolerance: Finely = "auto",
    out: Annotated[
        Path,
        typer.Option(
            help="folder for index.html, the pictures, sweep.json, sweep.nc (every loop) and a CSV a controller"
        ),
    ] = Path("sweep"),
    seed: Annotated[
        int, typer.Option(callback=within(0), help="of the noise, and of plants drawn from a posterior")
    ] = 0,
    fast: Annotated[
        bool,
        typer.Option(
            "--fast", help="by default 3 x 3 mismatches (16 plants of more than two), set points -20,20,60, gain 1"
        ),
    ] = False,
    overwrite: Overwrite = False,
    json_out: Json = False,
    open_page: Open = False,
) -> None:
    """Run controllers on perturbed plants, and compare them on every set point.

    By default on the arm of the source; with --model on a fitted model, and on plants drawn from its posterior; with --plant on the one of that file; with --wire, --load and --drive on any load that moves, where the gains are those of the
    arm scaled to the load's stroke, force and time and to the drive's limit.

    The controllers get a filter's states, of readings with noise and steps, and their commands arrive a period late; with `--estimator ''` the true state at once.

    After Ctrl-C the same command resumes with the controllers that are not finished.

    What can differ between the plant and the controller's model: inertia (inertia_ratio), damping, convection
    (convection_coefficient), ambient (ambient_temperature, in degC), payload (payload_mass), supply (amplifier_gain).
    +20% is 1.2 times the value that the controller assumes (of 20 degC: 24 degC), -50% half of it, and 20% of a variation
    is both ways. Of another load than the arm: those of these that it has. Any other parameter goes by its
    own name, such as specific_heat; of a temperature a share tells nothing.

    Example:  smajax sweep --controllers pid,sld --over convection,ambient --out sweep

    Example:  smajax sweep --controllers pid,sld --over inertia,damping,convection --plants 128

    Example:  smajax sweep --model report/model.toml --controllers pid --gains tuned/gains.json

    Example:  smajax sweep --wire flexinol_ht_500um --load bias_spring --drive voltage --set-point 5mm,10mm --fast
    """
    from smajax.core.runtime import prepare

    prepare(cores=True)
    from smajax.cli.progress_display import displayed
    from smajax.cli.result_folder import FolderTaken, claimed
    from smajax.control.loop_settings import LoopSettings
    from smajax.control.position_unit import unit_of
    from smajax.control.reach import reach_of, reach_sentence
    from smajax.control.scales import is_arm
    from smajax.control.sweep.run_sweep import begun_sweep, may_resume, sweep_controllers
    from smajax.core.provenance import digest
    from smajax.report.sweep_folder import as_text, files_of, write_sweep
    from smajax.report.sweep_page import Remarks, answer, limit_sentences

    tuned = _tuned(tuple(gains or ()), plant)
    given = LoopSettings(period=period, delay=delay, estimator=estimator)
    with refused():
        loop = loop_of(tuned, given)
    assumed = plant.system(loop.command_limit)
    with refused():
        sigma, source = plant.noise(noise, unit_of(assumed))
    between: dict[str, Any] = {"period": loop.period, "delay": loop.delay, "estimator": loop.estimator}
    between |= {"noise": sigma} if noise or source else {}
    counted = noise_option(quantum, unit_of(assumed), "--quantum")
    between |= {} if counted is None else {"quantum": counted}
    between |= {} if seconds is None else {"seconds": seconds}
    options = _Options(controllers, over, points, ratios, set_points, gain_ratios, fast, seed)
    plants = options.plants(assumed, plant, loop.command_limit)
    settings = options.settings(assumed, tuned, tolerance=tolerance_of(tolerance), **between)
    with refused():
        settings.check(assumed, plants)
    said = tuple(one for one in (source, *_sentences(tuned, given, assumed, settings)) if one)
    out_of_reach = tuple(one for one in [reach_sentence(reach_of(assumed), assumed, settings.set_points)] if one)
    for sentence in (
        understood("Set points", set_points, settings.set_points, settings.unit),
        understood("Ratios of the main gain", gain_ratios, settings.gain_ratios),
        *said,
        *out_of_reach,
    ):
        if sentence and not json_out:
            typer.echo(sentence, err=True)
    remarks = Remarks(
        out_of_reach,
        said,
        plant.words(),
        {one.controller: str(path) for one, path in zip(tuned, gains or (), strict=True)},
    )
    request = settings.record()
    if not is_arm(assumed) or plant.law or plant.values or loop.command_limit is not None:
        request["plant"] = digest(assumed)[:16]
    if plants is not None:
        request["plants"] = options.plants_in_words(assumed, plants)
    resume = "Finished controllers are cached: the same command resumes."
    try:
        with (
            resumable(resume, out, "finished/*.npz"),
            claimed(out, "sweep", request, files_of(settings.controllers), overwrite, may_resume),
            displayed(console(), hint=not json_out) as progress,
        ):
            sweeps = sweep_controllers(assumed, settings, out, progress, plants)
            results = write_sweep(
                begun_sweep(assumed, settings, plants), sweeps, out, progress, command_line(), remarks
            )
    except FolderTaken:
        raise
    except ValueError as error:
        raise typer.BadParameter(str(error)) from None
    page = out / "index.html"
    if json_out:
        typer.echo((out / "sweep.json").read_text(encoding="utf-8"), nl=False)
    else:
        typer.echo(answer(results))
        typer.echo("On the unperturbed plant, median / worst over the set points:")
        typer.echo(as_text(results))
        for sentence in limit_sentences(results):
            typer.echo(sentence)
        typer.echo(f"Page: {page.resolve()}")
    if open_page:
        browse(page)
