"""Pictures of a sweep: maps over two mismatches, curves over one, angles over time, and the comparison of controllers."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.collections import QuadMesh
from matplotlib.figure import Figure
from matplotlib.ticker import FixedLocator, FormatStrFormatter

from smajax.control.figures_of_merit import Merit
from smajax.control.position_unit import DEGREES, PositionUnit
from smajax.control.sweep.grid import Grid
from smajax.control.sweep.run_sweep import ControllerSweep
from smajax.report.drawing import named, panels
from smajax.report.series_plot import Line, Panel, SeriesPlot, set_point_line

# Figure of merit -> (label, unit shown, factor from SI); of an angle.
SHOWN = {
    "reach_time": ("reach time", "s", 1.0),
    "settling_time": ("settling time", "s", 1.0),
    "overshoot": ("overshoot", "°", 180.0 / np.pi),
    "steady_error": ("steady error", "°", 180.0 / np.pi),
    "energy": ("energy into the wire", "J", 1.0),
    "switches_per_second": ("switches a second", "1/s", 1.0),
    "peak_temperature": ("peak temperature", "°C", 1.0),
}
ROUNDING = 1e-6  # in the unit shown: below it a figure is a zero with rounding errors
MAPPED = ("settling_time", "overshoot", "steady_error", "energy")
COLOURS = ("#1f6fb2", "#c8553d", "#d9a441", "#3f8f5b", "#7a5195", "#8a8f98", "#1d1d1f", "#2aa5a0")
DASHES = ("-", "--", ":")  # of the first controllers, and of those that have the same colours again
# Figure of merit -> (the one that decides whether it exists, what its absence means).
GREY = {"settling_time": ("settling_time", "never settles"), "overshoot": ("reach_time", "never arrives")}


def shown_in(unit: PositionUnit) -> dict[str, tuple[str, str, float]]:
    """`SHOWN` of a load whose position is shown in this unit."""
    own = {name: (label, unit.label, unit.factor) for name, (label, symbol, _) in SHOWN.items() if symbol == "°"}
    return SHOWN if unit.is_angle else {**SHOWN, **own}


def merit_values(one: Merit, name: str, unit: PositionUnit = DEGREES) -> np.ndarray:
    """A figure of merit in the unit shown."""
    return np.asarray(getattr(one, name)) * shown_in(unit)[name][2]


def nominal_gain(grid: Grid) -> int:
    """The index of the ratio of the main gain that is nearest to 1."""
    return int(np.argmin(np.abs(grid.gains - 1.0)))


def _edges(ratios: np.ndarray) -> np.ndarray:
    """Of cells that have the ratios in their middle on a logarithmic axis."""
    steps = np.log(ratios)
    middle = 0.5 * (steps[1:] + steps[:-1])
    return np.exp(np.concatenate([[2.0 * steps[0] - middle[0]], middle, [2.0 * steps[-1] - middle[-1]]]))


def _over_set_points(grid: Grid, sweep: ControllerSweep, name: str) -> tuple[np.ndarray, str]:
    """A figure of merit at the nominal gain, (A, A or 1, S), and the reason for its gaps; "" where there are none.

    It is NaN where at half of the set points the angle never arrives, or never settles.
    """
    at = nominal_gain(grid)
    values = merit_values(sweep.merits, name, grid.plants.unit)[..., at]
    if name not in GREY:
        return values, ""
    deciding, why = GREY[name]
    never = ~np.isfinite(np.median(merit_values(sweep.merits, deciding)[..., at], axis=2))
    return np.where(never[..., None], np.nan, values), why if never.any() else ""


def _ratio_axis(axis: Axis) -> None:
    axis.set_major_locator(FixedLocator([0.5, 0.7, 1.0, 1.4, 2.0]))
    axis.set_major_formatter(FormatStrFormatter("%g"))
    axis.set_minor_locator(FixedLocator([]))


def draw_curves(figure: Figure, grid: Grid, sweep: ControllerSweep) -> None:
    """Over one mismatch alone: the median over the set points as a line, their range as a band where all have a value."""
    for axes, name in zip(panels(figure, 2, 2), MAPPED, strict=True):
        label, unit, _ = shown_in(grid.plants.unit)[name]
        values, never = _over_set_points(grid, sweep, name)
        lines = np.stack([one(values[:, 0], axis=1) for one in (np.min, np.median, np.max)])
        lines[:, ~np.isfinite(lines[1])] = np.nan
        least, middle, largest = np.where(np.isfinite(lines), lines, np.nan)
        axes.plot(grid.ratios, middle, "o-", color=COLOURS[0], markersize=3, linewidth=1.3)
        axes.fill_between(grid.ratios, least, largest, color=COLOURS[0], alpha=0.2, linewidth=0)
        if not grid.numbered:
            axes.set(xscale="log", xlim=_edges(grid.ratios)[[0, -1]])
            axes.axvline(1.0, color="#9aa0a8", linewidth=1.0, linestyle="--")
            _ratio_axis(axes.xaxis)
        gaps = f"; no line: {never}" if never else ""
        across = "plant of the batch" if grid.numbered else f"{grid.first}, plant / controller"
        named(axes, across, f"{label} ({unit}{gaps})")
        if np.isnan(middle).all():  # no value: no scale
            axes.set_yticks([])


Limits = Mapping[str, tuple[float, float]]


def common_limits(grid: Grid, sweeps: Sequence[ControllerSweep]) -> dict[str, tuple[float, float]]:
    """Of each figure that is mapped the least and the largest median of all controllers, so that they have one scale of colours."""
    limits = {}
    for name in MAPPED:
        values = np.concatenate([np.median(_over_set_points(grid, one, name)[0], axis=2).ravel() for one in sweeps])
        values = values[np.isfinite(values)]
        if values.size:
            limits[name] = (float(values.min()), float(values.max()))
    return limits


NUMBERED = 9  # values of a mismatch up to which a map's cells have their numbers


def _write_cells(axes: Axes, ratios: np.ndarray, values: np.ndarray, mesh: QuadMesh) -> None:
    """The number of each cell in it, dark on light cells and light on dark ones."""
    low, high = mesh.get_clim()
    for across, row in zip(ratios, values, strict=True):
        for up, value in zip(ratios, row, strict=True):
            if np.isfinite(value):
                light = value - low > 0.6 * (high - low)
                text = f"{0.0 if abs(value) < ROUNDING else value:.2g}"
                look: dict[str, Any] = {
                    "ha": "center",
                    "va": "center",
                    "fontsize": 7,
                    "color": "#1d1d1f" if light else "white",
                }
                axes.text(across, up, f"{float(text):g}", **look)


def draw_maps(figure: Figure, grid: Grid, sweep: ControllerSweep, limits: Limits | None = None) -> None:
    """Median over the set points, at the nominal gain, over the two mismatches. limits: of the colours, by figure of merit.

    Dashed: one mismatch alone, as in the source. Grey: at more than half of the set points the angle never arrives or settles.
    """
    edges = _edges(grid.ratios)
    numbered, middle = len(grid.ratios) <= NUMBERED, int(np.argmin(np.abs(np.log(grid.ratios))))
    # Lines beside the numbers, where there are some: on them they would be minus signs.
    alone = edges[middle : middle + 2] if numbered else [1.0]
    for axes, name in zip(panels(figure, 2, 2), MAPPED, strict=True):
        label, unit, _ = shown_in(grid.plants.unit)[name]
        several, why = _over_set_points(grid, sweep, name)
        values, never = np.median(several, axis=2), f"; grey: {why}" if why else ""
        axes.set_facecolor("#c9ccd1")
        finite = values[np.isfinite(values)]
        own = (float(finite.min()), float(finite.max())) if finite.size else (0.0, 1.0)
        low, high = (limits or {}).get(name, own)
        mesh = axes.pcolormesh(edges, edges, np.ma.masked_invalid(values).T, cmap="viridis", vmin=low, vmax=high)
        if numbered:
            _write_cells(axes, grid.ratios, values, mesh)
        axes.set(xscale="log", yscale="log")
        for axis in (axes.xaxis, axes.yaxis):
            _ratio_axis(axis)
        for at in alone:
            axes.axhline(at, color="white", linewidth=1.0, linestyle="--")
            axes.axvline(at, color="white", linewidth=1.0, linestyle="--")
        named(axes, f"{grid.first}, plant / controller", f"{grid.second}, plant / controller", label)
        if np.isnan(values).all():  # no value: no scale
            axes.set_title(f"{label}{never}", fontsize=9.5, loc="left")
            continue
        bar = figure.colorbar(mesh, ax=axes)
        bar.ax.tick_params(labelsize=9)
        bar.set_label(f"{label} ({unit}{never})", fontsize=9)


def draw_lines(
    figure: Figure,
    time: np.ndarray,
    ratios: Sequence[float],
    sweep: ControllerSweep,
    target: float,
    unit: PositionUnit = DEGREES,
) -> None:
    """Position over time with one mismatch at a time (Elahinia 2004, Fig. 4.23-4.25, for this controller)."""
    axes_of = panels(figure, -(-len(sweep.lines) // 3), min(3, len(sweep.lines)))
    for spare in axes_of[len(sweep.lines) :]:
        spare.axis("off")
    for axes, (mismatch, angles) in zip(axes_of, sweep.lines.items(), strict=False):
        for colour, ratio, angle in zip(COLOURS, ratios, angles, strict=False):
            axes.plot(time, unit.of(angle), color=colour, linewidth=1.2, label=f"{ratio:g}")
        axes.axhline(float(unit.of(target)), color="#9aa0a8", linewidth=0.8)
        named(axes, "time (s)", unit.axis, mismatch)
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


def lines_plot(
    time: np.ndarray, ratios: Sequence[float], sweep: ControllerSweep, target: float, unit: PositionUnit = DEGREES
) -> SeriesPlot:
    """The same as a plot that moves: a panel a mismatch."""
    asked = set_point_line(np.full(len(time), float(unit.of(target))))
    panels = []
    for mismatch, angles in sweep.lines.items():
        lines = [
            Line(f"{ratio:g} times", unit.of(angle), f"c{k}", 1.4)
            for k, (ratio, angle) in enumerate(zip(ratios, angles, strict=False))
        ]
        panels.append(Panel(f"{mismatch}, plant over controller", unit.label, (asked, *lines), height=150))
    return SeriesPlot(f"{sweep.name}, one mismatch at a time", time, tuple(panels))


OVER_LEAST = "over least time"  # the first panel


def _over_least(sweep: ControllerSweep) -> np.ndarray:
    """Settling time over least time on the unperturbed plant; NaN where either has no number."""
    settling, least = np.asarray(sweep.nominal.settling_time), sweep.least.nominal
    known = np.isfinite(settling) & np.isfinite(least) & (least > 0.0)
    return np.where(known, settling / np.where(known, least, 1.0), np.nan)


def draw_comparison(
    figure: Figure, targets: np.ndarray, sweeps: Sequence[ControllerSweep], position: PositionUnit = DEGREES
) -> None:
    """Settling time over least time and every figure of merit over the set point, one line a controller."""
    axes_of = panels(figure, 4, 2)
    for axes, name in zip(axes_of, (OVER_LEAST, *SHOWN), strict=True):
        for k, one in enumerate(sweeps):
            colour, dashes = COLOURS[k % len(COLOURS)], DASHES[k // len(COLOURS) % len(DASHES)]
            values = _over_least(one) if name == OVER_LEAST else merit_values(one.nominal, name, position)
            values = np.where(np.abs(values) < ROUNDING, 0.0, np.where(np.isfinite(values), values, np.nan))
            if np.isnan(values).all():
                nowhere = f"{one.name}: at no set point"
                axes.text(0.03, 0.92 - 0.09 * k, nowhere, color=colour, transform=axes.transAxes, fontsize=9)
            look: dict[str, Any] = {"color": colour, "linestyle": dashes, "markersize": 3, "linewidth": 1.2}
            axes.plot(position.of(targets), values, marker="o", label=one.name, **look)
        if name == OVER_LEAST:
            axes.axhline(1.0, color="#9aa0a8", linewidth=0.8)
            named(axes, f"set point ({position.label})", "settling time over least time")
            continue
        label, unit, _ = shown_in(position)[name]
        named(axes, f"set point ({position.label})", f"{label} ({unit})")
    handles, labels = axes_of[0].get_legend_handles_labels()
    # Above all panels: on the first screen.
    figure.legend(handles, labels, frameon=False, fontsize=9, loc="outside upper center", ncols=min(len(labels), 4))
