"""The folder of a sweep: a table of every closed loop, maps and lines as pictures, and one page that compares controllers."""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Callable, Iterable, Sequence
from functools import partial
from pathlib import Path
from typing import Any

from matplotlib.figure import Figure

from smajax.control.sweep.grid import Grid
from smajax.control.sweep.run_sweep import CACHED, ControllerSweep, SweepResults
from smajax.core.files import as_netcdf, replace
from smajax.core.progress import Message, Progress, quiet
from smajax.core.wording import aligned
from smajax.report.drawing import UPRIGHT
from smajax.report.next_steps import after_sweep
from smajax.report.pictures import as_png
from smajax.report.series_plot import SeriesPlot
from smajax.report.sweep_batch_picture import draw_batch
from smajax.report.sweep_dataset import as_dataset
from smajax.report.sweep_numbers import IN_PICTURE, comparison_digest, digest_of, lines_digest, map_numbers
from smajax.report.sweep_page import (
    NO_REMARKS,
    Remarks,
    comparison_rows,
    failures,
    page,
    perturbed_sentence,
    ranked,
)
from smajax.report.sweep_pictures import common_limits, draw_comparison, draw_curves, draw_lines, draw_maps, lines_plot
from smajax.report.sweep_plants import worst_mismatch
from smajax.report.sweep_record import as_json
from smajax.report.sweep_rows import write_rows

MAPS, CURVES = (10.0, 14.0), (10.0, 7.6)  # inches


def files_of(controllers: Sequence[str]) -> list[str]:
    """Names (globs) of the files that a sweep of these controllers writes into its folder."""
    by_controller = [f"{name}{end}" for name in controllers for end in (".csv", "_maps.png", "_lines.png")]
    return ["index.html", "sweep.json", "sweep.nc", "comparison.png", CACHED, *by_controller]


def write_sweep(
    begun: SweepResults,
    sweeps: Iterable[ControllerSweep],
    out: Path,
    progress: Progress = quiet,
    command: str = "",
    remarks: Remarks = NO_REMARKS,
) -> SweepResults:
    """Write the files of each controller as it comes, then those of all; `begun` is of `begun_sweep`, `sweeps` of `sweep_controllers`.

    remarks: sentences on set points out of reach, and on where the settings come from, and how commands name the plant.
    """
    out.mkdir(parents=True, exist_ok=True)
    settings, grid, unit = begun.settings, begun.grid, begun.unit
    time, target, air = begun.time, begun.line_target, begun.air
    upright: dict[str, bytes] = {}
    plots: dict[str, SeriesPlot] = {}
    results: list[ControllerSweep] = []

    def write_picture(name: str, size: tuple[float, float], draw: Callable[[Figure], None], numbers: str) -> None:
        replace(out / name, numbered_png(draw, size, 90, numbers))
        upright[name] = numbered_png(draw, (UPRIGHT, size[1]), 140, numbers)

    for one in sweeps:
        results.append(one)
        write_rows(out / f"{one.name}.csv", grid, one)
        over_grid, size = _drawn_over(grid, air)
        numbers = digest_of(map_numbers(grid, one))
        write_picture(f"{one.name}_maps.png", size, partial(over_grid, sweep=one), numbers)
        if one.lines:
            plots[one.name] = lines_plot(time, settings.line_ratios, one, target, unit, air)
            what: dict[str, Any] = {
                "ratios": settings.line_ratios,
                "sweep": one,
                "target": target,
                "unit": unit,
                "air": air,
            }
            height = 3.1 * -(-len(one.lines) // 3)
            write_picture(
                f"{one.name}_lines.png", (11.0, height), partial(draw_lines, time=time, **what), lines_digest(one)
            )
        progress(Message(f"{one.name}: {grid.size:,} closed loops; {failures(one)}. {perturbed_sentence(grid, one)}"))
    if grid.second and len(results) > 1:  # all are known now, and so the scale of the colours
        limits = common_limits(grid, results)
        for one in results:
            draw = partial(draw_maps, grid=grid, sweep=one, limits=limits, air=air)
            write_picture(f"{one.name}_maps.png", MAPS, draw, digest_of(map_numbers(grid, one)))
    whole = dataclasses.replace(begun, sweeps=tuple(results))
    comparison = partial(draw_comparison, targets=grid.targets, sweeps=whole.sweeps, position=unit)
    record = as_json(whole, command, remarks)
    write_picture("comparison.png", (10.0, 11.0), comparison, comparison_digest(json.loads(record)))
    replace(out / "sweep.json", record)
    replace(out / "sweep.nc", as_netcdf(as_dataset(whole, command)))
    pictures = {name: ((out / name).read_bytes(), narrow) for name, narrow in upright.items()}
    best = ranked(whole)[0].name
    mismatch = worst_mismatch(grid, next(one for one in whole.sweeps if one.name == best))
    steps = after_sweep(
        out, remarks.plant, best, settings.set_points, unit.shown, remarks.gains.get(best, ""), mismatch
    )
    replace(out / "index.html", page(whole, pictures, command, remarks, plots, steps))
    return whole


def _drawn_over(grid: Grid, air: float) -> tuple[Callable[..., None], tuple[float, float]]:
    """(what draws the figures of merit of a controller over the plants, the size of its picture)."""
    if grid.numbered:
        return partial(draw_batch, grid=grid), MAPS
    if grid.second:
        return partial(draw_maps, grid=grid, air=air), MAPS
    return partial(draw_curves, grid=grid, air=air), CURVES


def numbered_png(draw: Callable[[Figure], None], size: tuple[float, float], dpi: int, numbers: str) -> bytes:
    """numbers: a digest of those that are drawn, which the picture holds as text."""
    figure = Figure(figsize=size)
    draw(figure)
    return as_png(figure, dpi, {IN_PICTURE: numbers})


def as_text(results: SweepResults) -> str:
    """The comparison on the unperturbed plant, for a terminal."""
    head = [
        "controller",
        "settles",
        "over least",
        f"limit {results.unit.command}",
        "over own least",
        "reach s",
        "settle s",
        f"overshoot {results.unit.label}",
        f"error {results.unit.label}",
        "energy J",
        "switches/s",
        "peak °C",
    ]
    return "\n".join(aligned([head, *comparison_rows(results)]))
