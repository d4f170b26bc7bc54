"""`python -m studies.disturbances`: all controllers, `results.json`, the pictures and the tables of `README.md` (some three minutes); with names these alone, printed.

`--fast`: the nominal plant alone, printed.
"""

from __future__ import annotations

import json
import math
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from smajax.control.presets import CONTROLLERS
from smajax.core.files import json_text, replace
from smajax.core.runtime import prepare
from smajax.report.drawing import named, panels
from smajax.report.sweep_folder import numbered_png
from smajax.report.sweep_numbers import digest_of, plain
from studies.disturbances.loops import events_of, plants, positions
from studies.disturbances.scenarios import HELD, SECONDS, STEP, Scenario, scenarios
from studies.marked import put
from studies.requirement.run import COMPARED, gains_of

HERE = Path(__file__).parent
DRAWN_EVERY = 20  # samples
COLUMNS = 3
SEEN = 10.0  # degrees to either side of the set point that is held
FIGURES = ("peak_deg", "recovery_s", "steady_error_deg")


def judged(scenario: Scenario, angles: np.ndarray) -> dict[str, Any]:
    """Of one controller, (plants, n) degrees: median and worst over all events of all plants, the first plant being the nominal one."""
    events = [events_of(scenario, one) for one in angles]
    flat = np.asarray([event for loop in events for event in loop])
    return {
        "events": len(flat),
        "recovered": int(np.isfinite(flat[:, 1]).sum()),
        **{
            name: {"median": plain(np.median(column)), "worst": plain(column.max())}
            for name, column in zip(FIGURES, flat.T, strict=True)
        },
        "nominal": [dict(zip(FIGURES, map(plain, event), strict=True)) for event in events[0]],
    }


def table(results: dict[str, Any], name: str) -> str:
    """A row a controller, of one scenario; the best first: by events after which the arm is back, then by how soon."""
    peak = "overshoot" if name == "set_points" else "peak deviation"
    head = ["controller", "back within 1°, events", f"{peak}, median / worst, °", "back after, median / worst, s"]
    head.append("steady error, median / worst, °")
    rows = []
    for controller, of in results["controllers"].items():
        one = of[name]
        cells = [controller, f"{one['recovered']} of {one['events']}"]
        for figure, digits in zip(FIGURES, (1, 2, 2), strict=True):
            cells.append(" / ".join(_shown(one[figure][how], digits) for how in ("median", "worst")))
        median = one["recovery_s"]["median"]
        rows.append((-one["recovered"], math.inf if median is None else median, cells))
    lines = [head, ["---"] * len(head), *(cells for *_, cells in sorted(rows))]
    return "\n".join(f"| {' | '.join(cells)} |" for cells in lines)


def _shown(value: float | None, digits: int) -> str:
    return "never" if value is None else f"{value:.{digits}f}"


def draw(figure: Figure, scenario: Scenario, angles: dict[str, np.ndarray]) -> None:
    """A panel a controller: the angle of every plant, the nominal one dark, and the set point. The lowest panel of each column has the times below it."""
    time = STEP * np.arange(len(scenario.wanted))[::DRAWN_EVERY]
    rows = -(-len(angles) // COLUMNS)
    axes_of = panels(figure, rows, COLUMNS, share=True)
    for spare in axes_of[len(angles) :]:
        spare.axis("off")
    for number, (axes, (name, several)) in enumerate(zip(axes_of, angles.items(), strict=False)):
        axes.plot(time, scenario.wanted[::DRAWN_EVERY], color="#c8553d", linewidth=0.9, linestyle="--")
        for one in several[:0:-1]:
            axes.plot(time, one, color="#1f6fb2", linewidth=0.7, alpha=0.35)
        axes.plot(time, several[0], color="#1d1d1f", linewidth=1.1)
        # Of a disturbance what follows it, at a scale on which it is seen; who does not hold the set point leaves the panel.
        low, high = (HELD - SEEN, HELD + SEEN) if scenario.unit else (-50.0, 100.0)
        axes.set(ylim=(low, high), xlim=(scenario.events[0] - 2.0, SECONDS))
        lowest = number + COLUMNS >= len(angles)
        # Axes that are shared have the numbers in the last row alone, which is empty in some columns.
        axes.tick_params(labelbottom=lowest)
        named(axes, "time (s)" if lowest else "", "angle (°)", name)


def main(arguments: list[str]) -> None:
    """Run what is asked for; store all of it."""
    prepare(cores=True)
    names = [one for one in arguments if one in CONTROLLERS]
    happenings, ratios = scenarios(), plants(corners="--fast" not in arguments)
    results: dict[str, Any] = {"controllers": {}, "plants": ratios.tolist()}
    drawn: dict[str, dict[str, np.ndarray]] = {name: {} for name in happenings}
    for name in names or COMPARED:
        angles = positions(name, list(happenings.values()), ratios)
        found = {key: judged(one, each) for (key, one), each in zip(happenings.items(), angles, strict=True)}
        results["controllers"][name] = {"gains": gains_of(name)[1], **found}
        for key, each in zip(happenings, angles, strict=True):
            drawn[key][name] = np.round(each[:, ::DRAWN_EVERY], 3)
        print(name, json.dumps({key: {**one, "nominal": None} for key, one in found.items()}), flush=True)
    if names or "--fast" in arguments:
        return
    results["pictures"] = {
        f"{key}.png": digest_of({one: each.tolist() for one, each in of.items()}) for key, of in drawn.items()
    }
    replace(HERE / "results.json", json_text(results))
    text = (HERE / "README.md").read_text(encoding="utf-8")
    for key, scenario in happenings.items():
        digest = results["pictures"][f"{key}.png"]
        whole = numbered_png(partial(draw, scenario=scenario, angles=drawn[key]), (11.0, 10.0), 90, digest)
        replace(HERE / f"{key}.png", whole)
        text = put(text, f"<!-- {key} -->", table(results, key))
    replace(HERE / "README.md", text)
