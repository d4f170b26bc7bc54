"""A single run -> CSV, NetCDF, JSON, pictures and a page."""

from __future__ import annotations

import html
import io
import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from smajax.control.figures_of_merit import STEADY_SHARE, SetPointMerit, merit_units
from smajax.control.mismatch import in_words
from smajax.control.run_request import MEASURED
from smajax.control.run_result import RunResult
from smajax.core.display_units import axis_label, digits, display, label
from smajax.core.files import as_netcdf, csv_text, heading, json_text, replace
from smajax.core.parameters import parameter_values, parameters
from smajax.core.progress import Progress, Stage, quiet
from smajax.model.load.base import AbstractMovingLoad
from smajax.report.animation import moving
from smajax.report.drawing import BLUE, GREY, RED, UPRIGHT, named, panels
from smajax.report.html import picture
from smajax.report.integration_words import integration_sentence
from smajax.report.plain_page import bullets, table, whole

AT_STOP = 1e-3  # of the way moved: nearer is at a stop
STILL = 1e-3  # a smaller change of the martensite fraction is no transformation
ROUNDING = 1e-9  # of the way moved: nearer to zero is a rounding error
APART = ("parameters (SI)", "integration_error")  # attributes that a record and a page have in their own place
PLAIN = ("temperature", "martensite_fraction", "stress")


def as_csv(data: xr.Dataset) -> str:
    """One row a sample, SI, units in the heading: `time [s],voltage [V],...`; smajax reads it back."""
    columns = {"time": data["time"], **data.data_vars}
    head = [heading(str(name), one.attrs["units"]) for name, one in columns.items()]
    return csv_text(head, np.stack([one.to_numpy() for one in columns.values()], axis=1).tolist())


def record(result: RunResult, command: str, series: bool = True) -> dict[str, Any]:
    """Everything in SI: the model, least, greatest and last of each variable, figures of merit, and the series."""
    data, units, own = result.data, _units(result), result.system.load.reading[1]
    return {
        "command": command,
        "provenance": {name: _plain(name, text) for name, text in data.attrs.items() if name not in APART},
        "integration_error": integration_error(data),
        "parameters": parameter_values(result.system),
        "mismatch": {
            # `believed` is the old name of `assumed`, until version 0.3.
            one.name: {
                "assumed": one.assumed,
                "believed": one.assumed,
                "true": one.true,
                "unit": one.unit,
                "ratio": one.ratio,
            }
            for one in result.mismatches
        },
        "notes": list(result.notes),
        "conclusions": conclusions(result),
        "merit": _merit(result.merit, units),
        "merit_by_set_point": [
            {
                "begin_s": one.begin,
                "end_s": one.end,
                f"set_point_{own}": one.set_point,
                "merit": _merit(_figures(one), units),
            }
            for one in result.by_set_point
        ],
        "summary": {
            str(name): {
                "unit": one.attrs["units"],
                "least": float(one.min()),
                "greatest": float(one.max()),
                "last": float(one[-1]),
            }
            for name, one in data.data_vars.items()
        },
        "series": {str(name): data[name].to_numpy().tolist() for name in ("time", *data.data_vars)} if series else {},
    }


def integration_error(data: xr.Dataset) -> dict[str, Any]:
    """What the integration leaves in the variables, as `IntegrationError.record`; empty where nothing is known of it."""
    return dict(json.loads(data.attrs.get("integration_error", "{}")))


def error_rows(data: xr.Dataset) -> dict[str, str]:
    """What the integration leaves in each variable of `summary_rows` by its label, root mean square, in the unit that is shown."""
    shown = {str(name): one.attrs for name, one in data.data_vars.items()}
    return {
        label(name): digits(display(of["units"], name).of(of["integration_error"]), 2)
        if "integration_error" in of
        else ""
        for name, of in shown.items()
    }


def _plain(name: str, text: str) -> Any:
    """An attribute as it was before it became text: `dt` a number, `gains` numbers by name; a version stays text."""
    try:
        return text if name.startswith(("version of ", "git")) else json.loads(text)
    except ValueError:
        return text


def _units(result: RunResult) -> dict[str, str]:
    """Of the figures of merit, SI."""
    return merit_units(result.system.load.reading[1])


def _merit(figures: Mapping[str, float], units: Mapping[str, str]) -> dict[str, Any]:
    return {name: {"value": value, "unit": units[name]} for name, value in figures.items()}


def _figures(one: SetPointMerit) -> dict[str, float]:
    return {name: float(value) for name, value in vars(one.merit).items()}


def _inputs(data: xr.Dataset) -> list[str]:
    """The variables that are inputs of the model."""
    names = [str(name) for name in data.data_vars]
    return [name for name in names[: names.index("temperature")] if name != "wanted"]


def measured_of(data: xr.Dataset) -> dict[str, tuple[str, np.ndarray]]:
    """Sensor -> (variable of the run, measured series (n,)) of the logs that the run is held against."""
    return {
        str(name).removeprefix(MEASURED): (str(one.attrs["of"]), one.to_numpy())
        for name, one in data.data_vars.items()
        if str(name).startswith(MEASURED)
    }


def measured_sentences(result: RunResult) -> list[str]:
    """How far the run is off from the logs that it is held against; and without the mean, which may be a sensor's zero."""
    sentences = []
    for name, (of, _) in measured_of(result.data).items():
        unit, found = display(result.data[of].attrs["units"], name), result.data[f"{MEASURED}{name}"].attrs
        off, about = (digits(unit.of(found[key]), 3) for key in ("error_rms", "error_rms_without_mean"))
        sentences.append(
            f"The measured {label(name)} is off by {off} {unit.unit} (rms), by {about} {unit.unit} without its mean."
        )
    return sentences


def _moves(data: xr.Dataset) -> bool:
    """Whether the load has a position; a coupon's has no unit, and is zero as its velocity is."""
    return bool(data["position"].attrs["units"] != "-")


def _reads_force(data: xr.Dataset) -> bool:
    """Whether the load's own sensor is a load cell."""
    return "force" in data and np.array_equal(data["reading"], data["force"], equal_nan=True)


def _path(data: xr.Dataset) -> str:
    """The variable that a run is about."""
    return "strain" if not _moves(data) else "force" if _reads_force(data) else "position"


def picture_of(data: xr.Dataset, form: str = "png", upright: bool = False) -> bytes:
    """Input, position, temperature, fraction and stress over time, and the hysteresis of the position; `form`: png or svg.

    Of a coupon the strain stands in the place of the position, of a load cell the force. upright: one below the other, for a telephone.
    """
    inputs = _inputs(data)
    path = _path(data)
    shown = [*inputs[:1], path, *PLAIN]
    figure = Figure(figsize=(UPRIGHT if upright else 10.0, 8.2))
    axes = panels(figure, 3, 2)
    time = data["time"].to_numpy()

    def values(name: str) -> tuple[Any, str]:
        unit = display(data[name].attrs["units"], name)
        return unit.of(data[name].to_numpy()), axis_label(name, unit)

    for one, name in zip(axes, shown, strict=False):
        what, said = values(name)
        one.plot(time, what, color=RED if name in inputs else BLUE, linewidth=1.3)
        for of, logged in measured_of(data).values():
            if of == name or (of == "reading" and name == path):
                one.plot(
                    time,
                    display(data[of].attrs["units"], name).of(logged),
                    color=GREY,
                    linewidth=2.6,
                    alpha=0.55,
                    zorder=1,
                )
        if name == "position" and "wanted" in data:
            one.plot(time, values("wanted")[0], color=GREY, linewidth=1.0, linestyle="--")
        named(one, "time (s)", said)
    last = axes[len(shown)]
    temperature, said = values("temperature")
    position, other = values(path)
    last.plot(temperature, position, color=BLUE, linewidth=1.1)
    named(last, said, other)
    for spare in axes[len(shown) + 1 :]:
        spare.axis("off")
    image = io.BytesIO()
    figure.savefig(image, dpi=150, facecolor="white", format=form)
    return image.getvalue()


def _redundant(data: xr.Dataset) -> set[str]:
    """Variables to leave out: the position of a coupon, and a sensor reading that equals the true value."""
    moves = _moves(data)
    true = ("position", "force") if moves else ("strain", "stress")
    again = any(np.array_equal(data["reading"], data[name], equal_nan=True) for name in true)
    return {*(() if moves else ("position", "velocity")), *(("reading",) if again else ())}


def summary_rows(data: xr.Dataset) -> list[list[str]]:
    """A row a variable: least, greatest, last, in the units that a reader sees; the reading where it is not the true value."""
    rows = []
    logged = [f"{MEASURED}{name}" for name in measured_of(data)]
    for name, one in data.drop_vars([*_redundant(data), *logged]).data_vars.items():
        unit, values = display(one.attrs["units"], str(name)), one.to_numpy()
        least, greatest, last = float(values.min()), float(values.max()), float(values[-1])
        # A zero with rounding errors.
        rounding = 1e-12 * max(abs(least), abs(greatest))
        cells = [digits(unit.of(0.0 if abs(value) < rounding else value)) for value in (least, greatest, last)]
        rows.append([label(str(name)), *cells, unit.unit])
    return rows


def merit_rows(result: RunResult) -> list[list[str]]:
    """A row a figure of merit; the steady ones with the time over which they are means, since a short run may still be moving."""
    units = _units(result)
    steady = f" (last {STEADY_SHARE:.0%} of the run)"
    return [
        [
            label(name) + steady * name.startswith("steady"),
            _cell(name, value, units),
            "" if np.isinf(value) else display(units[name], name).unit,
        ]
        for name, value in result.merit.items()
    ]


def _cell(name: str, value: float, units: Mapping[str, str]) -> str:
    return "never" if np.isinf(value) else digits(display(units[name], name).of(value), 3)


def set_point_rows(result: RunResult) -> tuple[list[str], list[list[str]]]:
    """(head, rows): a row a set point, from its start to the next one."""
    units = _units(result)
    of = display(result.system.load.reading[1])
    head = [
        f"set point ({of.unit})",
        "from (s)",
        "to (s)",
        *(axis_label(name, display(unit, name)) for name, unit in units.items()),
    ]
    rows = [
        [
            digits(of.of(one.set_point)),
            digits(one.begin),
            digits(one.end),
            *(_cell(name, value, units) for name, value in _figures(one).items()),
        ]
        for one in result.by_set_point
    ]
    return head, rows


MISMATCH_HEAD = ("parameter", "the controller assumes", "the plant has", "unit", "difference")


def mismatch_rows(result: RunResult) -> list[list[str]]:
    """A row a parameter, as `MISMATCH_HEAD`, in SI as the parameters are."""
    return [
        [
            one.name,
            "not in its model" if one.assumed is None else digits(one.assumed, 6),
            digits(one.true, 6),
            one.unit,
            in_words(one.assumed, one.true, one.unit),
        ]
        for one in result.mismatches
    ]


def conclusions(result: RunResult) -> list[str]:
    """The run in sentences: temperature, transformation, stroke, and whether a closed loop settles."""
    data = result.data
    if result.notes and not np.isfinite(data["temperature"]).all():
        return []

    def at(name: str, value: float) -> str:
        unit = display(data[name].attrs["units"], name)
        return f"{digits(unit.of(float(value)), 3)} {unit.unit}".strip()

    degrees, reading = data["temperature"].to_numpy(), data["reading"].to_numpy()
    hottest = int(degrees.argmax())
    sentences = [
        f"The wire is at most {at('temperature', degrees[hottest])}, {at('time', data['time'].to_numpy()[hottest])} in."
    ]
    fraction = data["martensite_fraction"]
    least, greatest, last = float(fraction.min()), float(fraction.max()), float(fraction[-1])
    if greatest - least < STILL:
        sentences.append(f"It does not transform: the martensite fraction stays at {digits(last, 3)}.")
    else:
        sentences.append(
            f"It transforms: the martensite fraction lies between {least:.2f} and {greatest:.2f}, at the end {last:.2f}."
        )
    name = result.system.load.reading[0]
    unit = display(data["reading"].attrs["units"], name)
    stroke = float(np.ptp(reading))

    def read(value: float) -> str:
        shown = 0.0 if abs(value) < ROUNDING * stroke else unit.of(float(value))
        return f"{digits(shown, 3)} {unit.unit}".strip()

    sentences.append(
        f"The {label(name)} starts at {read(reading[0])}, lies between {read(reading.min())} and "
        f"{read(reading.max())}, and ends at {read(reading[-1])}."
    )
    sentences += measured_sentences(result)
    sentences += _at_ends(result)
    if result.merit:
        settles = result.merit["settling_time"]
        sentences.append(
            f"The loop settles after {digits(settles, 3)} s." if np.isfinite(settles) else "The loop never settles."
        )
    if result.by_set_point:
        of, after = (
            display(result.system.load.reading[1]),
            [float(one.merit.settling_time) for one in result.by_set_point],
        )
        each = [
            f"{digits(of.of(one.set_point))} {of.unit} "
            + (f"after {digits(late, 3)} s" if np.isfinite(late) else "never")
            for one, late in zip(result.by_set_point, after, strict=True)
        ]
        sentences.append(
            f"The loop settles at {int(np.isfinite(after).sum())} of {len(each)} set points: {', '.join(each)}."
        )
    return sentences


def _at_ends(result: RunResult) -> list[str]:
    """Whether the load reaches a stop, and whether its wire goes slack."""
    load, time = result.system.load, result.data["time"].to_numpy()
    if not isinstance(load, AbstractMovingLoad):
        return []
    reading, stress = result.data["reading"].to_numpy(), result.data["stress"].to_numpy()
    room = AT_STOP * max(float(np.ptp(reading)), 1e-12)
    sentences = []
    for word, stop, sign in zip(("lower", "upper"), load.limits(), (-1.0, 1.0), strict=True):
        there = sign * (reading - float(stop)) > -room
        if np.isfinite(float(stop)) and there.any() and not there[0]:
            first = time[int(there.argmax())]
            sentences.append(
                f"It runs into its {word} stop, first {first:.3g} s in, and is there for {there.mean() * time[-1]:.3g} s."
            )
    slack = stress <= 0.0
    if slack[1:].any():
        first = time[1 + int(slack[1:].argmax())]
        sentences.append(f"The wire goes slack, first {first:.3g} s in, for {slack.mean() * time[-1]:.3g} s in all.")
    return sentences


def page(result: RunResult, image: bytes, title: str, command: str, animations: Sequence[bytes] = ()) -> str:
    """The whole page, pictures inside. animations: the animation as wide and as upright as a window, if there is one."""
    table_of = parameters(result.system)
    values = [
        [name, digits(value, 6), table_of[name].unit, table_of[name].about]
        for name, value in parameter_values(result.system).items()
    ]
    parts = [f"<h1>{html.escape(title)}</h1>", bullets([*result.notes, *conclusions(result)])]
    if result.mismatches:
        parts.append(table(MISMATCH_HEAD, mismatch_rows(result), (1, 2)))
    if result.merit:
        parts.append(table(["figure of merit", "value", "unit"], merit_rows(result), (1,)))
    if result.by_set_point:
        head, rows = set_point_rows(result)
        parts.append(table(head, rows, range(len(head))))
        parts.append("<p class=quiet>Each from its start to the next one; times count from its start.</p>")
    animation, upright = animations or (None, None)
    errors = error_rows(result.data)
    parts += [
        str(picture(image, "the run over time", "panels", picture_of(result.data, upright=True))),
        str(picture(animation, "the load moving, beside the wire's path through its phase diagram", "panels", upright)),
        table(
            ["variable", "least", "greatest", "last", "integration error", "unit"],
            [[*row[:-1], errors.get(row[0], ""), row[-1]] for row in summary_rows(result.data)],
            (1, 2, 3, 4),
        ),
        f"<p class=quiet>{html.escape(integration_sentence(integration_error(result.data)))}</p>",
        "<h2>Parameters (SI, temperatures in °C, angles in rad)</h2>",
        table(["parameter", "value", "unit", "what it is"], values, (1,)),
        "<h2>Provenance</h2>",
        table(
            ["", ""],
            [
                ["command", command],
                *([k, str(v)] for k, v in result.data.attrs.items() if v and k not in APART),
            ],
        ),
        "<p class=quiet>The same numbers: simulate.csv, simulate.nc, simulate.json.</p>",
    ]
    return whole(title, parts)


FILES: Sequence[str] = tuple(f"simulate.{kind}" for kind in ("csv", "nc", "json", "png", "svg", "gif", "html"))


def write_run(
    result: RunResult, folder: Path, title: str, command: str, animated: bool = False, progress: Progress = quiet
) -> Path:
    """All files of a run into `folder`, each in one step; the path of the page. animated: an animation too (no coupon)."""
    progress(Stage("pictures", 0.0))
    image = picture_of(result.data)
    replace(folder / "simulate.csv", as_csv(result.data))
    replace(folder / "simulate.nc", as_netcdf(result.data))
    replace(folder / "simulate.json", json_text(record(result, command)))
    replace(folder / "simulate.png", image)
    replace(folder / "simulate.svg", picture_of(result.data, "svg"))
    progress(Stage("pictures", 1.0))
    animations = (
        [moving(result.system, result.data, upright=each, progress=progress) for each in (False, True)]
        if animated
        else []
    )
    if animations:
        replace(folder / "simulate.gif", animations[0])
    return replace(folder / "simulate.html", page(result, image, title, command, animations))
