"""Gains tuned on several models and evaluated on one plant: sentences, a table, a picture, JSON, a page, and a file of gains."""

from __future__ import annotations

import html
import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from smajax.control.gains_file import write_gains
from smajax.control.tuned_on_models import ControlComparison, TunedOnModel
from smajax.core.display_units import digits, label
from smajax.core.files import json_text, replace
from smajax.core.provenance import made_with
from smajax.report.loop_words import loop_rows
from smajax.report.next_steps import MODEL, PlantWords, Step, after_tune, section
from smajax.report.plain_page import bullets, headline, table, whole
from smajax.report.series_picture import COARSE, series
from smajax.report.series_plot import Line, Panel, SeriesPlot, set_point_line

COLOURS = ("before", "after", "there")
SAME = 0.02  # of a settling time: a smaller difference is none
ROUNDING = 1e-6  # of a set point: a smaller error is none


def files_of(controller: str) -> tuple[str, ...]:
    """What `write_comparison` writes."""
    return f"{controller}_gains.json", f"control_{controller}.json", f"control_{controller}.html"


def _seen(error: float, set_point: float) -> float:
    """An error, or zero where it is a rounding error of the set point."""
    return 0.0 if error < ROUNDING * abs(set_point) else error


def head(result: ControlComparison) -> tuple[str, ...]:
    """Of `rows`."""
    unit = result.unit.label
    return ("tuned on", f"set point ({unit})", "settling time (s)", f"overshoot ({unit})", f"steady error ({unit})")


def rows(result: ControlComparison) -> list[list[str]]:
    """A row a model and set point."""
    shown = result.unit.of
    return [
        [
            one.model,
            digits(float(shown(loop.set_point)), 3),
            digits(loop.settling_time, 3) if math.isfinite(loop.settling_time) else "never",
            digits(float(shown(_seen(loop.overshoot, loop.set_point))), 2),
            digits(float(shown(_seen(loop.steady_error, loop.set_point))), 2),
        ]
        for one in result.tuned
        for loop in one.loops
    ]


def conclusions(result: ControlComparison) -> list[str]:
    """Each model's loops in a sentence, and then what the last model's gains are worth over the first's."""
    sentences = []
    for one in result.tuned:
        settled = sum(math.isfinite(loop.settling_time) for loop in one.loops)
        if settled == len(one.loops):
            text = f"settles after {digits(one.settling_time, 3)} s on average"
        else:
            text = f"settles at {settled} of {len(one.loops)} set points" if settled else "settles at no set point"
        largest = max(abs(loop.set_point) for loop in one.loops)
        overshoot = digits(float(result.unit.of(_seen(one.overshoot, largest))), 2)
        sentences.append(
            f"{result.controller} tuned on the {one.model} {text}, with an overshoot of at most {overshoot} {result.unit.label}, on the {result.plant}."
        )
    others = [f"{one.name} ({one.model:.4g} and {one.plant:.4g} {one.unit})" for one in result.differs]
    if others:
        sentences.append(
            f"Mind: the {result.plant} differs from the models in what was taken as known: {', '.join(others)}."
        )
    if len(result.tuned) > 1 and result.plant == result.tuned[-1].model:
        sentences.append(
            f"Mind: the {result.plant} is the plant as well, and the gains tuned on it are evaluated on the model that they were tuned on. This is what they are "
            "worth if that model is true."
        )
    return [*sentences, worth(result)] if len(result.tuned) > 1 else sentences


def worth(result: ControlComparison) -> str:
    """What the difference of the first and the last model comes to."""
    before, after = result.tuned[0], result.tuned[-1]
    first, last = before.settling_time, after.settling_time
    if math.isfinite(first) and math.isfinite(last):
        if abs(first - last) <= SAME * max(first, last):
            what = "changes the settling time by less than 2 %"
        else:
            earlier = "earlier" if last < first else "later"
            what = f"makes it settle {abs(last / first - 1.0):.0%} {earlier}, after {digits(last, 3)} s and not {digits(first, 3)} s on average"
    elif math.isfinite(last):
        what = "makes it settle where it did not"
    elif math.isfinite(first):
        what = "keeps it from settling"
    else:
        what = "does not make it settle at every set point"
    return f"Tuning on the {after.model} in the place of the {before.model} {what}."


def record(result: ControlComparison, command: str = "") -> dict[str, Any]:
    """The numbers, SI, for a program."""
    return {
        "command": command,
        "controller": result.controller,
        "plant": result.plant,
        "position_unit": result.unit.own,
        "conclusions": conclusions(result),
        "tuned_on": [
            {
                "model": one.model,
                "gains": {name: {"value": value, "unit": one.units[name]} for name, value in one.gains.values.items()},
                "fixed": {name: {"value": value, "unit": one.units[name]} for name, value in one.gains.fixed.items()},
                "loop": one.gains.loop.record(),
                "loops": [
                    {
                        "set_point": loop.set_point,
                        "settling_time": loop.settling_time,
                        "overshoot": loop.overshoot,
                        "steady_error": loop.steady_error,
                    }
                    for loop in one.loops
                ],
            }
            for one in result.tuned
        ],
        "made_with": made_with(),
    }


def loop_plots(result: ControlComparison) -> list[SeriesPlot]:
    """The position over time at each set point, by the gains of each model."""
    shown, plots = result.unit, []
    for number, first in enumerate(result.tuned[0].loops):
        lines = [
            Line(f"tuned on the {one.model}", np.asarray(shown.of(one.loops[number].position)), colour, 1.5)
            for one, colour in zip(result.tuned, COLOURS, strict=False)
        ]
        target = float(shown.of(first.set_point))
        lines.append(set_point_line(np.full(len(first.time), target)))
        panel = Panel(f"position, set point {target:.3g}", shown.label, tuple(lines), height=210)
        plots.append(
            SeriesPlot(f"{result.controller} at the set point {target:.3g} {shown.label}", first.time, (panel,))
        )
    return plots


def _settings(result: ControlComparison) -> list[list[str]]:
    """A row a setting of the loop and a parameter that was not tuned, a column a model."""
    loops = [loop_rows(one.gains.loop, one.largest) for one in result.tuned]
    rows = [[several[0][0], *(one[1] for one in several)] for several in zip(*loops, strict=True)]
    for name in result.tuned[0].gains.fixed:
        values = [f"{digits(one.gains.fixed[name], 4)} {one.units[name]}" for one in result.tuned]
        rows.append([label(name), *values])
    return rows


def page(result: ControlComparison, command: str = "", steps: Sequence[Step] = ()) -> str:
    """The whole page. steps: what a reader may do next."""
    title = f"{result.controller}: what the model is worth in control"
    names = list(result.tuned[0].gains.values)
    gains = [
        [label(name), *(digits(one.gains.values[name], 4) for one in result.tuned), result.tuned[0].units[name]]
        for name in names
    ]
    parts = [
        f"<h1>{html.escape(title)}</h1>",
        headline(worth(result) if len(result.tuned) > 1 else conclusions(result)[0]),
        f'<div class="pair">{"".join(series(plot, dpi=COARSE) for plot in loop_plots(result))}</div>',
        f"<p class=quiet>Each loop is a step from the start, cold and at rest, on the {html.escape(result.plant)}. Gains were tuned on each model and on plants drawn from its "
        "posterior, with the same settings; each model takes the best for its own plants of all gains that were found. The command stays within that of the fit runs.</p>",
        table(head(result), rows(result), (1, 2, 3, 4)),
        bullets(conclusions(result)[:-1] if len(result.tuned) > 1 else conclusions(result)[1:]),
        section(steps),
        "<h2>Gains</h2>",
        table(["gain", *(one.model for one in result.tuned), "unit"], gains, range(1, 1 + len(result.tuned))),
        "<h2>What the gains were tuned with</h2>",
        table(["setting", *(one.model for one in result.tuned)], _settings(result)),
        "<h2>Provenance</h2>",
        table(["", ""], [["command", command], *map(list, made_with().items())]),
        f"<p class=quiet>The same numbers: {files_of(result.controller)[1]}; the gains tuned on the {result.tuned[-1].model}: {files_of(result.controller)[0]}.</p>",
    ]
    return whole(title, parts)


def write_comparison(result: ControlComparison, folder: Path, command: str = "") -> Path:
    """The gains of the last model as `smajax sweep` and `simulate` read them, the numbers and the page; the path of the page."""
    folder.mkdir(parents=True, exist_ok=True)
    gains, numbers, shown = files_of(result.controller)
    best: TunedOnModel = result.tuned[-1]
    write_gains(folder / gains, best.gains, best.units, {"tuned on": best.model, "command": command, **made_with()})
    replace(folder / numbers, json_text(record(result, command)))
    return replace(folder / shown, page(result, command, _steps(result, folder, gains)))


def _steps(result: ControlComparison, folder: Path, gains: str) -> list[Step]:
    """With the gains of the last model, whose file is in the same folder."""
    loops = result.tuned[-1].loops
    points = [float(f"{float(result.unit.of(one.set_point)):.3g}") for one in loops]
    seconds = math.ceil(float(loops[0].time[-1]))
    return after_tune(folder, PlantWords(model=str(folder / MODEL)), gains, points, result.unit.shown, seconds)
