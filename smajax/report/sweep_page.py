"""A sweep -> a folder: every closed loop as a row of CSV, maps and lines as pictures, one page that compares controllers."""

from __future__ import annotations

import csv
import dataclasses
import html
import io
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from matplotlib.axis import Axis
from matplotlib.figure import Figure
from matplotlib.ticker import FixedLocator, FormatStrFormatter

from smajax.control.figures_of_merit import Merit
from smajax.control.presets import CONTROLLERS, with_printed_law
from smajax.control.sweep import Grid
from smajax.core.files import replace
from smajax.core.provenance import made_with
from smajax.core.wording import and_listed, counted
from smajax.report.drawing import named, panels
from smajax.report.html import picture
from smajax.report.plain_page import bullets, table, whole

# Figure of merit -> (what it is called, unit shown, factor from SI).
SHOWN = {
    "reach_time": ("reach time", "s", 1.0),
    "settling_time": ("settling time", "s", 1.0),
    "overshoot": ("overshoot", "°", 180.0 / np.pi),
    "steady_error": ("steady error", "°", 180.0 / np.pi),
    "energy": ("energy into the wire", "J", 1.0),
    "switches_per_second": ("switches a second", "1/s", 1.0),
    "peak_temperature": ("peak temperature", "°C", 1.0),
}
NOTHING = 1e-6  # below this, in the unit shown, a figure is what rounding leaves of a zero
MAPPED = ("settling_time", "overshoot", "steady_error", "energy")
COLOURS = ("#1f6fb2", "#c8553d", "#d9a441", "#3f8f5b", "#7a5195", "#8a8f98", "#1d1d1f", "#2aa5a0")


@dataclass(frozen=True)
class Swept:
    """One controller's sweep: figures of merit and failures on the grid, and its lines by mismatch, (ratios, time)."""

    name: str
    main_gain: str
    merits: Merit
    failed_at: np.ndarray
    lines: Mapping[str, np.ndarray]


def _values(one: Merit, name: str) -> np.ndarray:
    return np.asarray(getattr(one, name)) * SHOWN[name][2]


def write_rows(path: Path, grid: Grid, swept: Swept) -> None:
    """Every closed loop in a row; angles in degrees, an empty cell where a time is infinite."""
    *shares, target, gain = (axis.ravel() for axis in grid.axes())
    shares = shares[: len(grid.mismatches)]
    lanes = np.stack([*shares, np.degrees(target), gain], axis=1)
    columns = [*(f"{name}_ratio" for name in grid.mismatches), "set_point_deg", f"{swept.main_gain}_ratio"]
    units = {"°": "deg", "°C": "degC", "1/s": "per_s"}
    merits = [f"{name}_{units.get(SHOWN[name][1], SHOWN[name][1])}" for name in SHOWN]
    table = np.stack([_values(swept.merits, name).ravel() for name in SHOWN], axis=1)
    text = io.StringIO(newline="")
    writer = csv.writer(text)
    writer.writerow([*columns, *merits, "failed_at_s"])
    for lane, row, failed in zip(lanes, table, swept.failed_at.ravel(), strict=True):
        cells = [*lane, *row, failed]
        writer.writerow([f"{cell:.6g}" if np.isfinite(cell) else "" for cell in cells])
    replace(path, text.getvalue())


def _edges(ratios: np.ndarray) -> np.ndarray:
    """Of cells that have the ratios in their middle on a logarithmic axis."""
    steps = np.log(ratios)
    middle = 0.5 * (steps[1:] + steps[:-1])
    return np.exp(np.concatenate([[2.0 * steps[0] - middle[0]], middle, [2.0 * steps[-1] - middle[-1]]]))


# What is no number where a run never gets there, or says nothing where it does not.
GREY = {"settling_time": ("settling_time", "never settles"), "overshoot": ("reach_time", "never arrives")}


def _over_set_points(grid: Grid, swept: Swept, name: str) -> tuple[np.ndarray, str]:
    """A figure of merit at the share of the gain nearest to 1, (A, A or 1, S), and what it is where half of the set points
    are never reached or settled at: no number, in words; empty where there is no such place.
    """
    at = int(np.argmin(np.abs(grid.gains - 1.0)))
    values = _values(swept.merits, name)[..., at]
    if name not in GREY:
        return values, ""
    deciding, why = GREY[name]
    never = ~np.isfinite(np.median(_values(swept.merits, deciding)[..., at], axis=2))
    return np.where(never[..., None], np.nan, values), why if never.any() else ""


def _ratio_axis(axis: Axis) -> None:
    axis.set_major_locator(FixedLocator([0.5, 0.7, 1.0, 1.4, 2.0]))
    axis.set_major_formatter(FormatStrFormatter("%g"))
    axis.set_minor_locator(FixedLocator([]))


def draw_over_one(figure: Figure, grid: Grid, swept: Swept) -> None:
    """The same over one mismatch alone: the median over the set points as a line, all of them as a band, where all have one."""
    for axes, name in zip(panels(figure, 2, 2), MAPPED, strict=True):
        label, unit, _ = SHOWN[name]
        values, never = _over_set_points(grid, swept, name)
        lines = np.stack([one(values[:, 0], axis=1) for one in (np.min, np.median, np.max)])
        lines[:, ~np.isfinite(lines[1])] = np.nan
        least, middle, largest = np.where(np.isfinite(lines), lines, np.nan)
        axes.plot(grid.ratios, middle, "o-", color=COLOURS[0], markersize=3, linewidth=1.3)
        axes.fill_between(grid.ratios, least, largest, color=COLOURS[0], alpha=0.2, linewidth=0)
        axes.set(xscale="log", xlim=_edges(grid.ratios)[[0, -1]])
        axes.axvline(1.0, color="#9aa0a8", linewidth=1.0, linestyle="--")
        _ratio_axis(axes.xaxis)
        gaps = f"; no line: {never}" if never else ""
        named(axes, f"{grid.first}, plant / controller", f"{label} ({unit}{gaps})")
        if np.isnan(middle).all():  # a scale would have nothing to say
            axes.set_yticks([])


def draw_maps(figure: Figure, grid: Grid, swept: Swept) -> None:
    """Median over the set points, at the share of the gain nearest to 1, over the two mismatches.

    Dashed: the source's single lines. Grey: where more than half of the set points are never reached or settled at.
    """
    edges = _edges(grid.ratios)
    for axes, name in zip(panels(figure, 2, 2), MAPPED, strict=True):
        label, unit, _ = SHOWN[name]
        several, why = _over_set_points(grid, swept, name)
        values, never = np.median(several, axis=2), f"; grey: {why}" if why else ""
        axes.set_facecolor("#c9ccd1")
        mesh = axes.pcolormesh(edges, edges, np.ma.masked_invalid(values).T, cmap="viridis")
        axes.set(xscale="log", yscale="log")
        for axis in (axes.xaxis, axes.yaxis):
            _ratio_axis(axis)
        axes.axhline(1.0, color="white", linewidth=1.0, linestyle="--")
        axes.axvline(1.0, color="white", linewidth=1.0, linestyle="--")
        named(axes, f"{grid.first}, plant / controller", f"{grid.second}, plant / controller", label)
        if np.isnan(values).all():  # a scale would have nothing to say
            axes.set_title(f"{label}{never}", fontsize=9.5, loc="left")
            continue
        bar = figure.colorbar(mesh, ax=axes)
        bar.ax.tick_params(labelsize=9)
        bar.set_label(f"{label} ({unit}{never})", fontsize=9)


def over_mismatches(grid: Grid, swept: Swept) -> str:
    """How a controller does on all the plants of the grid, in a sentence."""
    at = int(np.argmin(np.abs(grid.gains - 1.0)))
    settles = float(np.isfinite(_values(swept.merits, "settling_time")[..., at]).mean())
    beyond = float(np.nanmax(_values(swept.merits, "overshoot")[..., at]))
    return (
        f"On all mismatches of {and_listed(grid.mismatches)} it settles in {100 * settles:.0f} % of the runs at "
        f"{grid.gains[at]:g} times its main gain; overshoot up to {beyond:.3g}°."
    )


def draw_lines(figure: Figure, time: np.ndarray, ratios: Sequence[float], swept: Swept, target: float) -> None:
    """Angle over time with one mismatch at a time (Elahinia 2004, Fig. 4.23-4.25, for this controller)."""
    for axes, (mismatch, angles) in zip(panels(figure, 2, 3), swept.lines.items(), strict=True):
        for colour, ratio, angle in zip(COLOURS, ratios, angles, strict=False):
            axes.plot(time, np.degrees(angle), color=colour, linewidth=1.2, label=f"{ratio:g}")
        axes.axhline(np.degrees(target), color="#9aa0a8", linewidth=0.8)
        named(axes, "time (s)", "arm angle (°)", mismatch)
    # One key for all panels, where it covers no line.
    handles, labels = axes.get_legend_handles_labels()
    figure.legend(
        handles,
        labels,
        title="plant / controller",
        loc="outside lower center",
        ncols=len(labels),
        columnspacing=1.0,
        handlelength=1.2,
        frameon=False,
    )


def draw_comparison(figure: Figure, targets: np.ndarray, merits: Mapping[str, Merit]) -> None:
    """Every figure of merit over the set point, one line a controller."""
    axes_of = panels(figure, 4, 2)
    for axes, name in zip(axes_of, SHOWN, strict=False):
        for k, (colour, (controller, one)) in enumerate(zip(COLOURS, merits.items(), strict=False)):
            values = _values(one, name)
            values = np.where(np.abs(values) < NOTHING, 0.0, np.where(np.isfinite(values), values, np.nan))
            if np.isnan(values).all():
                nowhere = f"{controller}: nowhere"
                axes.text(0.03, 0.92 - 0.09 * k, nowhere, color=colour, transform=axes.transAxes, fontsize=9)
            axes.plot(np.degrees(targets), values, "o-", color=colour, markersize=3, linewidth=1.2, label=controller)
        label, unit, _ = SHOWN[name]
        named(axes, "set point (°)", f"{label} ({unit})")
    last = axes_of[-1]
    last.axis("off")
    handles, labels = axes_of[0].get_legend_handles_labels()
    last.legend(handles, labels, frameon=False, fontsize=9, loc="center", ncols=2)


def _cell(value: float) -> str:
    if np.isnan(value):
        return "no number"
    return "never" if np.isinf(value) else f"{value if abs(value) > NOTHING else 0.0:.3g}"


def comparison_rows(targets: np.ndarray, merits: Mapping[str, Merit]) -> list[list[str]]:
    """A row a controller: set points at which it settles, then median and worst of each figure of merit."""
    rows = []
    for name, one in merits.items():
        settles = int(np.isfinite(_values(one, "settling_time")).sum())
        cells = [name, f"{settles} of {len(targets)}"]
        for merit_name in SHOWN:
            values = _values(one, merit_name)
            middle, worst = float(np.median(values)), float(np.max(values))
            cells.append(" / ".join(_cell(v) for v in (middle, worst)))
        rows.append(cells)
    return rows


def page(
    targets: np.ndarray,
    merits: Mapping[str, Merit],
    grid: Grid,
    swept: Sequence[Swept],
    seconds: float,
    between: str,
    folder: Path,
    upright: Mapping[str, bytes],
    air: float,
    command: str = "",
) -> str:
    """One page for a browser, with the pictures that lie in `folder` inside; the rows as CSV lie beside it.

    upright: those pictures for a telephone. air: its temperature as the controllers believe it, degC.
    """
    say = html.escape
    head = ["controller", "settles at", *(f"{label} ({unit})" for label, unit, _ in SHOWN.values())]

    def drawn(name: str, alt: str) -> str:
        return str(picture((folder / name).read_bytes(), alt, "panels", upright[name]))

    parts = [
        f"<h3>{say(one.name)}</h3><p>{counted(grid.size, 'closed loop')} of {seconds:g} s; {failures(one)}. "
        f"{say(told(one.name))} "
        f'<a href="{one.name}.csv">every loop as CSV</a></p>'
        + drawn(f"{one.name}_maps.png", f"maps of {one.name}")
        + drawn(f"{one.name}_lines.png", f"lines of {one.name}")
        for one in swept
    ]
    top = (
        f"<h1>Controllers compared</h1>{bullets(conclusions(targets, merits, grid, swept))}<p>The plant as the controller believes it, "
        f"{len(targets)} set points from {np.degrees(targets.min()):.0f}° to {np.degrees(targets.max()):.0f}°; "
        f"median / worst over the set points. Within 1° counts as there. {say(between)}</p>"
    )
    drawn_as = (
        "Maps: median over the set points"
        if grid.second
        else "Lines: median over the set points; bands: all of them, where all come to rest"
    )
    mismatches = (
        f"<h2>Mismatch of {say(and_listed(grid.mismatches))}</h2><p>The plant's value over the one that the "
        f"controller believes, where it believes in one. {drawn_as}, at the gains that each controller begins with. "
        f"{say(air_in_words(grid, air))}</p>"
    )
    compared = [
        table(head, comparison_rows(targets, merits)),
        drawn("comparison.png", "figures of merit over the set point"),
    ]
    foot = [
        "<h2>Provenance</h2>",
        table(["", ""], [["command", command], *map(list, made_with().items())]),
        "<p class=quiet>The same numbers: sweep.json, sweep.nc (every loop, with named axes and units), and a CSV file for each controller.</p>",
    ]
    return whole("Controllers compared", [top, *compared, mismatches, *parts, *foot])


def air_in_words(grid: Grid, air: float) -> str:
    """What the ratios of the air's temperature are in kelvins: degrees Celsius have no zero to be a share of."""
    low, high = float(grid.ratios[0]), float(grid.ratios[-1])
    off = " to ".join(f"{air * (ratio - 1.0):+.3g}" for ratio in (low, high))
    return f"Ambient: {low:.3g} to {high:.3g} times the {air:g} °C believed is air that is {off} K off."


def conclusions(targets: np.ndarray, merits: Mapping[str, Merit], grid: Grid, swept: Sequence[Swept]) -> list[str]:
    """A sentence a controller: where it settles on the plant as believed, and on the others."""
    told = []
    for one in swept:
        settles = int(np.isfinite(_values(merits[one.name], "settling_time")).sum())
        as_believed = (
            f"{one.name} settles at {settles} of {counted(len(targets), 'set point')} on the plant as believed."
        )
        told.append(f"{as_believed} {over_mismatches(grid, one)}")
    return told


def told(name: str) -> str:
    """What a controller reads, and of which plant."""
    preset = CONTROLLERS[name]
    plant = " Plant: the integrated law without a thermal term (eq. 4.51)." if preset.plant is with_printed_law else ""
    return f"It reads {preset.told}.{plant}"


def failures(one: Swept) -> str:
    """How many loops gave no number, in words."""
    bad = int(np.isfinite(one.failed_at).sum())
    return (
        "none failed"
        if bad == 0
        else f"{bad} failed: the controller's answer was no finite voltage, or a gain is out of its bounds"
    )


def as_json(
    targets: np.ndarray,
    merits: Mapping[str, Merit],
    grid: Grid,
    swept: Sequence[Swept],
    between: str,
    command: str = "",
) -> str:
    """The comparison and what the grid was, SI; infinite times are null."""

    def plain(values: np.ndarray) -> list[float | None]:
        return [float(value) if np.isfinite(value) else None for value in np.asarray(values).ravel()]

    record = {
        "conclusions": conclusions(targets, merits, grid, swept),
        "between": between,
        "set_points_rad": plain(targets),
        "controllers": {
            name: {field.name: plain(getattr(one, field.name)) for field in dataclasses.fields(one)}
            for name, one in merits.items()
        },
        "sweep": {
            "mismatches": list(grid.mismatches),
            "ratios": plain(grid.ratios),
            "set_points_rad": plain(grid.targets),
            "gain_ratios": plain(grid.gains),
            "loops": grid.size,
            "failed": {one.name: int(np.isfinite(one.failed_at).sum()) for one in swept},
        },
        "command": command,
        "made_with": made_with(),
    }
    return json.dumps(record, indent=2) + "\n"
