"""The folder of a sweep: a table of every closed loop, maps and lines as pictures, and one page that compares controllers."""

from __future__ import annotations

import io
from collections.abc import Callable, Iterable, Sequence
from functools import partial
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from smajax.control.plants import Plants, plant_set
from smajax.control.reference import clock
from smajax.control.sweep.run_sweep import (
    CACHED,
    LINES,
    ControllerSweep,
    SweepResults,
    SweepSettings,
    assumed_air,
    line_target,
)
from smajax.core.files import as_netcdf, replace
from smajax.core.progress import Message, Progress, quiet
from smajax.core.wording import aligned
from smajax.model.system import System
from smajax.report.drawing import UPRIGHT
from smajax.report.next_steps import after_sweep
from smajax.report.series_plot import SeriesPlot
from smajax.report.sweep_dataset import as_dataset
from smajax.report.sweep_page import (
    NO_REMARKS,
    Remarks,
    comparison_rows,
    failures,
    page,
    perturbed_sentence,
    ranked,
    write_rows,
)
from smajax.report.sweep_pictures import common_limits, draw_comparison, draw_curves, draw_lines, draw_maps, lines_plot
from smajax.report.sweep_record import as_json

MAPS = (10.0, 7.6)  # inches


def files_of(controllers: Sequence[str]) -> list[str]:
    """Names (globs) of the files that a sweep of these controllers writes into its folder."""
    by_controller = [f"{name}{end}" for name in controllers for end in (".csv", "_maps.png", "_lines.png")]
    return ["index.html", "sweep.json", "sweep.nc", "comparison.png", CACHED, *by_controller]


def write_sweep(
    system: System,
    settings: SweepSettings,
    sweeps: Iterable[ControllerSweep],
    out: Path,
    progress: Progress = quiet,
    command: str = "",
    plants: Plants | None = None,
    remarks: Remarks = NO_REMARKS,
) -> SweepResults:
    """Write the files of each controller as it comes, then those of all; `sweeps` are of `sweep_controllers`, as are the others.

    remarks: sentences on set points out of reach, and on where the settings come from, and how commands name the plant.
    """
    out.mkdir(parents=True, exist_ok=True)
    found = plant_set(system, plants)
    grid = settings.grid_on(found)
    time = np.asarray(clock(settings.seconds, settings.dt))
    target = line_target(system, grid)
    upright: dict[str, bytes] = {}
    plots: dict[str, SeriesPlot] = {}
    results: list[ControllerSweep] = []

    def write_picture(name: str, size: tuple[float, float], draw: Callable[[Figure], None]) -> None:
        replace(out / name, _png(draw, size, 90))
        upright[name] = _png(draw, (UPRIGHT, size[1]), 140)

    for one in sweeps:
        results.append(one)
        write_rows(out / f"{one.name}.csv", grid, one)
        over_grid = draw_maps if grid.second else draw_curves
        write_picture(f"{one.name}_maps.png", MAPS, partial(over_grid, grid=grid, sweep=one))
        if one.lines:
            plots[one.name] = lines_plot(time, LINES, one, target, found.unit)
            lines = partial(draw_lines, time=time, ratios=LINES, sweep=one, target=target, unit=found.unit)
            write_picture(f"{one.name}_lines.png", (11.0, 3.1 * -(-len(one.lines) // 3)), lines)
        progress(Message(f"{one.name}: {grid.size:,} closed loops; {failures(one)}. {perturbed_sentence(grid, one)}"))
    if grid.second and len(results) > 1:  # all are known now, and so the scale of the colours
        limits = common_limits(grid, results)
        for one in results:
            write_picture(f"{one.name}_maps.png", MAPS, partial(draw_maps, grid=grid, sweep=one, limits=limits))
    whole = SweepResults(settings, tuple(results), assumed_air(system), found)
    comparison = partial(draw_comparison, targets=grid.targets, sweeps=whole.sweeps, position=found.unit)
    write_picture("comparison.png", (10.0, 11.0), comparison)
    replace(out / "sweep.json", as_json(whole, command, remarks))
    replace(out / "sweep.nc", as_netcdf(as_dataset(whole, command)))
    pictures = {name: ((out / name).read_bytes(), narrow) for name, narrow in upright.items()}
    best = ranked(whole)[0].name
    steps = after_sweep(out, remarks.plant, best, settings.set_points, found.unit.shown, remarks.gains.get(best, ""))
    replace(out / "index.html", page(whole, pictures, command, remarks, plots, steps))
    return whole


def _png(draw: Callable[[Figure], None], size: tuple[float, float], dpi: int) -> bytes:
    figure, image = Figure(figsize=size), io.BytesIO()
    draw(figure)
    figure.savefig(image, dpi=dpi, facecolor="white", format="png")
    return image.getvalue()


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
