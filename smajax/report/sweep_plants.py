"""What a sweep on a batch of plants says of these: how far they differ, and which of them a controller bears worst."""

from __future__ import annotations

import html
from typing import NamedTuple

import numpy as np

from smajax.control.plants import PlantSet
from smajax.control.sweep.grid import Grid
from smajax.control.sweep.run_sweep import ControllerSweep
from smajax.core.display_units import display, label
from smajax.core.wording import and_listed
from smajax.report.plain_page import table
from smajax.report.sweep_batch_picture import left_out
from smajax.report.sweep_numbers import merit_values, nominal_gain

HARDEST = 5  # plants that are listed


def _shown(plants: PlantSet, column: int, value: float) -> str:
    """With its unit, as a reader sees it."""
    shown = display(plants.units[column], plants.columns[column])
    return f"{shown.of(float(value)):.4g} {shown.unit}".rstrip()


def differing(plants: PlantSet) -> str:
    """`damping (0.0015 to 0.0059 N m s/rad; assumed 0.003) and ...`: the range of each parameter, and what the controller assumes."""
    assert plants.batch is not None
    low, high = plants.batch.min(axis=0), plants.batch.max(axis=0)
    ranges = []
    for column, name in enumerate(plants.columns):
        shown = display(plants.units[column], name)
        least, most, assumed = (f"{shown.of(float(one[column])):.3g}" for one in (low, high, plants.nominal))
        ranges.append(f"{label(name)} ({least} to {f'{most} {shown.unit}'.rstrip()}; the controller assumes {assumed})")
    return and_listed(ranges)


class Hard(NamedTuple):
    """A plant of a batch, and what a controller makes of it at the gain ratio nearest to 1."""

    plant: int  # counted from 0
    unsettled: int  # set points in reach at which it does not settle
    in_reach: int
    settling: float  # s, the longest of those at which it settles; NaN of none
    error: float  # the largest steady error at a set point in reach, in the unit shown


def hardest(grid: Grid, sweep: ControllerSweep, count: int = HARDEST) -> list[Hard]:
    """The plants that a controller bears worst: by the set points in reach at which it does not settle, then by the largest steady error and the longest time."""
    at, unit = nominal_gain(grid), grid.plants.unit
    reach = np.isfinite(sweep.least.grid[:, 0])  # (plants, set points)
    times = merit_values(sweep.merits, "settling_time")[:, 0, :, at]
    errors = merit_values(sweep.merits, "steady_error", unit)[:, 0, :, at]
    found = []
    for plant in range(len(grid.ratios)):
        own, settled = reach[plant], reach[plant] & np.isfinite(times[plant])
        if own.any():
            longest = float(times[plant][settled].max()) if settled.any() else float("nan")
            largest = float(errors[plant][own].max())
            found.append(Hard(plant, int(own.sum() - settled.sum()), int(own.sum()), longest, largest))
    return sorted(
        found, key=lambda one: (-one.unsettled, -one.error if one.unsettled else 0.0, -np.nan_to_num(one.settling))
    )[:count]


def hardest_rows(grid: Grid, sweep: ControllerSweep) -> tuple[list[str], list[list[str]]]:
    """(the head of a table of `hardest`, its rows)."""
    plants = grid.plants
    assert plants.batch is not None
    head = [
        "plant",
        "does not settle at",
        "settles within (s)",
        f"steady error up to ({plants.unit.label})",
        *map(label, plants.columns),
    ]
    rows = []
    for one in hardest(grid, sweep):
        values = [_shown(plants, column, value) for column, value in enumerate(plants.batch[one.plant])]
        longest = "never" if np.isnan(one.settling) else f"{one.settling:.3g}"
        rows.append([f"{one.plant + 1}", f"{one.unsettled} of {one.in_reach}", longest, f"{one.error:.3g}", *values])
    return head, rows


def worst_mismatch(grid: Grid, sweep: ControllerSweep) -> str:
    """The plant that a controller bears worst as `simulate --mismatch` takes it: `inertia_ratio=1.678,damping=0.002842`, SI; "" where there is no batch, or nothing in reach."""
    worst = hardest(grid, sweep, 1) if grid.numbered else []
    if grid.plants.batch is None or not worst:
        return ""
    return ",".join(
        f"{name}={value:.6g}"
        for name, value in zip(grid.plants.columns, grid.plants.batch[worst[0].plant], strict=True)
    )


def batch_part(grid: Grid, sweep: ControllerSweep) -> str:
    """The plants that a controller bears worst, and the parameters that its picture leaves out."""
    left = left_out(grid, sweep)
    words = (
        f"<p>Not drawn, since the figures hang on them less: {html.escape(and_listed([label(one) for one in left]))}.</p>"
        if left
        else ""
    )
    return words + table(*hardest_rows(grid, sweep))
