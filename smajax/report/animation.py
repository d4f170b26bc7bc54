"""A run as a moving picture: what the load does, beside the wire's path through its phase diagram."""

from __future__ import annotations

import io
import warnings
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colors import LinearSegmentedColormap
from matplotlib.figure import Figure
from PIL import Image

from smajax.core.display_units import axis_label, display
from smajax.core.files import replace
from smajax.core.progress import Progress, Stage, quiet
from smajax.model.load.base import AbstractMovingLoad
from smajax.model.system import System
from smajax.model.types import Series, Trajectory
from smajax.model.wire.wire import Kinetics
from smajax.report.pictures import MEASURED, QUIET, tidy
from smajax.simulation.simulate import DEFAULT_STEP

HOT, COLD = "#c8553d", "#1f6fb2"
SIZE, UPRIGHT, DPI = (8.4, 3.9), (4.4, 7.6), 80  # inches
COLOURS = 128  # of the picture file
SHADES = 24  # of them, for the wire
TYPICAL = 6  # frames from which the others are taken
NEARLY_WHITE = 250
SHADE = LinearSegmentedColormap.from_list("phase", [HOT, COLD])  # by the martensite fraction
Run = Trajectory | xr.Dataset  # as `simulate` or as `simulate_dataset` returns it
Draw = Callable[[int], list[Any]]  # sets the sample to show; the artists that it changed


def animate_run(
    system: System,
    inputs: Mapping[str, Series],
    path: Path | str,
    dt: float = DEFAULT_STEP,
    *,
    seconds: float = 6.0,
    frames: int = 90,
) -> Path:
    """Simulate `system` over `inputs`, each of shape (n,), SI, `dt` s apart, and draw it as `animate` does; DeprecationWarning."""
    warnings.warn(
        "animate_run(system, inputs, path, dt) is animate(system, simulate_compiled(system, inputs, dt), path) now; it goes in version 0.3",
        DeprecationWarning,
        stacklevel=2,
    )
    from smajax.simulation.compiled import simulate_compiled  # here, so that nothing else of this file simulates

    return animate(system, simulate_compiled(system, inputs, dt), path, seconds=seconds, frames=frames)


def animate(system: System, run: Run, path: Path | str, *, seconds: float = 6.0, frames: int = 90) -> Path:
    """Write `run` of `system` as the animated GIF of `moving`, and return its path.

    Raises as that, and ValueError for a file that is no `.gif`. The file is there whole or not at all.
    """
    path = Path(path)
    if path.suffix != ".gif":
        raise ValueError(f"the picture is a GIF, so its name ends in .gif; got `{path.name}`.")
    return replace(path, moving(system, run, seconds=seconds, frames=frames))


def moving(
    system: System,
    run: Run,
    *,
    seconds: float = 6.0,
    frames: int = 90,
    upright: bool = False,
    progress: Progress = quiet,
) -> bytes:
    """`run` of `system` as an animated GIF that takes `seconds` of the reader's time.

    Left the load, its wire coloured by the martensite fraction (blue 1, red 0). Right stress over temperature with
    the transformation ranges A_s' to A_f' and M_f' to M_s', each moved by sigma/C (eq. 3.4, 3.6), and the path so
    far. upright: one below the other, for a telephone. Raises ValueError for a coupon, which moves nothing, and for fewer
    than 2 frames or samples.
    """
    if not isinstance(system.load, AbstractMovingLoad):
        raise ValueError(f"a {type(system.load).__name__} moves nothing: draw a run of an arm, a weight or a spring.")
    samples = np.size(run.time)
    if min(frames, samples) < 2 or not seconds > 0.0:
        raise ValueError(
            f"got {frames} frames of {samples} samples in {seconds:g} s: give at least 2 of each, and a time above 0."
        )
    stage = "drawing the load moving" + (", for telephones" if upright else "")
    progress(Stage(stage, 0.0))
    shown = np.unique(np.linspace(0, samples - 1, frames).round().astype(int))
    figure = Figure(figsize=UPRIGHT if upright else SIZE, dpi=DPI, layout="constrained")
    canvas = FigureCanvasAgg(figure)
    load, plane = figure.subplots(2, 1) if upright else figure.subplots(1, 2, width_ratios=[1.0, 1.25])
    drawn = _arm if system.load.position_unit == "rad" else _slider
    draws = [drawn(load, system, run), _plane(plane, system, run)]
    canvas.draw()
    images = []
    background = canvas.copy_from_bbox(figure.bbox)
    for number, sample in enumerate(shown):
        canvas.restore_region(background)
        for draw in draws:
            for artist in draw(int(sample)):
                figure.draw_artist(artist)
        images.append(Image.fromarray(np.asarray(canvas.buffer_rgba())).convert("RGB"))
        progress(Stage(stage, 0.8 * (number + 1) / len(shown)))
    film = _gif(_quantised(images), round(1e3 * seconds / len(images)))
    progress(Stage(stage, 1.0))
    return film


def _quantised(images: list[Image.Image]) -> list[Image.Image]:
    """With one palette for all: to choose one for each took most of the time, and colours flickered.

    Of the colours of some of them, each counted once: the ground would have nearly all. The shades of the wire are in it.
    """
    some = [np.asarray(images[k]) for k in np.unique(np.linspace(0, len(images) - 1, TYPICAL).round().astype(int))]
    every = np.unique(
        np.concatenate(some).reshape(-1, 3).astype(np.uint32) @ np.asarray([1 << 16, 1 << 8, 1], np.uint32)
    )
    colours = np.stack([every >> 16, every >> 8 & 255, every & 255], axis=-1).astype(np.uint8)
    chosen = Image.fromarray(colours[None]).quantize(COLOURS - SHADES).getpalette() or []
    few = np.reshape(chosen[: 3 * (COLOURS - SHADES)], (-1, 3))
    few = np.where((few >= NEARLY_WHITE).all(axis=1, keepdims=True), 255, few)  # the ground stays as white as the page
    shades = (255.0 * SHADE(np.linspace(0.0, 1.0, SHADES))[:, :3]).round().astype(int)
    palette = Image.new("P", (1, 1))
    palette.putpalette([*shades.ravel().tolist(), *few.ravel().tolist()])
    return [image.quantize(palette=palette, dither=Image.Dither.NONE) for image in images]


def _gif(images: list[Image.Image], each: int) -> bytes:
    """Every image is shown for `each` milliseconds, again and again."""
    stream = io.BytesIO()
    images[0].save(stream, format="GIF", save_all=True, append_images=images[1:], duration=each, loop=0)
    return stream.getvalue()


def _arm(axes: Axes, system: System, run: Run) -> Draw:
    """The link on its pulley, seen from the side; of any load that turns."""
    angle = np.asarray(run.position)
    for stop in filter(np.isfinite, map(float, system.load.limits())):
        axes.plot([0.0, 1.15 * np.cos(stop)], [0.0, 1.15 * np.sin(stop)], ":", color=QUIET, linewidth=0.9)
    axes.plot(np.cos(angle), np.sin(angle), color="#eceef1", linewidth=6.0, solid_capstyle="round", zorder=0)
    (link,) = axes.plot([], [], color=MEASURED, linewidth=4.0, solid_capstyle="round", animated=True)
    (payload,) = axes.plot([], [], "o", color=MEASURED, markersize=15.0, animated=True)
    (pulley,) = axes.plot([0.0], [0.0], "o", markersize=24.0, animated=True)
    words = axes.text(0.02, 0.98, "", transform=axes.transAxes, va="top", fontsize=10, animated=True)
    axes.set(xlim=(min(-0.5, float(np.cos(angle).min()) - 0.35), 1.35), ylim=(-1.15, 1.3), aspect="equal")
    axes.axis("off")

    def draw(at: int) -> list[Any]:
        tip = np.cos(angle[at]), np.sin(angle[at])
        link.set_data([0.0, tip[0]], [0.0, tip[1]])
        payload.set_data([tip[0]], [tip[1]])
        pulley.set_color(SHADE(float(run.martensite_fraction[at])))
        words.set_text(_told(run, at, f"{np.degrees(angle[at]):.0f}°"))
        return [link, payload, pulley, words]

    return draw


def _slider(axes: Axes, system: System, run: Run) -> Draw:
    """A weight or a slider that its wire pulls up; the stroke is drawn to its own scale. What a load cell holds rises with its force."""
    name, own = system.load.reading
    shown = display(own, name)
    # A late or coarse sensor of the position is not what moves.
    stroke = shown.of(np.asarray(run.position if name == "position" else run.reading))
    room = max(float(np.ptp(stroke)), 1e-3)
    top = float(stroke.max()) + 0.6 * room
    (wire,) = axes.plot([], [], linewidth=3.0, animated=True)
    (weight,) = axes.plot([], [], "s", color=MEASURED, markersize=22.0, animated=True)
    words = axes.text(0.02, 0.98, "", transform=axes.transAxes, va="top", fontsize=10, animated=True)
    axes.set(xlim=(-1.0, 1.0), ylim=(float(stroke.min()) - 0.4 * room, top), xticks=[])
    axes.set_ylabel(axis_label(name, shown), fontsize=9)
    tidy(axes)

    def draw(at: int) -> list[Any]:
        wire.set_data([0.0, 0.0], [stroke[at], top])
        wire.set_color(SHADE(float(run.martensite_fraction[at])))
        weight.set_data([0.0], [stroke[at]])
        words.set_text(_told(run, at, f"{stroke[at]:.1f} {shown.unit}"))
        return [wire, weight, words]

    return draw


def _told(run: Run, at: int, where: str) -> str:
    return f"{float(run.time[at]):.1f} s   {where}   ξ = {float(run.martensite_fraction[at]):.2f}"


def ranges(law: Kinetics, stress: np.ndarray) -> dict[str, np.ndarray]:
    """A_s', A_f', M_s' and M_f' at stresses (Pa) of shape (n,), C: each moved by sigma/C (eq. 3.4, 3.6)."""
    hot, cold = stress / float(law.stress_slope_austenite), stress / float(law.stress_slope_martensite)
    return {
        "A_s'": float(law.austenite_start) + hot,
        "A_f'": float(law.austenite_finish) + hot,
        "M_s'": float(law.martensite_start) + cold,
        "M_f'": float(law.martensite_finish) + cold,
    }


def _plane(axes: Axes, system: System, run: Run) -> Draw:
    """Stress over temperature with both ranges, and the path so far."""
    temperature, stress = np.asarray(run.temperature), 1e-6 * np.asarray(run.stress)
    top = max(1.15 * float(stress.max()), 1.0)
    levels = np.asarray([0.0, top])
    lines = ranges(system.wire.kinetics, 1e6 * levels)
    for low, high, colour in (("A_s'", "A_f'", HOT), ("M_f'", "M_s'", COLD)):
        axes.fill_betweenx(levels, lines[low], lines[high], color=colour, alpha=0.15, linewidth=0.0)
    for name, line in lines.items():
        axes.plot(line, levels, color=HOT if name[0] == "A" else COLD, linewidth=0.8, alpha=0.7)
        axes.annotate(name, (line[1], top), fontsize=8, ha="center", va="bottom", annotation_clip=False)
    (path,) = axes.plot([], [], color=MEASURED, linewidth=1.3, animated=True)
    (now,) = axes.plot([], [], "o", color=MEASURED, markersize=6.0, animated=True)
    edges = [float(temperature.min()), float(temperature.max()), *(float(line[1]) for line in lines.values())]
    axes.set(xlim=(min(edges) - 3.0, max(edges) + 6.0), ylim=(0.0, top))
    axes.set_xlabel("temperature (°C)", fontsize=9)
    axes.set_ylabel("stress (MPa)", fontsize=9)
    tidy(axes)

    def draw(at: int) -> list[Any]:
        path.set_data(temperature[: at + 1], stress[: at + 1])
        now.set_data([temperature[at]], [stress[at]])
        return [path, now]

    return draw
