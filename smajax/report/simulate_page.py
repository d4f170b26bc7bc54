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

from smajax.control.figures_of_merit import band_of
from smajax.control.gains_file import fixed_parameters
from smajax.control.presets import CONTROLLERS
from smajax.control.run_result import RunResult
from smajax.control.scales import unit_on
from smajax.core.display_units import axis_label, digits, display, label
from smajax.core.files import as_netcdf, csv_text, heading, json_text, replace
from smajax.core.parameters import parameter_values, parameters
from smajax.core.progress import Progress, Stage, quiet
from smajax.report import animation
from smajax.report.drawing import BLUE, GREEN, GREY, RED, UPRIGHT, keyed, named, panels, styled
from smajax.report.embedded import picture
from smajax.report.integration_words import integration_sentence
from smajax.report.loop_words import loop_rows, source_sentences
from smajax.report.measured_log import draw_measured, measured_of
from smajax.report.next_steps import Step, section
from smajax.report.note_words import note_sentences
from smajax.report.pictures import NARROW, as_png
from smajax.report.plain_page import bullets, headline, table, whole
from smajax.report.series_plot import Band, Line, Panel, SeriesPlot, moving, set_point_line
from smajax.report.simulate_words import (
    MISMATCH_HEAD,
    answer,
    conclusions,
    error_rows,
    figures_of,
    integration_error,
    merit_rows,
    merit_rule,
    mismatch_rows,
    path_of,
    run_sentences,
    set_point_rows,
    summary_rows,
    units_of,
)

APART = ("parameters (SI)", "integration_error")  # attributes that a record and a page have in their own place
FRAMES, FEW_FRAMES = 72, 45  # of the animation, and of that for a telephone, which the page holds too
PLAIN = ("temperature", "martensite_fraction", "stress")


def as_csv(data: xr.Dataset) -> str:
    """One row a sample, SI, units in the heading: `time [s],voltage [V],...`; smajax reads it back."""
    columns = {"time": data["time"], **data.data_vars}
    head = [heading(str(name), one.attrs["units"]) for name, one in columns.items()]
    return csv_text(head, np.stack([one.to_numpy() for one in columns.values()], axis=1).tolist())


def record(result: RunResult, command: str, series: bool = True) -> dict[str, Any]:
    """Everything in SI: the model, least, greatest and last of each variable, figures of merit, and the series."""
    data, units, own = result.data, units_of(result), result.system.load.reading[1]
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
        "notes": note_sentences(result.notes),
        "headline": answer(result),
        "conclusions": conclusions(result),
        "settings": list(source_sentences(result.settings)),
        "loop": None if result.loop is None else result.loop.record(),
        "merit_rule": merit_rule(result),
        "merit": _merit(result.merit, units),
        "tracking_error": {part: {"value": value, "unit": own} for part, value in result.tracking_error.items()},
        "merit_by_set_point": [
            {
                "begin_s": one.begin,
                "end_s": one.end,
                f"set_point_{own}": one.set_point,
                "merit": _merit(figures_of(one), units),
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


def _plain(name: str, text: str) -> Any:
    """An attribute as it was before it became text: `dt` a number, `gains` numbers by name; a version stays text."""
    try:
        return text if name.startswith(("version of ", "git")) else json.loads(text)
    except ValueError:
        return text


def _merit(figures: Mapping[str, float], units: Mapping[str, str]) -> dict[str, Any]:
    return {name: {"value": value, "unit": units[name]} for name, value in figures.items()}


def _inputs(data: xr.Dataset) -> list[str]:
    """The variables that are inputs of the model."""
    names = [str(name) for name in data.data_vars]
    return [name for name in names[: names.index("temperature")] if name != "wanted"]


def picture_of(data: xr.Dataset, form: str = "png", upright: bool = False, band: float = 0.0) -> bytes:
    """Input, position, temperature, fraction and stress over time, and the hysteresis of the position; `form`: png or svg.

    Of a coupon the strain stands in the place of the position, of a load cell the force. upright: one below the other, for a telephone.
    band: how near counts as there, rad or m.
    """
    inputs, path = _inputs(data), path_of(data)
    shown = [*inputs[:1], path, *PLAIN]
    if "wanted" in data:
        shown[:2] = shown[1::-1]  # the position first, which says whether the loop settles
    figure = Figure(figsize=(UPRIGHT if upright else 10.0, 8.2))
    axes = panels(figure, 3, 2)
    time = data["time"].to_numpy()

    def values(name: str) -> tuple[Any, str]:
        unit = display(data[name].attrs["units"], name)
        return unit.of(data[name].to_numpy()), axis_label(name, unit)

    for one, name in zip(axes, shown, strict=False):
        what, said = values(name)
        one.plot(time, what, color=RED if name in inputs else BLUE, linewidth=1.3)
        draw_measured(one, data, name, path)
        if name == "position" and "wanted" in data:
            wanted = values("wanted")[0]
            near = display(data["wanted"].attrs["units"], "wanted").of(band)
            one.plot(time, wanted, color=GREY, linewidth=1.0, linestyle="--", label="set point")
            one.fill_between(
                time, wanted - near, wanted + near, color=GREEN, alpha=0.25, linewidth=0, label="counts as there"
            )
            keyed(one)
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


def series_of(result: RunResult) -> SeriesPlot:
    """Input, position with its set point, temperature, fraction and stress over time, each in its panel."""
    data = result.data
    inputs, path, band = _inputs(data), path_of(data), _band(result)
    shown = [*inputs[:1], path, *PLAIN]
    if "wanted" in data:
        shown[:2] = shown[1::-1]
    panels = []
    for name in shown:
        unit = display(data[name].attrs["units"], name)
        lines = [
            Line("measured", unit.of(logged), "asked", 2.6, 0.55)
            for of, logged in measured_of(data).values()
            if of == name or (of == "reading" and name == path)
        ]
        bands: tuple[Band, ...] = ()
        lines.append(Line(label(name), unit.of(data[name].to_numpy()), "c1" if name in inputs else "c0", silent=True))
        if name == "position" and "wanted" in data:
            wanted = unit.of(data["wanted"].to_numpy())
            near = unit.of(band)
            lines.append(set_point_line(wanted))
            bands = (Band("counts as there", wanted - near, wanted + near, "there", 0.25),)
        panels.append(Panel(label(name), unit.unit, tuple(lines), bands, 150 if name in (path, "temperature") else 96))
    return SeriesPlot("the run over time", data["time"].to_numpy(), tuple(panels))


def hysteresis(data: xr.Dataset) -> bytes:
    """The position, or what stands in its place, over the temperature."""
    figure = Figure(figsize=(NARROW, 3.2), layout="constrained")
    axes = figure.subplots()
    path = path_of(data)
    sides = []
    for name in ("temperature", path):
        unit = display(data[name].attrs["units"], name)
        sides.append((unit.of(data[name].to_numpy()), axis_label(name, unit)))
    (across, below), (up, beside) = sides
    axes.plot(across, up, color=BLUE, linewidth=1.1)
    named(styled(axes)[0], below, beside)
    return as_png(figure)


def settings_rows(result: RunResult) -> list[list[str]]:
    """What lies between plant and controller, and the controller's gains and other parameters."""
    loop, controller = result.loop, result.controller
    if loop is None or controller is None:
        return []
    name = result.data.attrs["controller"]
    table_of, values = parameters(controller), parameter_values(controller)
    shown = [*CONTROLLERS[name].box, *fixed_parameters(name, controller)]
    gains = [[one, f"{digits(values[one], 4)} {unit_on(table_of[one].unit, result.system)}"] for one in shown]
    return [*loop_rows(loop, float(controller.largest_command())), *gains]


def page(
    result: RunResult,
    image: bytes,
    title: str,
    command: str,
    animations: Sequence[bytes] = (),
    steps: Sequence[Step] = (),
) -> str:
    """The whole page, pictures inside. animations: the animation as wide and as upright as a window, if there is one.

    steps: what a reader may do next.
    """
    table_of = parameters(result.system)
    values = [
        [name, digits(value, 6), table_of[name].unit, table_of[name].about]
        for name, value in parameter_values(result.system).items()
    ]
    film, upright = animations or (None, None)
    errors = error_rows(result.data)
    parts = [
        f"<h1>{html.escape(title)}</h1>",
        headline(answer(result)),
        bullets(note_sentences(result.notes)),
        str(moving(series_of(result), picture(image, "the run over time", "panels"))),
        str(picture(hysteresis(result.data), "hysteresis: over the wire's temperature", "narrow")),
        str(picture(film, "the load moving, beside the wire's path through its phase diagram", "panels", upright)),
        *_merit_part(result),
        bullets(run_sentences(result)),
        section(steps),
        *_settings_part(result),
        "<h2>The run</h2>",
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
                *([k, str(v)] for k, v in result.data.attrs.items() if v and k not in {*APART, "gains"}),
            ],
        ),
        "<p class=quiet>The same numbers: simulate.csv, simulate.nc, simulate.json.</p>",
    ]
    return whole(title, parts)


def _band(result: RunResult) -> float:
    """How near counts as there in a closed loop, rad or m."""
    return float(band_of(result.assumed or result.system)) if "wanted" in result.data else 0.0


def _merit_part(result: RunResult) -> list[str]:
    """The figures of merit of a closed loop."""
    rule = f"{html.escape(merit_rule(result))}</p>"
    if rows := merit_rows(result):
        said = [f"<p class=quiet>{rule}"] if result.merit else []
        return [table(["figure of merit", "value", "unit"], rows, (1,)), *said]
    if not result.by_set_point:
        return []
    head, several = set_point_rows(result)
    note = f"<p class=quiet>Each from its start to the next one; times count from its start. {rule}"
    return [table(head, several, range(len(head))), note]


def _settings_part(result: RunResult) -> list[str]:
    """The loop, where its settings come from, and in what the plant differs from the controller's model."""
    rows = settings_rows(result)
    parts = (
        ["<h2>Controller and loop</h2>", bullets(source_sentences(result.settings)), table(["", ""], rows)]
        if rows
        else []
    )
    if result.mismatches:
        parts += ["<h2>In what the plant differs from the controller's model</h2>"]
        parts.append(table(MISMATCH_HEAD, mismatch_rows(result), (1, 2)))
    return parts


FILES: Sequence[str] = tuple(f"simulate.{kind}" for kind in ("csv", "nc", "json", "png", "svg", "gif", "html"))


def write_run(
    result: RunResult,
    folder: Path,
    title: str,
    command: str,
    animated: bool = False,
    progress: Progress = quiet,
    steps: Sequence[Step] = (),
) -> Path:
    """All files of a run into `folder`, each in one step; the path of the page. animated: an animation too (no coupon). steps: what a reader may do next."""
    progress(Stage("pictures", 0.0))
    band = _band(result)
    image = picture_of(result.data, band=band)
    replace(folder / "simulate.csv", as_csv(result.data))
    replace(folder / "simulate.nc", as_netcdf(result.data))
    replace(folder / "simulate.json", json_text(record(result, command)))
    replace(folder / "simulate.png", image)
    replace(folder / "simulate.svg", picture_of(result.data, "svg", band=band))
    progress(Stage("pictures", 1.0))
    animations = (
        [
            animation.moving(result.system, result.data, upright=each, frames=frames, progress=progress)
            for each, frames in ((False, FRAMES), (True, FEW_FRAMES))
        ]
        if animated
        else []
    )
    if animations:
        replace(folder / "simulate.gif", animations[0])
    return replace(folder / "simulate.html", page(result, image, title, command, animations, steps))
