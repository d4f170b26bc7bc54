"""A whole sweep: controllers by name -> comparison, maps, lines and rows in a folder; what is finished is kept."""

from __future__ import annotations

import dataclasses
import hashlib
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import jax
import numpy as np
from matplotlib.figure import Figure

from smajax.control_presets import CONTROLLERS, FILTERS
from smajax.fit.solve import Progress
from smajax.merit import Merit
from smajax.source_mark import source_mark
from smajax.sweep import MISMATCHES, Grid, lines, ratios, sweep
from smajax.sweep_report import (
    Swept,
    as_json,
    comparison_rows,
    draw_comparison,
    draw_lines,
    draw_maps,
    page,
    write_rows,
)
from smajax.system import System

LINES = (0.5, 0.8, 1.0, 1.25, 2.0)  # mismatches drawn over time
LINE_TARGET = 40.0  # deg


@dataclass(frozen=True)
class SweepSettings:
    """What is swept; angles in degrees."""

    controllers: tuple[str, ...]
    first: str = "convection"
    second: str = "damping"
    points: int = 15
    set_points: tuple[float, ...] = (-40.0, -20.0, 0.0, 10.0, 20.0, 40.0, 50.0, 60.0, 80.0)
    gains: tuple[float, ...] = (0.5, 0.7, 1.0, 1.4, 2.0)
    seconds: float = 10.0
    dt: float = 0.01
    filtered: str = ""  # the filter that tells the controllers the state; none: they are told the true one


def run_sweep(system: System, settings: SweepSettings, out: Path, progress: Progress) -> list[list[str]]:
    """Sweep every controller and write the folder; the rows of the comparison come back, for a terminal.

    Raises ValueError for a controller or mismatch there is not.
    """
    unknown = [name for name in settings.controllers if name not in CONTROLLERS]
    if unknown or not settings.controllers:
        raise ValueError(f"no controller {unknown}; there are {', '.join(CONTROLLERS)}.")
    if settings.filtered and settings.filtered not in FILTERS:
        raise ValueError(f"no filter `{settings.filtered}`; there are {', '.join(FILTERS)}.")
    out.mkdir(parents=True, exist_ok=True)
    targets = np.radians(settings.set_points)
    grid = Grid(settings.first, settings.second, ratios(settings.points), targets, np.asarray(settings.gains))
    alone = Grid(settings.first, settings.second, np.ones(1), targets, np.ones(1))
    compared: dict[str, Merit] = {}
    swept: list[Swept] = []
    time = np.zeros(0)
    for name in settings.controllers:
        compared[name], one, time = _controller(system, name, settings, grid, alone, out, progress)
        swept.append(one)
        write_rows(out / f"{name}.csv", grid, one)
        maps, over_time = Figure(figsize=(10.0, 7.6)), Figure(figsize=(11.0, 6.2))
        draw_maps(maps, grid, one, settings.seconds)
        maps.savefig(out / f"{name}_maps.png", dpi=90, facecolor="white")
        draw_lines(over_time, time, LINES, one, float(np.radians(LINE_TARGET)))
        over_time.savefig(out / f"{name}_lines.png", dpi=90, facecolor="white")
        progress(f"say: {name}: {int(np.prod(grid.shape)):,} closed loops", 1.0)
    comparison = Figure(figsize=(10.0, 11.0))
    draw_comparison(comparison, targets, compared)
    comparison.savefig(out / "comparison.png", dpi=90, facecolor="white")
    (out / "sweep.json").write_text(as_json(targets, compared, grid, swept), encoding="utf-8")
    (out / "index.html").write_text(
        page(targets, compared, grid, swept, settings.seconds, settings.filtered), encoding="utf-8"
    )
    return comparison_rows(targets, compared)


def _controller(
    system: System, name: str, settings: SweepSettings, grid: Grid, alone: Grid, out: Path, progress: Progress
) -> tuple[Merit, Swept, np.ndarray]:
    """One controller, from the folder where an interrupted sweep of this code and setting has finished it."""
    preset = CONTROLLERS[name]
    system, gain = preset.plant(system), preset.main_gain
    own = dataclasses.replace(settings, controllers=(name,))
    mark = hashlib.sha256(f"{source_mark()} {own}".encode())
    # The laws of the system are its structure, the parameters its leaves.
    mark.update(repr(jax.tree.structure(system)).encode())
    for leaf in jax.tree.leaves(system):
        mark.update(np.asarray(leaf).tobytes())
    kept = out / "finished" / f"{name}-{mark.hexdigest()[:16]}.npz"
    fields = [field.name for field in dataclasses.fields(Merit)]
    if not kept.exists():
        controller = preset.make(system)
        timing: dict[str, Any] = {"seconds": settings.seconds, "dt": settings.dt}
        if settings.filtered:
            timing["estimator"] = FILTERS[settings.filtered](system)

        def told(_: str, share: float) -> None:
            progress(f"sweeping {name}", share)

        found, failed = sweep(system, controller, gain, grid, progress=told, **timing)
        nominal, _ = sweep(system, controller, gain, alone, **timing)
        drawn = {m: lines(system, controller, m, LINES, float(np.radians(LINE_TARGET)), **timing) for m in MISMATCHES}
        record: dict[str, Any] = {"failed": failed, "time": next(iter(drawn.values()))[0]}
        record |= {f"grid_{field}": np.asarray(getattr(found, field)) for field in fields}
        record |= {f"alone_{field}": np.asarray(getattr(nominal, field)).ravel() for field in fields}
        record |= {f"line_{mismatch}": angles for mismatch, (_, angles) in drawn.items()}
        kept.parent.mkdir(exist_ok=True)
        part = kept.with_suffix(".part.npz")
        np.savez(part, **record)
        part.replace(kept)
    with np.load(kept) as saved:
        one = Swept(
            name,
            gain,
            Merit(**{field: saved[f"grid_{field}"] for field in fields}),
            saved["failed"],
            {mismatch: saved[f"line_{mismatch}"] for mismatch in MISMATCHES},
        )
        return Merit(**{field: saved[f"alone_{field}"] for field in fields}), one, saved["time"]


def as_text(rows: Sequence[Sequence[str]]) -> str:
    """The comparison for a terminal."""
    head = [
        "controller",
        "settles",
        "reach s",
        "settle s",
        "overshoot °",
        "error °",
        "energy J",
        "switches/s",
        "peak °C",
    ]
    table = [head, *rows]
    widths = [max(len(row[column]) for row in table) for column in range(len(head))]
    return "\n".join("  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)) for row in table)
