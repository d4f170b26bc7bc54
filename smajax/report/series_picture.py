"""The picture of a `SeriesPlot`: what a page shows in print and without scripts."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence
from typing import Any

import numpy as np
from markupsafe import Markup
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from smajax.report.embedded import drawn_pictures, picture
from smajax.report.pictures import (
    AFTER,
    BEFORE,
    MEASURED,
    QUIET,
    as_png,
    extremes,
    literal,
    new_figure,
    tidy,
)
from smajax.report.plain_page import MANY
from smajax.report.series_plot import POINTS, Band, Line, SeriesPlot, moving, samples_of

# As look.css has them, for light pages: the picture is for paper.
COLOURS = {
    "measured": MEASURED,
    "before": BEFORE,
    "after": AFTER,
    "noise": "#c9cdd4",
    "band": AFTER,
    "predicted": "#9fc5b8",
    "input": "#5b6470",
    "asked": QUIET,
    "there": "#3f8f5b",
    "fraction": "#6a4c93",
    "tint": "#f1dcc0",
    **dict(
        zip(
            (f"c{k}" for k in range(8)),
            ("#1f6fb2", "#c8553d", "#d9a441", "#3f8f5b", "#7a5195", "#8a8f98", "#1d1d1f", "#2aa5a0"),
            strict=True,
        )
    ),
}
PIXELS = 62.0  # of a panel's height to an inch
DPI = 110  # it is looked at on paper, or without scripts
COARSE = 72  # where a page has many
LABEL = 16  # characters in a line of a vertical label


def as_picture(plot: SeriesPlot, dpi: int = DPI, keyed: bool = True) -> bytes:
    """As a PNG: the panels one below the other, the key above."""
    heights = [panel.height for panel in plot.panels]
    figure = new_figure((sum(heights) + 56.0) / PIXELS)
    rows = list(figure.subplots(len(heights), 1, sharex=True, squeeze=False, height_ratios=heights)[:, 0])
    for axes, panel in zip(rows, plot.panels, strict=True):
        for start, end in plot.spans:
            axes.axvspan(start, end, color=COLOURS["tint"], alpha=0.35, zorder=0, linewidth=0)
        for band in panel.bands:
            _draw_band(axes, plot.at, band)
        for line in panel.lines:
            _draw_line(axes, plot.at, line)
        small = panel.height < 90
        axes.set_ylabel(literal(textwrap.fill(panel.label, LABEL)), fontsize=8 if small else 9)
        tidy(axes)
        axes.margins(x=0.01)
        if panel.range:
            axes.set_ylim(*panel.range)
    rows[-1].set_xlabel(plot.axis_label, fontsize=9)
    if keyed:
        _key(figure, rows)
    figure.align_ylabels(rows)
    return as_png(figure, dpi)


def _draw_line(axes: Axes, at: np.ndarray, line: Line) -> None:
    # A sample whose neighbours are missing is on no line.
    dots: dict[str, Any] = {"marker": ".", "markersize": 3.0} if np.isnan(line.values).any() else {}
    style = {"color": COLOURS[line.colour], "linewidth": line.width, "alpha": line.alpha, **dots}
    name = "_" if line.silent else literal(line.name)
    axes.plot(*extremes(at, line.values), **style, linestyle="--" if line.dash else "-", label=name)


def _draw_band(axes: Axes, at: np.ndarray, band: Band) -> None:
    thin = slice(None, None, max(1, len(at) // POINTS))
    name = "_" if band.silent else literal(band.name)
    look: dict[str, Any] = {"color": COLOURS[band.colour], "alpha": band.alpha, "linewidth": 0.0}
    axes.fill_between(at[thin], band.low[thin], band.high[thin], **look, label=name)


def _key(figure: Figure, rows: list[Axes]) -> None:
    """Each name once, above all panels."""
    named: dict[str, Any] = {}
    for axes in rows:
        for handle, name in zip(*axes.get_legend_handles_labels(), strict=True):
            named.setdefault(name, handle)
    figure.legend(
        named.values(), named.keys(), loc="outside upper center", ncols=min(len(named), 4), frameon=False, fontsize=9
    )


def series(plot: SeriesPlot, most: int = POINTS, dpi: int = DPI, drawn: bool = True) -> Markup:
    """The plot for a page, with its picture; without one where a page has so many that they are folded away."""
    return _for_page(plot, as_picture(plot, dpi) if drawn else None, most)


def _for_page(plot: SeriesPlot, drawn: bytes | None, most: int) -> Markup:
    if drawn is None:
        return moving(plot, Markup('<p class="quiet">{}: this plot needs scripts.</p>').format(plot.about), most)
    return moving(plot, picture(drawn, plot.about), most)


def series_of_runs(plots: Sequence[Sequence[SeriesPlot]], most: int | None = None, drawn: bool = True) -> list[Markup]:
    """The plots of each run for a page: those that are folded away (`plain_page.folded`) without pictures, coarse ones where there are many.

    most: samples of each series; by default what a page has room for that holds no others. drawn: whether any has a picture.
    """
    every = [plot for several in plots for plot in several]
    samples, dpi = samples_of(every) if most is None else most, COARSE if len(every) > MANY else DPI
    asked = [plot for several in plots[:MANY] for plot in several] if drawn else []
    pictures = iter(drawn_pictures([(as_picture, (plot, dpi)) for plot in asked]))
    return [Markup("").join(_for_page(plot, next(pictures, None), samples) for plot in several) for several in plots]
