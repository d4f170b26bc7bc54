"""The arm under stress-based sliding control, one run for each law."""

from __future__ import annotations

import functools
from typing import Any

import jax.numpy as jnp
import numpy as np
from matplotlib.figure import Figure

from smajax.model.rigs import arm
from smajax.report.drawing import LAW_COLOURS, LAW_STYLES, keyed, named, panels
from smajax.simulation.simulate import DEFAULT_STEP

from .rigs import LAWS, Recorded, austenite_range, controlled
from .unprinted import sliding

SECONDS, PERIOD = 20.0, 0.01


@functools.cache
def to_85_degrees(fast: bool) -> dict[str, Recorded]:
    """Regulation at 85 degrees, beyond the angle of greatest stress, by law: M5 and M6 look at the same runs."""
    dt = PERIOD if fast else DEFAULT_STEP
    target = jnp.full(round(SECONDS / dt) + 1, jnp.radians(85.0))
    return {law: controlled(arm(law), target, dt, PERIOD, sliding) for law in LAWS}


def draw_regulation(figure: Figure, loops: dict[str, Recorded], shown: str) -> None:
    """Angle and fraction of all laws; temperature with its range, and stress over temperature, of the law `shown`."""
    angle, fraction, heat, plane = panels(figure, 2, 2)
    for law, loop in loops.items():
        style: dict[str, Any] = {"color": LAW_COLOURS[law], "linestyle": LAW_STYLES[law], "label": law}
        angle.plot(loop.run.time, np.degrees(loop.run.position), **style)
        fraction.plot(loop.run.time, loop.run.martensite_fraction, **style)
    one = loops[shown]
    angle.plot(one.run.time, np.degrees(one.wanted.position), color="#9aa0a8", linewidth=0.8, label="wanted")
    named(angle, "time (s)", "arm angle (°)")
    named(fraction, "time (s)", "martensite fraction")
    keyed(angle)
    start, finish = austenite_range(arm(), one.run.stress)
    heat.plot(one.run.time, one.run.temperature, color=LAW_COLOURS[shown], label="wire")
    heat.plot(one.run.time, start, "--", color="#9aa0a8", label="A_s'")
    heat.plot(one.run.time, finish, "-.", color="#9aa0a8", label="A_f'")
    keyed(heat)
    named(heat, "time (s)", "temperature (°C)", f"{shown}: temperature and its range")
    plane.plot(one.run.temperature, one.run.stress / 1e6, color=LAW_COLOURS[shown])
    levels = np.array([0.0, one.run.stress.max()])
    for name, line in zip(("A_s'", "A_f'"), austenite_range(arm(), levels), strict=True):
        plane.plot(line, levels / 1e6, ":", color="#9aa0a8")
        plane.annotate(name, (line[1], levels[1] / 1e6), fontsize=8, color="#6b7078")
    named(plane, "temperature (°C)", "stress (MPa)", f"{shown}: path in the plane")
