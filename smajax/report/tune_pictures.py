"""Pictures of a tuning, each a function from the record to a PNG."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import FuncFormatter

from smajax.control.tune.objective import rank
from smajax.control.tune.terms import TERMS, terms_in
from smajax.control.tune.tuning import TuningResult
from smajax.report.pictures import AFTER, BEFORE, MEASURED, NARROW, QUIET, as_png, new_figure, tidy
from smajax.report.series_plot import Line, Panel, SeriesPlot, set_point_line

WIDE = 9.6  # inches
COLUMNS = list(TERMS)


def before_after(result: TuningResult) -> bytes:
    """Positions over time with the preset's gains and with the tuned ones, and what was asked for over the set point."""
    terms = [name for name in ("settling_time", "overshoot", "steady_error") if name in TERMS]
    figure = new_figure(7.4, width=WIDE)
    top, bottom = np.asarray(figure.subfigures(2, 1, height_ratios=[1.15, 1.0]))
    left, right = top.subplots(1, 2, sharey=True)
    below = list(bottom.subplots(1, len(terms)))
    lines, unit = result.lines, result.settings.shown
    alone = len(np.unique(lines.targets))
    for axes, angles, colour, name in (
        (left, lines.angles[0], BEFORE, "before: the preset's gains"),
        (right, lines.angles[1], AFTER, "after: tuned"),
    ):
        for target in np.unique(lines.targets):
            axes.axhline(unit.of(target), color=QUIET, linewidth=0.7, linestyle="--")
        for number, angle in enumerate(angles):
            believed = number < alone
            axes.plot(
                lines.time,
                unit.of(angle),
                color=colour,
                linewidth=1.5 if believed else 0.5,
                alpha=1.0 if believed else 0.5,
            )
        axes.set_title(name, fontsize=9.5, loc="left")
        axes.set_xlabel("time (s)", fontsize=9)
        tidy(axes)
    left.set_ylabel(unit.axis, fontsize=9)
    if len(lines.targets) > alone:
        right.plot([], [], color=MEASURED, linewidth=1.5, label="plant as believed")
        right.plot([], [], color=MEASURED, linewidth=0.5, label="plants never seen")
        right.legend(frameon=False, fontsize=8, loc="lower right")
    for axes, name in zip(below, terms, strict=True):
        _over_set_points(axes, result, name)
    return as_png(figure)


def positions_plot(result: TuningResult) -> SeriesPlot:
    """Positions over time with the preset's gains and with the tuned ones, those of plants never seen thin."""
    lines, unit = result.lines, result.settings.shown
    targets = np.unique(lines.targets)
    panels = []
    for angles, colour, name in (
        (lines.angles[0], "before", "before: the preset's gains"),
        (lines.angles[1], "after", "after: tuned"),
    ):
        asked = [
            set_point_line(np.full(len(lines.time), float(unit.of(target))), silent=number > 0)
            for number, target in enumerate(targets)
        ]
        drawn = []
        for number, angle in enumerate(angles):
            known = number < len(targets)
            what = "plant as believed" if known else "plants never seen"
            width, alpha = (1.6, 1.0) if known else (0.7, 0.45)
            drawn.append(Line(what, unit.of(angle), colour, width, alpha, silent=number not in (0, len(targets))))
        panels.append(Panel(name, unit.label, (*asked, *drawn), height=190))
    return SeriesPlot("positions over time before and after", lines.time, tuple(panels))


def merits_picture(result: TuningResult, upright: bool = False) -> bytes:
    """Figures of merit over the set point, before and after; upright: one below the other, for a telephone."""
    terms = [name for name in ("settling_time", "overshoot", "steady_error") if name in TERMS]
    figure = new_figure(2.9 * len(terms), NARROW) if upright else new_figure(3.3, WIDE)
    panels = figure.subplots(*((len(terms), 1) if upright else (1, len(terms))))
    for axes, name in zip(panels, terms, strict=True):
        _over_set_points(axes, result, name)
    return as_png(figure)


def _over_set_points(axes: Axes, result: TuningResult, name: str) -> None:
    """A figure of merit, from its least to its largest over the plants at each set point; never settled at the top."""
    unit = result.settings.shown
    term, column = terms_in(unit)[name], COLUMNS.index(name)
    way = float(unit.of(np.ptp(result.lines.targets) or 10.0 * result.lines.targets[0]))
    least = 1e-3 if unit.is_angle else 1e-3 * abs(way)
    beside = 0.7 if unit.is_angle else 0.006 * abs(way)
    never = 2.0 * result.settings.seconds if name == "settling_time" else np.inf
    shown = [("tuned on", "s"), ("inside", "o")]
    for which, (colour, label, shift) in enumerate(((BEFORE, "before", -beside), (AFTER, "after", beside))):
        for check, marker in shown:
            one = result.checks[check]
            for target in np.unique(one.scenarios.targets):
                values = one.seen.exact[which, one.scenarios.targets == target, column]
                at = float(unit.of(target)) + shift
                ends = np.where(values >= never, 1.08 * result.settings.seconds, values)
                axes.plot([at, at], [ends.min(), ends.max()], color=colour, linewidth=1.4)
                lost = bool((values >= never).any())
                filled = colour if check == "tuned on" else "white"
                axes.plot(
                    at,
                    ends.max(),
                    "x" if lost else marker,
                    color=colour,
                    markersize=5 if lost else 3.5,
                    markerfacecolor=filled,
                )
        axes.plot([], [], "s-", color=colour, markersize=3.5, label=label)
    if any((result.checks[check].seen.exact[..., column] >= never).any() for check, _ in shown):
        at_top = 1.08 * result.settings.seconds
        axes.annotate("never", (0.01, at_top), xycoords=("axes fraction", "data"), fontsize=8, va="bottom")
    if name in result.settings.limits:
        axes.axhline(result.settings.limits[name], color=MEASURED, linewidth=0.9, linestyle=":", label="limit")
    # Room above for the legend.
    axes.set_ylim(0.0, 1.35 * max(axes.dataLim.y1, result.settings.limits.get(name, 0.0), least))
    axes.plot([], [], "o", color=QUIET, markerfacecolor="white", markersize=3.5, label="never seen")
    axes.set_xlabel(f"set point ({unit.label})", fontsize=9)
    axes.set_title(f"{term.label} ({term.unit})", fontsize=9.5, loc="left")
    axes.legend(frameon=False, fontsize=7.5, loc="upper left", ncols=2)
    tidy(axes)


def costs_over_loops(result: TuningResult) -> bytes:
    """What each round of each start and the best of each generation cost, over the closed loops run so far; the best as a line."""
    descent, evolution = result.descent, result.evolution
    figure = new_figure(3.2)
    axes = figure.subplots()
    costs, excesses = descent.costs[: descent.round], descent.excesses[: descent.round]
    loops = np.broadcast_to(descent.ran[: descent.round, None], costs.shape)
    seen = [("s", loops, costs, excesses, "a start's round")]
    if evolution.generations:
        first = np.argmin(rank(evolution.costs, evolution.excesses), axis=1)[:, None]
        cost, excess = (np.take_along_axis(one, first, axis=1) for one in (evolution.costs, evolution.excesses))
        seen.append(("d", evolution.ran[:, None], cost, excess, "a generation's best"))
    limits = bool(result.settings.limits)
    for marker, at, cost, excess, label in seen:
        within = excess <= 0.0
        for mask, filled, told in (
            (within, AFTER, f"{label}, within the limits" if limits else label),
            (~within & np.isfinite(excess), "white", f"{label}, a limit exceeded"),
        ):
            if mask.any():
                axes.plot(at[mask], cost[mask], marker, color=AFTER, markerfacecolor=filled, markersize=4, label=told)
    ran = np.concatenate([at.ravel() for _, at, *_ in seen])
    within = np.concatenate([np.where(excess <= 0.0, cost, np.inf).ravel() for *_, cost, excess, _ in seen])
    order = np.argsort(ran, kind="stable")
    best = np.minimum.accumulate(within[order])
    if np.isfinite(best).any():
        known = np.isfinite(best)
        axes.step(ran[order][known], best[known], where="post", color=MEASURED, label="best so far")
    axes.axhline(result.costs[0], color=BEFORE, linewidth=0.9, linestyle="--", label="the preset's gains")
    every = np.concatenate([cost.ravel() for _, _, cost, *_ in seen])
    finite = every[np.isfinite(every) & (every > 0.0)]
    if finite.size and finite.max() > 5.0 * finite.min():
        axes.set_yscale("log")
        for formatter in (axes.yaxis.set_major_formatter, axes.yaxis.set_minor_formatter):
            formatter(FuncFormatter(lambda value, _: f"{value:g}" if f"{value:.0e}"[0] in "125" else ""))
    axes.set_xlabel("closed loops run", fontsize=9)
    axes.set_ylabel("cost", fontsize=9)
    axes.legend(frameon=False, fontsize=8)
    tidy(axes)
    return as_png(figure)
