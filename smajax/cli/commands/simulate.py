"""`smajax simulate`: one run of a model, open or closed loop, into files and a page."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from smajax.cli import completion
from smajax.cli.loop_options import Delay, Estimator, Noise, Period, Quantum
from smajax.cli.options import Finely, Json, Open, Overwrite, quantity, texts, tolerance_of
from smajax.cli.plant_options import LawName, OtherPlant, loaded
from smajax.cli.terminal import browse, command_line, console, resumable, say

if TYPE_CHECKING:
    from smajax.control.run_request import LoopRequest, RunRequest
    from smajax.control.run_result import RunResult

SHOWN = 7  # columns of a table of set points on a terminal
OPTIONS = {
    "values": "--set",
    "mismatch": "--mismatch",
    "set_points": "--set-point",
    "noise": "'--noise'",
    "quantum": "'--quantum'",
    "plant": "--plant",
}  # part of a run -> its option
WIRE, LOAD, DRIVE = "niti_table_3_1", "arm", "amplified_voltage"
VALUES = "damping=+20%,wire_length='1 m'"


def _inputs(option: str, several: Sequence[str] | None) -> dict[str, str]:
    """`NAME=TEXT`, once or more; a text may hold commas."""
    result: dict[str, str] = {}
    for part in several or ():
        name, sign, text = part.partition("=")
        if not sign or not name.strip() or name.strip() in result:
            raise typer.BadParameter(f"each name once, as in `name=text`, not `{part}`", param_hint=option)
        result[name.strip()] = text.strip()
    return result


@dataclass(frozen=True)
class _Options:
    """Options that decide together which run it is."""

    step: str | None
    inputs: Mapping[str, str]
    gains: Path | None
    controller: str
    set_point: str | None
    mismatch: Mapping[str, str]
    time: str
    animated: bool
    plant: Path | None

    @property
    def closed(self) -> bool:
        return self.gains is not None or bool(self.controller)

    def check(self, load: str) -> None:
        """Raise typer.BadParameter for options that do not go together."""
        from smajax.data.text_input import reads_file

        if self.gains is not None and self.controller:
            raise typer.BadParameter("--gains names its controller; leave --controller out.")
        if self.closed != (self.set_point is not None):
            lacking = "--set-point" if self.closed else "--gains or --controller beside --set-point"
            raise typer.BadParameter(f"a closed loop needs {lacking}.")
        if self.closed and (self.inputs or self.step):
            raise typer.BadParameter("in a closed loop the controller gives the voltage: leave --step and --input out.")
        texts = [*self.inputs.values(), *([self.set_point] if self.set_point is not None else [])]
        if self.time and not any(map(reads_file, texts)):
            raise typer.BadParameter(
                f"names the time column of a file, and no input is from a file: leave `{self.time}` out (the length of the "
                "run is --seconds).",
                param_hint="--time",
            )
        if self.animated and load.endswith("coupon"):
            raise typer.BadParameter("a coupon moves nothing that could be drawn.", param_hint="--gif")
        if not self.closed and self.mismatch:
            raise typer.BadParameter("--mismatch is for closed loops; use --set.")
        if not self.closed and self.plant is not None:
            raise typer.BadParameter("--plant is for closed loops; an open run of a model is --model.")

    def stepped(self, request: RunRequest) -> RunRequest:
        """The request with --step as the one required input. Raises ValueError for a model with none or several."""
        if self.step is None:
            return request
        from smajax.control.run_request import channels

        required, _ = channels(request.system())
        if len(required) != 1 or required & self.inputs.keys():
            needs = ", ".join(sorted(required)) or "none"
            raise ValueError(
                f"--step is for a model with one required input; this one has {needs}: use --input NAME=..."
            )
        return replace(request, inputs={**self.inputs, next(iter(required)): self.step})

    def option_of(self, part: str) -> str:
        """The option that gives this part of a request."""
        known = {**OPTIONS, **{f"inputs.{name}": f"--input {name}" for name in self.inputs}}
        # Of a file the column of the times may be wrong.
        timed = bool(self.time) and part.startswith(("inputs.", "set_points"))
        option = "--measured" if part.startswith("measured.") else known.get(part, "--step")
        return option + " or --time" * timed


def _run(options: _Options, request: RunRequest, loop: LoopRequest) -> tuple[RunRequest, RunResult]:
    """The run, with --step among its inputs. Raises typer.BadParameter."""
    from smajax.cli.progress_display import displayed
    from smajax.control.gains_file import GainsFileError
    from smajax.control.run_request import RequestError, run_closed, run_open
    from smajax.core.progress import Stage

    try:
        request = options.stepped(request)
        with resumable(), displayed(console()) as progress:
            progress(Stage("simulating the run", 0.0))
            result = run_closed(request, loop) if options.closed else run_open(request)
            progress(Stage("simulating the run", 1.0))
    except KeyError as error:
        raise typer.BadParameter(error.args[0]) from None
    except RequestError as error:
        raise typer.BadParameter(str(error), param_hint=options.option_of(error.part)) from None
    except (ValueError, GainsFileError) as error:
        raise typer.BadParameter(str(error)) from None
    return request, result


def _print(result: RunResult, title: str) -> None:
    """The run for a terminal."""
    from smajax.core.wording import aligned
    from smajax.report.integration_words import integration_sentence
    from smajax.report.loop_words import source_sentences
    from smajax.report.measured_log import measured_sentences
    from smajax.report.simulate_words import (
        answer,
        integration_error,
        merit_rows,
        merit_rule,
        mismatch_rows,
        set_point_rows,
        summary_rows,
    )

    typer.echo(title)
    say(answer(result))
    for sentence in source_sentences(result.settings):
        say(sentence)
    for row in summary_rows(result.data):
        typer.echo(f"  {row[0]:<28} {row[1]:>11} … {row[2]:<11} last {row[3]:<11} {row[4]}")
    say(integration_sentence(integration_error(result.data)))
    for sentence in measured_sentences(result):
        if sentence not in answer(result):
            say(sentence)
    for row in mismatch_rows(result):
        unit, ratio = f" {row[3]}" * (row[3] != "-"), f", {row[4]}" * bool(row[4])
        typer.echo(f"  {row[0]:<28} assumed {row[1]} -> true {row[2]}{unit}{ratio}")
    for row in merit_rows(result):
        typer.echo(f"  {row[0]:<36} {row[1]} {row[2]}")
    head, rows = set_point_rows(result)
    if rows:
        # The first columns; the page has all.
        for line in aligned([row[:SHOWN] for row in (head, *rows)], right=True):
            typer.echo(f"  {line}")
    if rule := merit_rule(result):
        say(rule)


# More than 8 parameters and 80 lines: typer reads the options from them.
def simulate(
    wire: Annotated[str, typer.Argument(help="a wire of `smajax presets`", autocompletion=completion.wires)] = WIRE,
    load: Annotated[str, typer.Argument(help="a load of `smajax presets`", autocompletion=completion.loads)] = LOAD,
    drive: Annotated[
        str,
        typer.Argument(help="a drive of `smajax presets`; `none` for a coupon", autocompletion=completion.drives),
    ] = DRIVE,
    step: Annotated[
        str | None,
        typer.Option(
            help="levels of the drive's input, each with its duration: 6V:5s,0V:10s; without units in V, A, W or a ratio, and s"
        ),
    ] = None,
    inputs: Annotated[
        list[str] | None,
        typer.Option(
            "--input",
            help="NAME=levels, NAME=a constant (ambient_temperature=25degC), or a column of a file, NAME=log.csv:U:mV; levels in SI or "
            "degC without units; may be repeated",
        ),
    ] = None,
    time: Annotated[
        str, typer.Option(help="time column of such files, COLUMN or COLUMN:UNIT; default: by its name")
    ] = "",
    values: Annotated[
        list[str] | None,
        typer.Option(
            "--set",
            help="parameters: wire.heat.convection_coefficient=80, convection_coefficient='80 W/m^2/K' or "
            "latent_heat.enthalpy='20 J/g', which adds that effect; without a unit in SI, degC or rad; payload=+20% is "
            "relative to the preset's value; may be repeated",
            autocompletion=completion.values,
        ),
    ] = None,
    law: LawName = "",
    seconds: Annotated[
        float | None, quantity("length of the run; default: that of the inputs", "s", above=0.0, like="10s")
    ] = None,
    model: Annotated[
        Path | None,
        typer.Option(help="a model.toml of close-loop or identify, in the place of wire, load and drive"),
    ] = None,
    measured: Annotated[
        list[str] | None,
        typer.Option(
            help="hold the run against a log, whose first sample is its start: position=log.csv:COLUMN:mm, or temperature, stress, strain; may be repeated"
        ),
    ] = None,
    dt: Annotated[float, quantity("time between samples", "s", above=0.0, like="5ms")] = 0.005,
    tolerance: Finely = "auto",
    gains: Annotated[
        Path | None, typer.Option(help="gains.json of `smajax tune`: a closed loop by that controller")
    ] = None,
    controller: Annotated[
        str,
        typer.Option(
            help="a closed loop by this controller's preset gains, scaled to the load",
            autocompletion=completion.controllers,
        ),
    ] = "",
    set_point: Annotated[
        str | None,
        typer.Option(
            help="set points of the loop, each with its duration: 40deg:5s,10deg:5s, without units in deg (mm of a length) and s; or a column of a file, "
            "FILE:COLUMN:UNIT, on straight lines between its rows, FILE:COLUMN:UNIT:held for each row until the next"
        ),
    ] = None,
    mismatch: Annotated[
        list[str] | None,
        typer.Option(
            help="how the plant differs from the controller's model: damping=+20%,payload=-50%, or any parameter's value as "
            "--set; may be repeated",
            autocompletion=completion.values,
        ),
    ] = None,
    plant: OtherPlant = None,
    estimator: Estimator = None,
    noise: Noise = "",
    quantum: Quantum = "",
    period: Period = None,
    delay: Delay = None,
    seed: Annotated[int, typer.Option(help="of the noise")] = 0,
    gif: Annotated[
        bool, typer.Option("--gif", help="draw the load moving beside its wire's phase diagram: simulate.gif")
    ] = False,
    out: Annotated[Path, typer.Option(help="folder for simulate.csv, .nc, .json, .png, .svg and .html")] = Path(
        "simulated"
    ),
    overwrite: Overwrite = False,
    json_out: Json = False,
    open_page: Open = False,
) -> None:
    """Simulate a model once: a wire, a load and a drive with given inputs, or under a controller.

    By default the model is the rotary arm of the source. Angles are given in deg; files are in SI with degC and rad.
    In a closed loop with --noise or --quantum the column `reading` is what the controller's sensor says, once a control
    period and held; `position` is the true one.

    What can differ between the plant and the controller's model: inertia (inertia_ratio), damping, convection
    (convection_coefficient), ambient (ambient_temperature, in degC), payload (payload_mass), supply (amplifier_gain).
    +20% is 1.2 times the value that the controller assumes (of 20 degC: 24 degC), -50% half of it, and 20% of a variation
    is both ways. Of another load than the arm: those of these that it has. Any other parameter goes by its
    own name, such as specific_heat; of a temperature a share tells nothing.

    Example:  smajax simulate flexinol_table_3_2 dead_weight flexinol_voltage --step 5V:8s,0V:8s --set convection_coefficient=80

    Example:  smajax simulate flexinol_ht_500um bias_spring voltage --controller pid --set-point 5mm:30s,2mm:30s

    Example:  smajax simulate --model report/model.toml --input voltage=ramp.csv:U:V --input mass=ramp.csv:m:g --measured position=ramp.csv:x:mm

    Example:  smajax simulate --gains tune/gains.json --set-point 40deg:5s,10deg:5s --mismatch damping=+20% --out loop
    """
    from smajax.core.runtime import prepare

    prepare()
    from smajax.cli.progress_display import displayed
    from smajax.cli.result_folder import check_path, claimed
    from smajax.control.run_request import LoopRequest, RunRequest
    from smajax.core.files import json_text
    from smajax.report.next_steps import PlantWords, after_simulate
    from smajax.report.note_words import note_sentences
    from smajax.report.simulate_page import FILES, record, write_run

    check_path(out)
    perturbed = texts("--mismatch", mismatch, VALUES)
    series = _inputs("--input", inputs)
    options = _Options(step, series, gains, controller, set_point, perturbed, time, gif, plant)
    if model is not None and (wire, load, drive, law) != (WIRE, LOAD, DRIVE, ""):
        raise typer.BadParameter("says wire, load, drive and law: leave these out.", param_hint="--model")
    kept, true = (None if path is None else loaded(path) for path in (model, plant))
    options.check(load if kept is None else kept.load)
    changed, finely = texts("--set", values, VALUES), tolerance_of(tolerance)
    compared = _inputs("--measured", measured)
    request = RunRequest(wire, load, drive, law, changed, series, time, seconds, dt, finely, kept, compared)
    loop = LoopRequest(
        controller,
        set_point or "",
        gains,
        perturbed,
        estimator,
        noise or None,
        quantum or 0.0,
        period,
        delay,
        seed,
        true,
    )
    request, result = _run(options, request, loop)
    command = command_line()
    what = f"{wire}, {load}, {drive}" if model is None else model.name
    title = what + (f", {result.data.attrs['controller']}" if options.closed else "")
    title += "" if plant is None else f", on {plant.name}"
    presets = None if model is not None or (wire, load, drive) == (WIRE, LOAD, DRIVE) else (wire, load, drive)
    named = PlantWords(presets, law, str(model or ""), tuple(values or ()), str(plant or ""))
    settings = {
        **vars(request),
        **(vars(loop) if options.closed else {}),
        "gains": None if gains is None else gains.read_text(encoding="utf-8"),
        "model": None if model is None else str(model),
        "plant": None if plant is None else str(plant),
    }
    with resumable(), claimed(out, "simulate", settings, FILES, overwrite), displayed(console()) as progress:
        page = write_run(result, out, title, command, gif, progress, after_simulate(result, named, str(gains or "")))
    for note in note_sentences(result.notes):
        console().print(note, soft_wrap=True, markup=False, highlight=False)
    if json_out:
        typer.echo(json_text(record(result, command)), nl=False)
    else:
        _print(result, title)
        typer.echo(f"Page: {page.resolve()}")
    if open_page:
        browse(page)
