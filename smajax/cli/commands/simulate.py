"""`smajax simulate`: one run of a model, open or closed loop, into files and a page."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

import typer

from smajax.cli import completion
from smajax.cli.options import (
    Json,
    Open,
    Overwrite,
    browse,
    command_line,
    console,
    quantity,
    resumable,
    texts,
    within,
)

SHOWN = 7  # columns of a table of set points on a terminal
OPTIONS = {"values": "--set", "mismatch": "--mismatch", "set_points": "--set-point"}  # part of a run -> its option
VALUES = "damping=+20%,wire_length='1 m'"


def _inputs(option: str, several: Sequence[str] | None) -> dict[str, str]:
    """`NAME=TEXT`, given once or more; a text may hold commas."""
    found: dict[str, str] = {}
    for part in several or ():
        name, sign, text = part.partition("=")
        if not sign or not name.strip() or name.strip() in found:
            raise typer.BadParameter(f"each name once, as in `name=text`, not `{part}`", param_hint=option)
        found[name.strip()] = text.strip()
    return found


def simulate(
    wire: Annotated[
        str, typer.Argument(help="a wire of `smajax presets`", autocompletion=completion.wires)
    ] = "niti_table_3_1",
    load: Annotated[str, typer.Argument(help="a load of `smajax presets`", autocompletion=completion.loads)] = "arm",
    drive: Annotated[
        str,
        typer.Argument(help="a drive of `smajax presets`; `none` for a coupon", autocompletion=completion.drives),
    ] = "amplified_voltage",
    step: Annotated[
        str | None,
        typer.Option(
            help="levels of the drive's input, each with its time: 6V:5s,0V:10s; in V, A, W or a share, and s, where they say no unit"
        ),
    ] = None,
    inputs: Annotated[
        list[str] | None,
        typer.Option(
            "--input",
            help="NAME=levels, NAME=a constant (ambient_temperature=25degC), or a column of a file, NAME=log.csv:U:mV; levels in SI or "
            "degC where they say no unit; repeat",
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
            "latent_heat.enthalpy='20 J/g', which adds that effect; in SI, degC or rad where it says no unit; payload=+20% is "
            "that much more than the preset has; may be repeated",
            autocompletion=completion.values,
        ),
    ] = None,
    law: Annotated[
        str, typer.Option(help="kinetics: tanaka, liang, brinson or enhanced", autocompletion=completion.laws)
    ] = "",
    seconds: Annotated[
        float | None, quantity("length of the run; default: that of the inputs", "s", above=0.0, like="10s")
    ] = None,
    dt: Annotated[float, quantity("time between samples", "s", above=0.0, like="5ms")] = 0.005,
    tolerance: Annotated[
        float | None, typer.Option(help="steps of its own between samples, to this error (1e-4 is good); moving loads")
    ] = None,
    gains: Annotated[
        Path | None, typer.Option(help="gains.json of `smajax tune`: a closed loop of the arm by that controller")
    ] = None,
    controller: Annotated[
        str, typer.Option(help="a closed loop by this controller's preset gains", autocompletion=completion.controllers)
    ] = "",
    set_point: Annotated[
        str | None,
        typer.Option(
            help="what the loop is to reach: 40deg:5s,10deg:5s, in deg and s where they say no unit, or a file"
        ),
    ] = None,
    mismatch: Annotated[
        list[str] | None,
        typer.Option(
            help="how the plant is wrong: damping=+20%,payload=-50% of what the controller believes, or any parameter's value as "
            "--set; may be repeated",
            autocompletion=completion.values,
        ),
    ] = None,
    estimator: Annotated[
        str,
        typer.Option(
            help="`printed` or `model` filter; none: told the true state", autocompletion=completion.estimators
        ),
    ] = "",
    noise: Annotated[float, quantity("noise of the angle's readings (1 sigma)", "deg", 0.0, 360.0)] = 0.0,
    period: Annotated[float, quantity("sample time of the controller, a multiple of --dt", "s")] = 0.01,
    delay: Annotated[int, typer.Option(callback=within(0), help="control periods until a command arrives")] = 0,
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
    """Run a model once: wire x load x drive under given inputs, or the arm under a controller.

    By default the model is the source's arm. Angles are given in deg; what is written is SI with degC and rad.

    What may be wrong of a plant: inertia (inertia_ratio), damping, convection (convection_coefficient), ambient
    (ambient_temperature, in degC), payload (payload_mass), supply (amplifier_gain). +20% is that much more than the
    controller believes (of 20 degC: 24 degC), -50% half of it, and 20% of a variation both ways.

    Example:  smajax simulate flexinol_table_3_2 dead_weight flexinol_voltage --step 5V:8s,0V:8s --set convection_coefficient=80

    Example:  smajax simulate --gains tune/gains.json --set-point 40deg:5s,10deg:5s --mismatch damping=+20% --out loop
    """
    from smajax.core.runtime import prepare

    prepare()
    from smajax.cli.progress_display import displayed
    from smajax.cli.result_folder import check_path, claimed
    from smajax.control.gains_file import GainsFileError
    from smajax.control.run_request import Asked, AskedError, AskedLoop, channels, run_closed, run_open
    from smajax.core.files import json_text
    from smajax.core.progress import Stage
    from smajax.core.wording import aligned
    from smajax.data.text_input import reads_file
    from smajax.report.simulate_page import OWN, merit_rows, mismatch_rows, record, rest_rows, summary_rows, write_run

    check_path(out)
    series, closed = _inputs("--input", inputs), gains is not None or bool(controller)
    if gains is not None and controller:
        raise typer.BadParameter("--gains names its controller; leave --controller out.")
    if closed != (set_point is not None):
        lacking = "--set-point" if closed else "--gains or --controller beside --set-point"
        raise typer.BadParameter(f"a closed loop needs {lacking}.")
    if closed and (series or step or tolerance is not None):
        raise typer.BadParameter(
            "in a closed loop the controller gives the voltage: leave --step, --input and --tolerance out."
        )
    texts_given = [*series.values(), *([set_point] if set_point is not None else [])]
    if time and not any(map(reads_file, texts_given)):
        raise typer.BadParameter(
            f"names the time column of a file, and nothing is read from one: leave `{time}` out (how long a run is says --seconds).",
            param_hint="--time",
        )
    if gif and load == "coupon":
        raise typer.BadParameter("a coupon moves nothing that could be drawn.", param_hint="--gif")
    if not closed and mismatch:
        raise typer.BadParameter("--mismatch is for closed loops; use --set.")
    options = {**OPTIONS, **{f"inputs.{name}": f"--input {name}" for name in series}}
    try:
        asked = Asked(wire, load, drive, law, texts("--set", values, VALUES), series, time, seconds, dt, tolerance)
        if step is not None:
            required, _ = channels(asked.system())
            if len(required) != 1 or required & series.keys():
                needs = ", ".join(sorted(required)) or "none"
                raise ValueError(
                    f"--step is for a model with one required input; this one has {needs}: use --input NAME=..."
                )
            stepped = next(iter(required))
            asked = Asked(**{**vars(asked), "inputs": {**series, stepped: step}})
            options[f"inputs.{stepped}"] = "--step"
        with resumable(), displayed(console()) as progress:
            progress(Stage("simulating the run", 0.0))
            loop: AskedLoop | None = None
            if closed:
                loop = AskedLoop(
                    controller,
                    set_point or "",
                    gains,
                    texts("--mismatch", mismatch, VALUES),
                    estimator,
                    noise,
                    period,
                    delay,
                    seed,
                )
                ran = run_closed(asked, loop)
            else:
                ran = run_open(asked)
            progress(Stage("simulating the run", 1.0))
    except KeyError as error:
        raise typer.BadParameter(error.args[0]) from None
    except AskedError as error:
        # Of a file it may be the column of the times that cannot be read.
        timed = bool(time) and error.part.startswith(("inputs.", "set_points"))
        raise typer.BadParameter(str(error), param_hint=options[error.part] + " or --time" * timed) from None
    except (ValueError, GainsFileError) as error:
        raise typer.BadParameter(str(error)) from None
    command = command_line()
    title = f"{wire}, {load}, {drive}" + (f", {ran.found.attrs['controller']}" if closed else "")
    # What was asked of the model, not how it is shown.
    told = {
        **vars(asked),
        **(vars(loop) if loop is not None else {}),
        "gains": None if gains is None else gains.read_text(),
    }
    with resumable(), claimed(out, "simulate", told, OWN, overwrite), displayed(console()) as progress:
        page = write_run(ran, out, title, command, gif, progress)
    for note in ran.notes:
        console().print(note, soft_wrap=True, markup=False, highlight=False)
    if json_out:
        typer.echo(json_text(record(ran, command)), nl=False)
    else:
        typer.echo(title)
        for row in summary_rows(ran.found):
            typer.echo(f"  {row[0]:<28} {row[1]:>11} … {row[2]:<11} last {row[3]:<11} {row[4]}")
        for row in mismatch_rows(ran):
            unit, ratio = f" {row[3]}" * (row[3] != "-"), f", {row[4]}" * bool(row[4])
            typer.echo(f"  {row[0]:<28} believed {row[1]} -> true {row[2]}{unit}{ratio}")
        for row in merit_rows(ran):
            typer.echo(f"  {row[0]:<36} {row[1]} {row[2]}")
        head, rows = rest_rows(ran)
        if rows:
            # The first few; the page has all.
            for line in aligned([row[:SHOWN] for row in (head, *rows)], right=True):
                typer.echo(f"  {line}")
        typer.echo(f"Page: {page.resolve()}")
    if open_page:
        browse(page)
