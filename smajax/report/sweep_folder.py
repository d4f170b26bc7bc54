"""A whole sweep: controllers by name -> comparison, maps, lines and rows in a folder; what is finished is kept."""

from __future__ import annotations

import dataclasses
import io
import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from smajax.control.figures_of_merit import Merit
from smajax.control.gains_file import Gains
from smajax.control.interface import between_in_words, check_interface, check_set_points, interface_of
from smajax.control.mismatch import MISMATCHES
from smajax.control.presets import CONTROLLERS
from smajax.control.reference import clock
from smajax.control.sweep import Grid, closed_loops, lanes, positions, ratios
from smajax.core.files import as_netcdf, replace, writing
from smajax.core.names import instead
from smajax.core.parameters import get_parameters
from smajax.core.progress import Event, Message, Progress, Stage
from smajax.core.provenance import digest
from smajax.core.result_cache import arrays
from smajax.core.wording import aligned
from smajax.model.system import System
from smajax.report.drawing import UPRIGHT
from smajax.report.sweep_dataset import as_dataset
from smajax.report.sweep_page import (
    Swept,
    as_json,
    comparison_rows,
    draw_comparison,
    draw_lines,
    draw_maps,
    draw_over_one,
    failures,
    over_mismatches,
    page,
    write_rows,
)

LINES = (0.5, 0.8, 1.0, 1.25, 2.0)  # mismatches drawn over time
LINE_TARGET = 40.0  # deg


@dataclass(frozen=True)
class SweepSettings:
    """What is swept; angles in degrees."""

    controllers: tuple[str, ...]
    first: str = "convection"
    second: str = "damping"  # "": over the first alone
    points: int = 15
    set_points: tuple[float, ...] = (-40.0, -20.0, 0.0, 10.0, 20.0, 40.0, 50.0, 60.0, 80.0)
    gains: tuple[float, ...] = (0.5, 0.7, 1.0, 1.4, 2.0)
    seconds: float = 10.0
    dt: float = 0.01
    filtered: str = ""  # the filter that tells the controllers the state; none: they are told the true one
    noise: float = 0.0  # degrees, standard deviation of the angle's readings
    period: float = 0.01  # s, sample time of the controller, a whole number of `dt`
    delay: int = 0  # control periods until a command arrives
    tuned: tuple[Gains, ...] = ()  # in the place of the presets'

    def record(self) -> dict[str, Any]:
        """What was asked, for JSON."""
        return json.loads(json.dumps({**vars(self), "tuned": [vars(one) for one in self.tuned]}, default=dict))

    @property
    def between(self) -> str:
        """What lies between plant and controller, in words."""
        told = [f"{one.controller} has gains from a file" for one in self.tuned]
        return " ".join(
            [
                between_in_words(self.filtered, self.noise, self.period, self.delay),
                *[f"{', '.join(told)}."] * bool(told),
            ]
        )


def files_of(controllers: Sequence[str]) -> list[str]:
    """Names that a sweep of these controllers writes into its folder."""
    own = [f"{name}{end}" for name in controllers for end in (".csv", "_maps.png", "_lines.png")]
    return ["index.html", "sweep.json", "sweep.nc", "comparison.png", f"finished/*-{'[0-9a-f]' * 16}.npz", *own]


def goes_on(before: Mapping[str, Any], asked: Mapping[str, Any]) -> bool:
    """Whether a sweep may go on where another lies: the same but for controllers that are added."""
    rest = {"controllers", "tuned"}
    gains = [one for one in asked["tuned"] if one["controller"] in before["controllers"]]
    return (
        {k: v for k, v in before.items() if k not in rest} == {k: v for k, v in asked.items() if k not in rest}
        and set(before["controllers"]) <= set(asked["controllers"])
        and gains == before["tuned"]
    )


def run_sweep(
    system: System, settings: SweepSettings, out: Path, progress: Progress, command: str = ""
) -> list[list[str]]:
    """Sweep every controller and write the folder; the rows of the comparison come back, for a terminal.

    Raises ValueError for a controller or mismatch there is not.
    """
    for name in settings.controllers:
        if name not in CONTROLLERS:
            raise ValueError(f"no controller `{name}`{instead(name, CONTROLLERS, 'there are')}.")
    if not settings.controllers:
        raise ValueError(f"no controller is named, expected some of {', '.join(CONTROLLERS)}.")
    check_set_points(system, settings.set_points)
    if not settings.gains or min(settings.gains) <= 0.0:
        raise ValueError(f"gains are shares of the preset's, above 0, at least one; not {settings.gains}.")
    check_interface(settings.filtered, settings.noise, settings.period, settings.dt)
    spare = [gains.controller for gains in settings.tuned if gains.controller not in settings.controllers]
    if spare:
        raise ValueError(
            f"gains are given for {', '.join(spare)}, and only {', '.join(settings.controllers)} are swept."
        )
    out.mkdir(parents=True, exist_ok=True)
    targets = np.radians(settings.set_points)
    grid = Grid(settings.first, settings.second, ratios(settings.points), targets, np.asarray(settings.gains))
    compared: dict[str, Merit] = {}
    swept: list[Swept] = []
    time = np.asarray(clock(settings.seconds, settings.dt))
    upright: dict[str, bytes] = {}

    def drawn(name: str, size: tuple[float, float], draw: Callable[[Figure], None]) -> None:
        replace(out / name, _png(draw, size, 90))
        upright[name] = _png(draw, (UPRIGHT, size[1]), 140)

    for name in settings.controllers:
        compared[name], one = _controller(system, name, settings, grid, out, progress)
        swept.append(one)
        write_rows(out / f"{name}.csv", grid, one)
        target = float(np.radians(LINE_TARGET))
        drawn(
            f"{name}_maps.png", (10.0, 7.6), partial(draw_maps if grid.second else draw_over_one, grid=grid, swept=one)
        )
        drawn(f"{name}_lines.png", (11.0, 6.2), partial(draw_lines, time=time, ratios=LINES, swept=one, target=target))
        progress(Message(f"{name}: {grid.size:,} closed loops; {failures(one)}. {over_mismatches(grid, one)}"))
    drawn("comparison.png", (10.0, 11.0), partial(draw_comparison, targets=targets, merits=compared))
    replace(out / "sweep.json", as_json(targets, compared, grid, swept, settings.between, command))
    replace(out / "sweep.nc", as_netcdf(as_dataset(grid, swept, settings.between, command)))
    between, seconds = settings.between, settings.seconds
    air = float(get_parameters(system, [MISMATCHES["ambient"]])[0])
    replace(out / "index.html", page(targets, compared, grid, swept, seconds, between, out, upright, air, command))
    return comparison_rows(targets, compared)


def _controller(
    system: System, name: str, settings: SweepSettings, grid: Grid, out: Path, progress: Progress
) -> tuple[Merit, Swept]:
    """One controller, from the folder where an interrupted sweep of this code and setting has finished it."""
    preset = CONTROLLERS[name]
    system, gain = preset.plant(system), preset.main_gain
    tuned = tuple(gains for gains in settings.tuned if gains.controller == name)
    own = dataclasses.replace(settings, controllers=(name,), tuned=tuned)
    kept = out / "finished" / f"{name}-{digest(system, [str(own)])[:16]}.npz"
    fields = [field.name for field in dataclasses.fields(Merit)]
    saved = arrays(kept)
    if saved is None:
        interface = interface_of(
            system, settings.filtered, settings.noise, settings.period, settings.dt, settings.delay
        )

        def swept(event: Event) -> None:
            progress(dataclasses.replace(event, name=f"sweeping {name}") if isinstance(event, Stage) else event)

        # One batch, one program: the grid, and the plant as believed at every set point.
        rows = np.concatenate([grid.lanes(), lanes({}, grid.targets)])
        target = float(np.radians(LINE_TARGET))
        lines = np.concatenate([lanes({one: np.asarray(LINES)}, target) for one in MISMATCHES])
        controller = tuned[-1].put(system) if tuned else preset.make(system)
        asked: dict[str, Any] = {"seconds": settings.seconds, "dt": settings.dt, "interface": interface}
        found = closed_loops(system, controller, gain, rows, **asked, progress=swept)
        drawn = positions(system, controller, gain, lines, **asked).reshape(len(MISMATCHES), len(LINES), -1)
        inside, alone = slice(grid.size), grid.size + np.arange(len(grid.targets))
        record: dict[str, Any] = {"failed": found.failed_at[inside].reshape(grid.shape)}
        for field in fields:
            values = np.asarray(getattr(found.merits, field))
            record[f"grid_{field}"], record[f"alone_{field}"] = values[inside].reshape(grid.shape), values[alone]
        record |= {f"line_{mismatch}": angles for mismatch, angles in zip(MISMATCHES, drawn, strict=True)}
        kept.parent.mkdir(exist_ok=True)
        with writing(kept) as file:
            np.savez(file, **record)
        saved = record
    one = Swept(
        name,
        gain,
        Merit(**{field: saved[f"grid_{field}"] for field in fields}),
        saved["failed"],
        {mismatch: saved[f"line_{mismatch}"] for mismatch in MISMATCHES},
    )
    return Merit(**{field: saved[f"alone_{field}"] for field in fields}), one


def _png(draw: Callable[[Figure], None], size: tuple[float, float], dpi: int) -> bytes:
    figure, image = Figure(figsize=size), io.BytesIO()
    draw(figure)
    figure.savefig(image, dpi=dpi, facecolor="white", format="png")
    return image.getvalue()


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
    return "\n".join(aligned([head, *rows]))
