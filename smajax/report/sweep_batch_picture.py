"""Picture of a sweep on a batch of plants: figures of merit over the values of the parameters in which the plants differ."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import scipy  # its parts are imported when they are first used
from matplotlib.figure import Figure

from smajax.control.sweep.grid import Grid
from smajax.control.sweep.run_sweep import ControllerSweep
from smajax.core.display_units import axis_label, display
from smajax.report.drawing import BLUE, GREY, RED, is_upright, named, panels
from smajax.report.sweep_numbers import MAPPED, over_set_points, shown_in

ACROSS = 3  # parameters drawn
EDGE = 0.97  # of the height of a panel: where a plant stands that has no number
KEY = (
    "median over the set points in reach",
    "the worst of them",
    "never settles (arrives) at more than half",
    "never settles (arrives) at some",
    "no set point in reach",
)


def draw_batch(figure: Figure, grid: Grid, sweep: ControllerSweep) -> None:
    """A row a figure of merit, a column a parameter, a plant a point: the median over the set points in reach, and the worst of them as a ring.

    Of more than `ACROSS` parameters those on which the figures hang most (`most_telling`). Dashed: the value that the controller
    assumes. At the upper edge a cross where the position never arrives or settles at more than half of the set points in reach, a plus
    where at some, and a grey dot where no set point is in reach.
    """
    plants = grid.plants
    assert plants.batch is not None
    middle, worst = _figures(grid, sweep)
    reached = np.isfinite(sweep.least.grid[:, 0]).any(axis=1)
    columns = most_telling(plants.batch, middle)
    axes_of = iter(panels(figure, len(MAPPED), len(columns)))
    for name, typical, largest in zip(MAPPED, middle, worst, strict=True):
        text, unit, _ = shown_in(plants.unit)[name]
        never, some = reached & np.isnan(typical), np.isfinite(typical) & np.isnan(largest)
        for column in columns:
            axes, parameter = next(axes_of), plants.columns[column]
            shown = display(plants.units[column], parameter)
            values = shown.of(plants.batch[:, column])
            axes.axvline(shown.of(float(plants.nominal[column])), color=GREY, linewidth=1.0, linestyle="--")
            axes.plot(values, largest, "o", color=BLUE, markersize=4.5, markerfacecolor="none", alpha=0.6, label=KEY[1])
            axes.plot(values, typical, "o", color=BLUE, markersize=3, label=KEY[0])
            for which, mark, colour, said in zip(
                (never, some, ~reached), "x+o", (RED, RED, GREY), KEY[2:], strict=True
            ):
                edge = np.full(int(which.sum()), EDGE)
                above = axes.get_xaxis_transform()
                axes.plot(values[which], edge, mark, color=colour, markersize=5, label=said, transform=above)
            named(axes, axis_label(parameter, shown), f"{text} ({unit})")
            if not np.isfinite(typical).any():  # no value: no scale
                axes.set_yticks([])
    handles, labels = axes.get_legend_handles_labels()
    across = 1 if is_upright(figure) else 3
    figure.legend(handles, labels, loc="outside lower center", ncols=across, frameon=False, fontsize=9)


def left_out(grid: Grid, sweep: ControllerSweep) -> list[str]:
    """The parameters that `draw_batch` has no place for."""
    assert grid.plants.batch is not None
    drawn = most_telling(grid.plants.batch, _figures(grid, sweep)[0])
    return [name for column, name in enumerate(grid.plants.columns) if column not in drawn]


def _figures(grid: Grid, sweep: ControllerSweep) -> tuple[list[np.ndarray], list[np.ndarray]]:
    """Median and worst over the set points in reach of each figure that is drawn, (plants,)."""
    middle, worst = (
        [over_set_points(grid, sweep, name, of)[:, 0] for name in MAPPED] for of in (np.nanmedian, np.nanmax)
    )
    return middle, worst


def most_telling(batch: np.ndarray, figures: Sequence[np.ndarray], count: int = ACROSS) -> list[int]:
    """The `count` columns of (plants, columns) with the largest rank correlation with one of the figures (plants,), in their order; what has no number ranks last."""
    if batch.shape[1] <= count:
        return list(range(batch.shape[1]))
    ranks = [scipy.stats.rankdata(np.nan_to_num(one, nan=np.inf)) for one in figures]
    varied = [one for one in ranks if np.ptp(one)]
    strength = [
        max((abs(np.corrcoef(scipy.stats.rankdata(column), one)[0, 1]) for one in varied), default=0.0)
        if np.ptp(column)
        else 0.0
        for column in batch.T
    ]
    return sorted(np.argsort(strength, kind="stable")[::-1][:count].tolist())
