"""`smajax tune`: gains by gradient."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from smajax.cli import completion
from smajax.cli.loop_options import Delay, Estimator, LoopSeconds, Noise, Period, Quantum, noise_option
from smajax.cli.options import (
    UNMET,
    Finely,
    Json,
    Open,
    Overwrite,
    alone,
    pairs,
    refused,
    texts,
    tolerance_of,
    understood,
    within,
)
from smajax.cli.plant_options import LoopPlants, set_points_of, with_plant_options
from smajax.cli.terminal import browse, command_line, console, resumable

if TYPE_CHECKING:
    from smajax.control.gains_file import Gains
    from smajax.control.plants import Plants
    from smajax.control.reach import Reach
    from smajax.control.tune.settings import TuneSettings
    from smajax.model.system import System
    from smajax.report.next_steps import PlantWords


@dataclass(frozen=True)
class _Search:
    """How much is tried: options of `tune` as typed, and what --fast makes of those that are not."""

    starts: int | None
    rounds: int | None
    finish: int | None
    fast: bool

    def effort(self) -> dict[str, int]:
        """By the fields of `TuneSettings`."""
        fast = self.fast
        return {
            "tried": 8 if fast else 32,
            "starts": self.starts or (3 if fast else 6),
            "rounds": self.rounds or (10 if fast else 30),
            "finish": (10 if fast else 60) if self.finish is None else self.finish,
            "unseen": 4 if fast else 32,
        }


def _initial_gains(start: Path | None, controller: str, plant: System) -> Gains | None:
    """Raises typer.BadParameter."""
    from smajax.control.gains_file import GainsFileError, read_gains

    if start is None:
        return None
    try:
        gains = read_gains(start, plant)
        if gains.controller != controller:
            raise GainsFileError(f"gains file {start} is of {gains.controller}, not of {controller}.")
    except GainsFileError as error:
        raise typer.BadParameter(str(error), param_hint="--start") from None
    return gains


def _limit_of(gains: Gains | None, plant: System, given: bool) -> dict[str, float]:
    """The controller's limit of the command in a file of gains, where it is not that of the preset on this plant; none where --set gives one."""
    from smajax.control.controllers.base import limits_of
    from smajax.control.presets import CONTROLLERS
    from smajax.core.parameters import parameter_values

    if gains is None or given:
        return {}
    made = CONTROLLERS[gains.controller].make(plant)
    own = parameter_values(made)
    return {name: gains.fixed[name] for name in limits_of(made) if gains.fixed.get(name, own[name]) != own[name]}


def _variation(several: Sequence[str] | None, plant: System) -> dict[str, float]:
    """Raises typer.BadParameter."""
    from smajax.control.mismatch import check_known, variation_of
    from smajax.control.plants import plant_set
    from smajax.control.tune.scenarios import check_variation

    try:
        variation = variation_of(texts("--variation", several, "damping=20%,payload=50%"))
        check_known(tuple(variation), plant, "variation")
        check_variation(variation, plant_set(plant, None, tuple(variation)))
    except ValueError as error:
        raise typer.BadParameter(str(error), param_hint="--variation") from None
    return variation


def _higher_limit(
    reach: Reach, plant: System, settings: TuneSettings, reach_with: Callable[[dict[str, float]], Reach | None]
) -> dict[str, float]:
    """`higher_limit`; none where a limit is given, fixed or by the gains that the tuning starts from."""
    from smajax.control.reach import higher_limit

    given = settings.start or set(reach.parameters) & set(settings.fixed)
    return {} if given else higher_limit(reach, plant, settings.set_points, reach_with)


def _said_of_limit(reach: Reach, settings: TuneSettings, limit: float) -> str:
    from smajax.core.display_units import digits

    own, largest = (f"{digits(one, 4)} {reach.unit.command}" for one in (reach.command, limit))
    return (
        f"The preset of {settings.controller} gives up to {own} on this plant, with which the load comes to rest below "
        f"{max(settings.set_points):g} {reach.unit.shown}: here it may give up to {largest}."
    )


def _run(
    plant: System,
    settings: TuneSettings,
    plants: Plants | None,
    out: Path,
    overwrite: bool,
    json_out: bool,
    words: PlantWords,
    typed: bool,
) -> Mapping[str, Any]:
    """The record of the tuning, from the folder where it is finished there. Raises typer.BadParameter.

    typed: whether somebody gave the set points; of the default ones those out of reach are left out, which stderr says.
    """
    from smajax.cli.progress_display import displayed
    from smajax.cli.result_folder import FolderTaken, claimed
    from smajax.control.presets import CONTROLLERS
    from smajax.control.reach import out_of_reach, reach_of, reach_sentence
    from smajax.control.tune.folder_names import FILES, STATE
    from smajax.control.tune.tuning_folder import tune_in_folder
    from smajax.report.tune_folder import finished, write_tuning

    resume = "Finished rounds are cached: the same command resumes."
    request = {"tuning": settings.controller}  # the other settings are in a file of the tuning itself, which it checks
    try:
        settings.check(plant, plants)

        def reach_with(fixed: Mapping[str, float]) -> Reach | None:
            own = {**settings.fixed, **fixed}
            return reach_of(plant, replace(CONTROLLERS[settings.controller], fixed=own).make(plant))

        reach = reach_with({})
        if typed and reach is not None and (higher := _higher_limit(reach, plant, settings, reach_with)):
            typer.echo(_said_of_limit(reach, settings, next(iter(higher.values()))), err=True)
            reach = reach_with(higher)
            settings = replace(settings, fixed={**settings.fixed, **higher})
        beyond = () if typed else out_of_reach(reach, plant, settings.set_points)
        if reach is not None and 0 < len(beyond) < len(settings.set_points):
            left = tuple(one for one in settings.set_points if one not in beyond)
            settings = replace(settings, set_points=left)
            typer.echo(
                f"Of the default set points {', '.join(f'{one:g}' for one in beyond)} {reach.unit.shown} {'are' if len(beyond) > 1 else 'is'} left out: {reach.words()}.",
                err=True,
            )
        if sentence := reach_sentence(reach, plant, settings.set_points):
            raise ValueError(sentence)
        with (
            resumable(resume, out, STATE),
            claimed(out, "tune", request, sorted(FILES), overwrite),
            displayed(console(), hint=not json_out) as progress,
        ):
            record = finished(plant, settings, out, plants)
            if record is None:
                record = write_tuning(
                    tune_in_folder(plant, settings, out, progress, plants), out, command_line(), words
                )
    except FolderTaken:
        raise
    except ValueError as error:
        raise typer.BadParameter(str(error)) from None
    return record


# More than 8 parameters and 80 lines: typer reads the options from them.
@with_plant_options
def tune(
    controller: Annotated[
        str,
        typer.Argument(
            help="a controller, such as pid; `smajax presets` lists them",
            autocompletion=completion.controllers,
        ),
    ],
    plant: LoopPlants,
    set_points: Annotated[
        str | None,
        typer.Option(
            "--set-points",
            "--set-point",
            help=f"with commas, {alone('deg (mm of a length)')}; default -40,-20,0,20,40,60,85, or six over the stroke of another load, as far as they are in reach",
        ),
    ] = None,
    variation: Annotated[
        list[str] | None,
        typer.Option(
            help="how far the plant may differ: damping=20%,payload=50% (or 0.2, 0.5) of the assumed values, both ways; "
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
            "settling_time=1,overshoot=1,steady_error=2 (a second, a degree, half a degree; of a length a hundredth of the stroke)",
            autocompletion=completion.terms,
        ),
    ] = None,
    limits: Annotated[
        list[str] | None,
        typer.Option(
            help="of the same, met in every loop: settling_time=4,overshoot=2deg; without units in s, deg (mm), J, V/s or degC",
            autocompletion=completion.terms,
        ),
    ] = None,
    by: Annotated[str, typer.Option(help="trust-region or adam", autocompletion=completion.rules)] = "trust-region",
    start: Annotated[
        Path | None,
        typer.Option(help="gains.json with the initial gains and the limit of the command, in place of the preset's"),
    ] = None,
    starts: Annotated[
        int | None, typer.Option(callback=within(1), help="starting points of the search; default 6")
    ] = None,
    rounds: Annotated[int | None, typer.Option(callback=within(1), help="iterations, at most; default 30")] = None,
    finish: Annotated[
        int | None,
        typer.Option(
            callback=within(0),
            help="generations of CMA-ES, without gradients, after that, 24 candidates each; default 60, 0 for none",
        ),
    ] = None,
    seconds: LoopSeconds = None,
    estimator: Estimator = None,
    noise: Noise = "",
    quantum: Quantum = "",
    period: Period = None,
    delay: Delay = None,
    seed: Annotated[int, typer.Option(callback=within(0), help="of starting points, plants and noise")] = 0,
    tolerance: Finely = "auto",
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
    """Tune the gains of a controller on many set points and plants at once: by gradient, then by CMA-ES.

    By default on the arm of the source; with --model on a fitted model, and then on plants drawn from its posterior; with --plant on the plant that the
    controller assumes and on the one of that file; with --wire, --load and --drive on any load that moves, where the gains and their bounds
    are those of the arm scaled to the load's stroke, force and time and to the drive's limit.

    Each closed loop is one step from the start, cold and at rest. Moves between the set points are simulated at the end. The
    gains are validated on held-out plants and set points. `smajax sweep --gains tune/gains.json` reads them. Exit code 3 when
    a limit is not met. After Ctrl-C the same command resumes; it repeats the unfinished round or generation only.

    What can differ between the plant and the controller's model: inertia (inertia_ratio), damping, convection
    (convection_coefficient), ambient (ambient_temperature, in degC), payload (payload_mass), supply (amplifier_gain).
    +20% is 1.2 times the value that the controller assumes (of 20 degC: 24 degC), -50% half of it, and 20% of a variation
    is both ways. Of another load than the arm: those of these that it has. Any other parameter goes by its
    own name, such as specific_heat; of a temperature a share tells nothing.

    Example:  smajax tune pid --wire flexinol_table_3_2 --load dead_weight --drive flexinol_voltage --set-point 5mm,12mm,20mm

    Example:  smajax tune pid --model report/model.toml --set-point 5mm,10mm --out tuned

    Example:  smajax tune sld --variation inertia=20%,damping=20%,convection=20% --limits settling_time=4,overshoot=2
    """
    from smajax.core.runtime import prepare

    prepare(cores=True)
    from smajax.control.position_unit import unit_of
    from smajax.control.tune.settings import settings_for
    from smajax.control.tune.terms import terms_in
    from smajax.report.tune_page import gain_rows

    assumed, plants = plant.system(), plant.plants(seed, others=bool(variation))
    with refused():
        unit = unit_of(assumed)
    initial = _initial_gains(start, controller, assumed)
    units = {name: term.unit for name, term in terms_in(unit).items()}
    sigma, source = plant.noise(noise, unit)
    steps = noise_option(quantum, unit, "--quantum")
    given: dict[str, Any] = {
        "weights": pairs("--weights", weights, {}, "settling_time=1,overshoot=1") or None,
        "seconds": seconds,
        "estimator": estimator,
        "period": period,
        "delay": delay,
        "start": None if initial is None else initial.values,
        "fixed": _limit_of(initial, assumed, plant.gives_limit) or None,
        **_Search(starts, rounds, finish, fast).effort(),
    }
    settings = settings_for(
        assumed,
        controller,
        plants,
        variation=_variation(variation, assumed),
        objective=objective,
        limits=pairs("--limits", limits, units, "settling_time=4,overshoot=2deg"),
        by=by,
        noise=sigma,
        quantum=steps or 0.0,
        seed=seed,
        tolerance=tolerance_of(tolerance),
        **set_points_of(assumed, set_points, fast),
        **{name: one for name, one in given.items() if one is not None},
    )
    if source and not json_out:
        typer.echo(source, err=True)
    sentence = understood("Set points", set_points, settings.set_points, unit.shown)
    if sentence and not json_out:
        typer.echo(sentence, err=True)
    record = _run(assumed, settings, plants, out, overwrite, json_out, plant.words(), set_points is not None)
    page = out / "tune.html"
    for sentence in record["price"]:
        typer.echo(sentence, err=True)
    if json_out:
        typer.echo((out / "tune.json").read_text(encoding="utf-8"), nl=False)
    else:
        typer.echo(record["headline"])
        for sentence in record["conclusions"]:
            if sentence not in record["price"]:  # on stderr already
                typer.echo(sentence)
        for row in gain_rows(record["gains"]):
            typer.echo(f"  {row[0]:<24} {row[1]:>10} -> {row[2]:<10} {row[3]}" + (f"  ({row[5]})" if row[5] else ""))
        typer.echo(f"Gains: {(out / 'gains.json').resolve()}")
        typer.echo(f"Page: {page.resolve()}")
    if open_page:
        browse(page)
    if settings.limits and not record["limits_met"]:
        raise typer.Exit(UNMET)
