"""The arm under a controller of chapter 4 at several set points, or with one gain swept."""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Callable, Sequence

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from smajax.control.closed_loop import ClosedLoop, simulate_closed_loop
from smajax.control.controllers.base import AbstractController
from smajax.control.controllers.temperature_vsc import AsPrinted, TemperatureVsc
from smajax.control.estimators.base import AbstractEstimator
from smajax.control.figures_of_merit import Merit, merit
from smajax.control.presets import temperature_vsc
from smajax.control.reference import clock, constant
from smajax.core.parameters import set_parameters, set_vector
from smajax.model.rigs import arm
from smajax.model.system import System
from smajax.model.types import Scalar
from smajax.report.drawing import BLACK, BLUE, GREEN, GREY, RED, named, panels
from smajax.simulation.simulate import DEFAULT_STEP

from .rigs import Recorded, austenite_range, compiled

SECONDS, PERIOD = 10.0, 0.01
SET_POINTS = (-30.0, -15.0, 0.0, 10.0, 20.0, 40.0, 50.0, 65.0)  # degrees
Runs = dict[float, tuple[Recorded, Recorded]]
SHADES = (GREY, GREEN, BLUE, RED, BLACK, "#d9a441", "#7a5fa8", "#2aa5a0")


@compiled
def _loop(
    system: System,
    controller: AbstractController,
    names: tuple[str, ...],
    gains: Float[Array, " names"],
    target: Scalar,
    dt: float,
    estimator: AbstractEstimator | None,
    seconds: float,
) -> tuple[ClosedLoop, Merit]:
    wanted = constant(clock(seconds, dt), target)
    tuned = set_vector(controller, names, gains)
    loop = simulate_closed_loop(system, tuned, wanted, dt, round(PERIOD / dt), estimator=estimator)
    return loop, merit(loop, system)


def _loops(
    system: System,
    controller: AbstractController,
    names: tuple[str, ...],
    gains: Float[Array, "runs names"],
    targets: Float[Array, " runs"],
    dt: float,
    estimator: AbstractEstimator | None = None,
    seconds: float = SECONDS,
) -> list[tuple[Recorded, Recorded]]:
    rows = zip(np.asarray(gains), np.asarray(targets), strict=True)
    return [_loop(system, controller, names, row, target, dt, estimator, seconds) for row, target in rows]


def at_set_points(
    controller: AbstractController,
    fast: bool,
    degrees: Sequence[float] = SET_POINTS,
    estimator: AbstractEstimator | None = None,
    seconds: float = SECONDS,
) -> Runs:
    """(run, figures of merit) at each set point; the controller is called every 0.01 s, `fast` steps the arm as seldom.

    Without an `estimator` it gets the true state.
    """
    targets = jnp.radians(jnp.asarray(degrees, dtype=float))
    none = jnp.zeros((len(degrees), 0))
    dt = PERIOD if fast else DEFAULT_STEP
    return dict(zip(degrees, _loops(arm(), controller, (), none, targets, dt, estimator, seconds), strict=True))


@functools.cache
def regulated(preset: Callable[[System], AbstractController], fast: bool) -> Runs:
    """`at_set_points` for a preset of the arm: several rows look at the same runs."""
    return at_set_points(preset(arm()), fast)


def nvsc_without_temperature(system: System) -> TemperatureVsc:
    """NVSC with K_p = 0: it takes voltage away while the arm moves up, and controls no temperature."""
    return set_parameters(temperature_vsc(system), {"temperature_gain": 0.0})


def nvsc_as_printed(system: System) -> TemperatureVsc:
    """NVSC with eq. 4.37 as printed: temperature control wherever A_f' stands still, without the factor v/v_p."""
    return dataclasses.replace(temperature_vsc(system), band=AsPrinted())


def swept(controller: AbstractController, gain: str, values: Sequence[float], degrees: float, fast: bool) -> Runs:
    """(run, figures of merit) for each value of one gain, at one set point."""
    targets = jnp.full(len(values), jnp.radians(degrees))
    gains = jnp.asarray(values)[:, None]
    found = _loops(arm(), controller, (gain,), gains, targets, PERIOD if fast else DEFAULT_STEP)
    return dict(zip(values, found, strict=True))


def overshoot(one: Recorded) -> float:
    """Degrees."""
    return float(np.degrees(one.overshoot))


def steady(one: Recorded) -> float:
    """Degrees, mean absolute error of the last fifth."""
    return float(np.degrees(one.steady_error))


def largest_finish_rate(runs: Runs) -> float:
    """Largest |dA_f'/dt| of a batch from the second sample on, C/s, from the states of the runs."""
    rates = [np.diff(austenite_range(arm(), loop.run.stress)[1]) / np.diff(loop.run.time) for loop, _ in runs.values()]
    return float(max(np.abs(rate[1:]).max() for rate in rates))


def time_of(value: Recorded) -> float:
    """Seconds for the table, where `never` must be a number: twice the run."""
    return float(value) if np.isfinite(value) else 2.0 * SECONDS


def measures(runs: Runs, prefix: str = "") -> dict[str, float]:
    """The checked numbers of a batch of set points."""
    result: dict[str, float] = {}
    for angle, (_, one) in runs.items():
        result |= {
            f"{prefix}reach_at_{angle:g}_deg_s": time_of(one.reach_time),
            f"{prefix}settling_at_{angle:g}_deg_s": time_of(one.settling_time),
            f"{prefix}overshoot_at_{angle:g}_deg_deg": overshoot(one),
            f"{prefix}steady_error_at_{angle:g}_deg_deg": steady(one),
        }
    return result


def draw_angles(axes: Axes, runs: Runs) -> None:
    """Angle over time, one colour a set point, which is dotted."""
    for colour, (angle, (loop, _)) in zip(SHADES, runs.items(), strict=False):
        axes.plot(loop.run.time, np.degrees(loop.run.position), color=colour, label=f"{angle:g}°")
        axes.axhline(angle, color=colour, linewidth=0.7, linestyle=":")
    named(axes, "time (s)", "arm angle (°)")


def draw_set_points(figure: Figure, runs: Runs) -> None:
    """Angle and voltage."""
    angle, voltage = panels(figure, 2, share=True)
    draw_angles(angle, runs)
    for colour, (loop, _) in zip(SHADES, runs.values(), strict=True):
        voltage.plot(loop.run.time, loop.voltage, color=colour, linewidth=0.7)
    named(voltage, "time (s)", "voltage (V)")
    angle.legend(frameon=False, fontsize=8, loc="center left", bbox_to_anchor=(1.0, 0.5))


def draw_range(axes: Axes, loop: Recorded, title: str) -> None:
    """The wire's temperature between A_s' and A_f'."""
    start, finish = austenite_range(arm(), loop.run.stress)
    axes.plot(loop.run.time, loop.run.temperature, color=RED, label="wire")
    axes.plot(loop.run.time, start, "--", color=GREY, label="A_s'")
    axes.plot(loop.run.time, finish, "-.", color=BLUE, label="A_f'")
    named(axes, "time (s)", "temperature (°C)", title)


def above_finish(loop: Recorded) -> float:
    """Largest T - A_f', C."""
    return float((loop.run.temperature - austenite_range(arm(), loop.run.stress)[1]).max())
