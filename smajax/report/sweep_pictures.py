"""Pictures of a sweep: maps over two mismatches, curves over one, angles over time, and the comparison of controllers."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.collections import QuadMesh
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import FixedFormatter, FixedLocator

from smajax.control.position_unit import DEGREES, PositionUnit
from smajax.control.sweep.grid import Grid
from smajax.control.sweep.run_sweep import ControllerSweep
from smajax.report.drawing import named, panels
from smajax.report.series_plot import Line, Panel, SeriesPlot, set_point_line
from smajax.report.sweep_numbers import GREY, MAPPED, SHOWN, SUMMARIES, merit_values, over_set_points, shown_in

ROUNDING = 1e-6  # in the unit shown: below it a figure is a zero with rounding errors
COLOURS = ("#1f6fb2", "#c8553d", "#d9a441", "#3f8f5b", "#7a5195", "#8a8f98", "#1d1d1f", "#2aa5a0")
DASHES = ("-", "--", ":")  # of the first controllers, and of those that have the same colours again
# What the source calls the parameters whose robustness it shows (Elahinia 2004, sec. 4.8.4), and the others alike.
SOURCE_WORDS = {
    "inertia": "moment of inertia",
    "damping": "damping coefficient",
    "convection": "coefficient of convection",
    "ambient": "ambient temperature",
    "payload": "payload mass",
    "supply": "supply voltage",
}
WIDE = (0.5, 0.7, 1.0, 1.4, 2.0)  # ticks of ratios from 0.5 to 2


def mismatch_words(name: str, in_kelvins: bool = False) -> str:
    """`moment of inertia, plant over model`; of a temperature, of which a ratio tells nothing, their difference. The model is that of the controller."""
    words = SOURCE_WORDS.get(name, name)
    return f"{words}, plant minus model (K)" if in_kelvins else f"{words}, plant over model"


def _edges(ratios: np.ndarray) -> np.ndarray:
    """Of cells that have the ratios in their middle on a logarithmic axis."""
    steps = np.log(ratios)
    middle = 0.5 * (steps[1:] + steps[:-1])
    return np.exp(np.concatenate([[2.0 * steps[0] - middle[0]], middle, [2.0 * steps[-1] - middle[-1]]]))


def kelvins(air: float | None, name: str, ratio: float) -> str:
    """`+10` of the ambient temperature at 1.5 times the assumed `air` (degC); "" of another mismatch, or where the air is not known."""
    if name != "ambient" or air is None:
        return ""
    return "0" if ratio == 1.0 else f"{air * (ratio - 1.0):+.3g}"


def _ratio_axis(axis: Axis, ratios: np.ndarray, name: str, air: float | None) -> None:
    low, high = float(ratios[0]), float(ratios[-1])
    near = [round(float(one), 3) for one in (low, low**0.5, 1.0, high**0.5, high)]
    ticks = WIDE if np.allclose([low, high], [WIDE[0], WIDE[-1]]) else near
    axis.set_major_locator(FixedLocator(ticks))
    axis.set_major_formatter(FixedFormatter([kelvins(air, name, one) or f"{one:g}" for one in ticks]))
    axis.set_minor_locator(FixedLocator([]))


def draw_curves(figure: Figure, grid: Grid, sweep: ControllerSweep, air: float | None = None) -> None:
    """Over one mismatch alone: the median over the set points in reach as a line, their range as a band where all have a value."""
    for axes, name in zip(panels(figure, 2, 2), MAPPED, strict=True):
        label, unit, _ = shown_in(grid.plants.unit)[name]
        several = [over_set_points(grid, sweep, name, of)[:, 0] for of in (np.nanmin, np.nanmedian, np.nanmax)]
        least, middle, largest = several
        axes.plot(grid.ratios, middle, "o-", color=COLOURS[0], markersize=3, linewidth=1.3)
        axes.fill_between(grid.ratios, least, largest, color=COLOURS[0], alpha=0.2, linewidth=0)
        axes.set(xscale="log", xlim=_edges(grid.ratios)[[0, -1]])
        axes.axvline(1.0, color="#9aa0a8", linewidth=1.0, linestyle="--")
        _ratio_axis(axes.xaxis, grid.ratios, grid.first, air)
        gaps = f"; no line: {GREY[name][1]}" if name in GREY and np.isnan(middle).any() else ""
        in_kelvins = bool(kelvins(air, grid.first, 1.0))
        named(axes, mismatch_words(grid.first, in_kelvins), f"{label} ({unit}{gaps})")
        if np.isnan(middle).all():  # no value: no scale
            axes.set_yticks([])


Limits = Mapping[str, tuple[float, float]]


def common_limits(grid: Grid, sweeps: Sequence[ControllerSweep]) -> dict[str, tuple[float, float]]:
    """Of each figure that is mapped the least median and the largest worst case of all controllers, so that they have one scale of colours."""
    limits = {}
    for name in MAPPED:
        values = np.concatenate([_maps(grid, one, name).ravel() for one in sweeps])
        values = values[np.isfinite(values)]
        if values.size:
            limits[name] = (float(values.min()), float(values.max()))
    return limits


def _maps(grid: Grid, sweep: ControllerSweep, name: str) -> np.ndarray:
    """Median and worst case, (2, A, A)."""
    return np.stack([over_set_points(grid, sweep, name, of) for of in SUMMARIES.values()])


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


def draw_maps(
    figure: Figure, grid: Grid, sweep: ControllerSweep, limits: Limits | None = None, air: float | None = None
) -> None:
    """Median over the set points in reach, and the worst case beside it, at the nominal gain, over the two mismatches. limits: of the colours, by figure of merit.

    Dashed: one mismatch alone, as in the source. Grey: at more than half of the set points (of the worst case: at one) the angle never
    arrives or settles. air: the ambient temperature that the controller assumes, degC, for its errors in kelvins.
    """
    edges = _edges(grid.ratios)
    numbered, middle = len(grid.ratios) <= NUMBERED, int(np.argmin(np.abs(np.log(grid.ratios))))
    # Lines beside the numbers, where there are some: on them they would be minus signs.
    alone = edges[middle : middle + 2] if numbered else [1.0]
    across, up = (mismatch_words(one, bool(kelvins(air, one, 1.0))) for one in (grid.first, grid.second))
    several = {name: _maps(grid, sweep, name) for name in MAPPED}
    cells = [(name, how, values) for name in MAPPED for how, values in zip(SUMMARIES, several[name], strict=True)]
    for axes, (name, how, values) in zip(panels(figure, len(MAPPED), len(SUMMARIES)), cells, strict=True):
        label, unit, _ = shown_in(grid.plants.unit)[name]
        never = f"; grey: {GREY[name][1]}" if name in GREY and np.isnan(values).any() else ""
        axes.set_facecolor("#c9ccd1")
        finite = several[name][np.isfinite(several[name])]
        own = (float(finite.min()), float(finite.max())) if finite.size else (0.0, 1.0)
        low, high = (limits or {}).get(name, own)
        mesh = axes.pcolormesh(edges, edges, np.ma.masked_invalid(values).T, cmap="viridis", vmin=low, vmax=high)
        if numbered:
            _write_cells(axes, grid.ratios, values, mesh)
        axes.set(xscale="log", yscale="log")
        for axis, mismatch in ((axes.xaxis, grid.first), (axes.yaxis, grid.second)):
            _ratio_axis(axis, grid.ratios, mismatch, air)
        for at in alone:
            axes.axhline(at, color="white", linewidth=1.0, linestyle="--")
            axes.axvline(at, color="white", linewidth=1.0, linestyle="--")
        named(axes, across, up, f"{label}, {how}")
        if np.isnan(values).all():  # no value: no scale
            axes.set_title(f"{label}, {how}{never}", fontsize=9.5, loc="left")
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
    air: float | None = None,
) -> None:
    """Position over time with one mismatch at a time (Elahinia 2004, Fig. 4.23-4.25, for this controller)."""
    axes_of = panels(figure, -(-len(sweep.lines) // 3), min(3, len(sweep.lines)))
    for spare in axes_of[len(sweep.lines) :]:
        spare.axis("off")
    for axes, (mismatch, angles) in zip(axes_of, sweep.lines.items(), strict=False):
        for colour, ratio, angle in zip(COLOURS, ratios, angles, strict=False):
            axes.plot(time, unit.of(angle), color=colour, linewidth=1.2, label=f"{ratio:g}")
        axes.axhline(float(unit.of(target)), color="#9aa0a8", linewidth=0.8)
        errors = [kelvins(air, mismatch, ratio) for ratio in ratios]
        title = f": {', '.join(errors)} K" if all(errors) else ""
        named(axes, "time (s)", unit.axis, f"{SOURCE_WORDS.get(mismatch, mismatch)}{title}")
    # One key for all panels, where it covers no line.
    handles, labels = axes.get_legend_handles_labels()
    figure.legend(
        handles,
        labels,
        title="plant over model",
        loc="outside lower center",
        ncols=len(labels),
        columnspacing=1.0,
        handlelength=1.2,
        frameon=False,
    )


def _error_words(air: float | None, mismatch: str, ratio: float) -> str:
    error = kelvins(air, mismatch, ratio)
    return f"{error} K" if error else f"{ratio:g} times"


def lines_plot(
    time: np.ndarray,
    ratios: Sequence[float],
    sweep: ControllerSweep,
    target: float,
    unit: PositionUnit = DEGREES,
    air: float | None = None,
) -> SeriesPlot:
    """The same as a plot that moves: a panel a mismatch."""
    asked = set_point_line(np.full(len(time), float(unit.of(target))))
    panels = []
    for mismatch, angles in sweep.lines.items():
        lines = [
            Line(_error_words(air, mismatch, ratio), unit.of(angle), f"c{k}", 1.4)
            for k, (ratio, angle) in enumerate(zip(ratios, angles, strict=False))
        ]
        panels.append(
            Panel(mismatch_words(mismatch, bool(kelvins(air, mismatch, 1.0))), unit.label, (asked, *lines), height=150)
        )
    return SeriesPlot(f"{sweep.name}, one mismatch at a time", time, tuple(panels))


OVER_LEAST = "over least time"  # the first panel


def _over_least(sweep: ControllerSweep) -> np.ndarray:
    """Settling time over least time on the unperturbed plant; NaN where either has no number."""
    settling, least = np.asarray(sweep.nominal.settling_time), sweep.least.nominal
    known = np.isfinite(settling) & np.isfinite(least) & (least > 0.0)
    return np.where(known, settling / np.where(known, least, 1.0), np.nan)


def _draw_least(axes: Axes, targets: np.ndarray, sweeps: Sequence[ControllerSweep]) -> None:
    """The least time under the times of the controllers, a line for each plant among them: before it no command is there."""
    drawn: list[np.ndarray] = []
    lines: list[Line2D] = []
    for one in sweeps:
        least = np.where(np.isfinite(one.least.nominal), one.least.nominal, np.nan)
        if np.isnan(least).all() or any(np.allclose(least, other, equal_nan=True) for other in drawn):
            continue
        drawn.append(least)
        look: dict[str, Any] = {"color": "black", "linewidth": 2.2, "linestyle": DASHES[(len(drawn) - 1) % len(DASHES)]}
        of_plant = "least time" if len(drawn) == 1 else f"that of {one.name}'s plant"
        lines += axes.plot(targets, least, label=of_plant, zorder=1, **look)
        axes.fill_between(targets, 0.0, least, color="black", alpha=0.06, linewidth=0)
    if drawn:
        axes.set_ylim(bottom=0.0)
        # Above the panel: inside it would cover a controller's line.
        above: dict[str, Any] = {"loc": "lower right", "bbox_to_anchor": (1.0, 1.0), "borderaxespad": 0.0}
        axes.legend(handles=lines, frameon=False, fontsize=8, ncols=2, **above)


def draw_comparison(
    figure: Figure, targets: np.ndarray, sweeps: Sequence[ControllerSweep], position: PositionUnit = DEGREES
) -> None:
    """Settling time over least time and every figure of merit over the set point, one line a controller; the least time under theirs."""
    axes_of = panels(figure, 4, 2)
    for axes, name in zip(axes_of, (OVER_LEAST, *SHOWN), strict=True):
        for k, one in enumerate(sweeps):
            colour, dashes = COLOURS[k % len(COLOURS)], DASHES[k // len(COLOURS) % len(DASHES)]
            values = _over_least(one) if name == OVER_LEAST else merit_values(one.nominal, name, position)
            values = np.where(np.abs(values) < ROUNDING, 0.0, np.where(np.isfinite(values), values, np.nan))
            if np.isnan(values).all():
                nowhere = f"{one.name}: at no set point"
                axes.text(
                    0.03, 0.92 - 0.09 * len(axes.texts), nowhere, color=colour, transform=axes.transAxes, fontsize=9
                )
            look: dict[str, Any] = {"color": colour, "linestyle": dashes, "markersize": 3, "linewidth": 1.2}
            axes.plot(position.of(targets), values, marker="o", label=one.name, **look)
        if name in ("reach_time", "settling_time"):
            _draw_least(axes, position.of(targets), sweeps)
        if name == OVER_LEAST:
            axes.axhline(1.0, color="#9aa0a8", linewidth=0.8)
            named(axes, f"set point ({position.label})", "settling time over least time")
            continue
        label, unit, _ = shown_in(position)[name]
        named(axes, f"set point ({position.label})", f"{label} ({unit})")
    handles, labels = axes_of[0].get_legend_handles_labels()
    # Above all panels: on the first screen.
    figure.legend(handles, labels, frameon=False, fontsize=9, loc="outside upper center", ncols=min(len(labels), 4))
