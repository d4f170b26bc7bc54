"""The arm under backstepping control: the plant that section 4.8 is written for, and batches of runs on it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, TypeVar

import jax
import jax.numpy as jnp
import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from smajax.control.closed_loop import ClosedLoop, simulate_closed_loop
from smajax.control.controllers.base import AbstractController
from smajax.control.controllers.inverse_wire import fraction_for, temperature_for
from smajax.control.estimators.base import AbstractEstimator
from smajax.control.figures_of_merit import Merit, merit
from smajax.control.measured_state import Sensor
from smajax.control.presets import with_printed_law
from smajax.control.reference import clock, constant
from smajax.model.load.base import AbstractMovingLoad
from smajax.model.rigs import arm
from smajax.model.system import System, initial_state
from smajax.model.types import Motion, Scalar, State
from smajax.model.wire.heat import cross_section
from smajax.model.wire.start import start
from smajax.report.drawing import GREY, keyed, named, panels
from smajax.simulation.simulate import DEFAULT_STEP

from .rigs import Recorded, compiled, together

Tree = TypeVar("Tree")
PERIOD, SECONDS = 0.01, 20.0
ON_ITS_PLANT = (
    "plant: the integrated law without a thermal term, which is what the section prints (eq. 4.51) and the controller "
    "inverts; on that of the other rows approach II does not settle (C15). The controller gets the true state and commands 10 V at most, as every controller here"
)


def plant() -> System:
    """The arm with the constitutive law that the section prints: integrated, and without a thermal term (eq. 4.51)."""
    return with_printed_law(arm())


def on_heating_curve(system: System, position: Scalar, velocity: Scalar) -> State:
    """The arm at an angle with a velocity; the wire carries its weight, on the heating curve of cold martensite."""
    load = system.load
    assert isinstance(load, AbstractMovingLoad)
    rest = initial_state(system, system.drive.from_command(jnp.zeros(())))
    stress = load.resistance(position, jnp.zeros_like(position), {}) / (load.lever() * cross_section(system.wire))
    fraction = fraction_for(system, position, stress)
    one, zero = jnp.ones_like(position), jnp.zeros_like(position)
    edge = jnp.asarray(1e-9)
    temperature = temperature_for(system.wire.kinetics, fraction, stress, one > 0.0, one, zero, edge)
    strain = -load.contraction(system.wire) * (position - load.start())
    wire = start(system.wire, temperature, stress, strain, fraction)
    return State(rest.time, wire, Motion(position, velocity), position)


def stacked(trees: Sequence[Tree]) -> Tree:
    """One tree of arrays (runs, ...) of many trees of one shape."""
    stack: Tree = jax.tree.map(lambda *leaves: jnp.stack([jnp.asarray(leaf) for leaf in leaves]), *trees)
    return stack


@compiled
def _run(
    system: System,
    controller: AbstractController,
    target: Scalar,
    initial: State | None,
    seconds: float,
    dt: float,
    estimator: AbstractEstimator | None,
    sensor: Sensor | None,
) -> tuple[ClosedLoop, Merit]:
    wanted, every = constant(clock(seconds, dt), target), round(PERIOD / dt)
    key = None if sensor is None else jax.random.key(0)
    loop = simulate_closed_loop(
        system, controller, wanted, dt, every, initial=initial, estimator=estimator, sensor=sensor, key=key
    )
    return loop, merit(loop, system)


def runs(
    systems: Sequence[System],
    controllers: Sequence[AbstractController],
    targets: Sequence[float],
    fast: bool,
    seconds: float = SECONDS,
    initial: State | None = None,
    estimator: AbstractEstimator | None = None,
    noise: Sequence[float] | None = None,
) -> tuple[Recorded, Recorded]:
    """Runs and their figures of merit, one system, controller and set point (degrees) a run; `initial` likewise.

    Without an `estimator`, one for all, the controllers get the true state; `noise`, rad, is that of each run's
    reading of the position.
    """
    dt = PERIOD if fast else DEFAULT_STEP
    sensors = [None] * len(systems) if noise is None else [Sensor(noise_sigma=sigma) for sigma in noise]
    found = []
    for k, (system, controller, target) in enumerate(zip(systems, controllers, targets, strict=True)):
        start = jax.tree.map(lambda leaf, k=k: leaf[k], initial)
        found.append(_run(system, controller, np.radians(target), start, seconds, dt, estimator, sensors[k]))
    loops, merits = together(found)
    return loops, merits


def degrees(loops: Recorded) -> Any:
    """The angle of every run, degrees, shape (runs, time)."""
    return np.degrees(loops.run.position)


def draw_sweep(
    figure: Figure, loops: Recorded, names: Sequence[str], target: float, below: Callable[[Axes], None]
) -> None:
    """The angle of every run, and under it what `below` draws."""
    angle, other = panels(figure, 2, 1)
    for line, name, colour in zip(degrees(loops), names, shades(len(names)), strict=True):
        angle.plot(loops.run.time[0], line, label=name, linewidth=1.3, color=colour)
    angle.axhline(target, color=GREY, linewidth=0.8, linestyle="--")
    keyed(angle)
    named(angle, "time (s)", "arm angle (°)")
    below(other)


def draw_voltages(loops: Recorded, names: Sequence[str]) -> Callable[[Axes], None]:
    """For the lower panel: the voltage of every run."""

    def below(axes: Axes) -> None:
        for line, name, colour in zip(loops.voltage, names, shades(len(names)), strict=True):
            axes.step(loops.run.time[0], line, where="post", label=name, linewidth=1.0, color=colour)
        named(axes, "time (s)", "voltage (V)")

    return below


def shades(count: int) -> list[Any]:
    """Colours from dark to light for a swept parameter."""
    return [colormaps["viridis"](k / max(count - 0.6, 1.0)) for k in range(count)]
