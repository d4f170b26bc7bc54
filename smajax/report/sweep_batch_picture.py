"""Picture of a sweep on a batch of plants: figures of merit over the values of the parameters in which the plants differ."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import scipy.stats
from matplotlib.figure import Figure

from smajax.control.sweep.grid import Grid
from smajax.control.sweep.run_sweep import ControllerSweep
from smajax.core.display_units import axis_label, display
from smajax.report.drawing import BLUE, GREY, RED, named, panels
from smajax.report.sweep_numbers import GREY as ABSENT
from smajax.report.sweep_numbers import MAPPED, over_set_points, shown_in

ACROSS = 3  # parameters drawn
EDGE = 0.97  # of the height of a panel: where a plant stands that has no number


def draw_batch(figure: Figure, grid: Grid, sweep: ControllerSweep) -> None:
    """A row a figure of merit, a column a parameter, a plant a point: the median over the set points in reach, and the worst of them as a ring.

    Of more than `ACROSS` parameters those on which the figures hang most (`most_telling`). Dashed: the value that the controller
    assumes. A cross at the upper edge: at more than half of the set points the position never arrives or settles.
    """
    plants = grid.plants
    assert plants.batch is not None
    middle, worst = (
        [over_set_points(grid, sweep, name, of)[:, 0] for name in MAPPED] for of in (np.nanmedian, np.nanmax)
    )
    columns = most_telling(plants.batch, middle)
    axes_of = iter(panels(figure, len(MAPPED), len(columns)))
    for name, typical, largest in zip(MAPPED, middle, worst, strict=True):
        label, unit, _ = shown_in(plants.unit)[name]
        absent = f"; cross: {ABSENT[name][1]}" if name in ABSENT and np.isnan(typical).any() else ""
        for column in columns:
            axes, parameter = next(axes_of), plants.columns[column]
            shown = display(plants.units[column], parameter)
            values = shown.of(plants.batch[:, column])
            axes.axvline(shown.of(float(plants.nominal[column])), color=GREY, linewidth=1.0, linestyle="--")
            axes.plot(values, largest, "o", color=BLUE, markersize=4, markerfacecolor="none", linewidth=0, alpha=0.5)
            axes.plot(values, typical, "o", color=BLUE, markersize=3.5, linewidth=0)
            never = np.isnan(typical)
            edge = np.full(int(never.sum()), EDGE)
            axes.plot(values[never], edge, "x", color=RED, markersize=5, transform=axes.get_xaxis_transform())
            named(axes, axis_label(parameter, shown), f"{label} ({unit}{absent})")
            if never.all():  # no value: no scale
                axes.set_yticks([])


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
