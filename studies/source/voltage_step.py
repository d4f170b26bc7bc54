"""An open-loop voltage step on the arm, drawn as Fig. 3.4 and 3.5 are."""

from __future__ import annotations

import jax.numpy as jnp
import numpy as np
from matplotlib.figure import Figure

from smajax.model.rigs import arm
from smajax.model.wire.form import AbstractForm
from smajax.report.drawing import BLUE, GREY, RED, keyed, named, panels
from smajax.simulation.simulate import DEFAULT_STEP

from .rigs import Recorded, austenite_range, simulated

SECONDS = 30.0


def stepped(volts: float, fast: bool, form: AbstractForm | None = None) -> Recorded:
    """30 s at a constant voltage from rest."""
    dt = 0.02 if fast else DEFAULT_STEP
    return simulated(arm(form=form), {"voltage": jnp.full(round(SECONDS / dt) + 1, volts)}, dt)


def draw_step(figure: Figure, run: Recorded) -> None:
    """Temperature with its range, fraction, stress and angle over time, and stress over angle (Fig. 3.6)."""
    start, finish = austenite_range(arm(), run.stress)
    heat, fraction, stress, angle = panels(figure, 2, 2)
    heat.plot(run.time, run.temperature, color=RED, label="wire")
    heat.plot(run.time, start, "--", color=GREY, label="A_s'")
    heat.plot(run.time, finish, "-.", color=GREY, label="A_f'")
    keyed(heat)
    named(heat, "time (s)", "temperature (°C)")
    fraction.plot(run.time, run.martensite_fraction, color=BLUE)
    fraction.set_ylim(-0.05, 1.05)
    named(fraction, "time (s)", "martensite fraction")
    stress.plot(np.degrees(run.position), run.stress / 1e6, color=BLUE)
    named(stress, "arm angle (°)", "stress (MPa)")
    angle.plot(run.time, np.degrees(run.position), color=BLUE)
    named(angle, "time (s)", "arm angle (°)")
