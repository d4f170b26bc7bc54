"""M10: from a point in either range, which directions of the stress-temperature plane transform (Fig. 3.34)."""

from __future__ import annotations

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from matplotlib.figure import Figure

from smajax.core.parameters import set_parameters
from smajax.model.rigs import coupon
from smajax.report.drawing import BLUE, GREY, RED, keyed, named, panels
from smajax.simulation.simulate import simulate

from .rigs import austenite_range, martensite_range
from .row import Result, Row

STRESS = 150e6  # Pa, at both points
LENGTH = 2.0  # C, of each short path; along the stress axis it is C_A times this


def work(fast: bool) -> Result:
    """A short straight path in every direction, all of them in one batch."""
    count, samples = (24, 21) if fast else (72, 101)
    around = 2.0 * np.pi * (np.arange(count) + 0.5) / count
    system = coupon("enhanced")
    slope = float(system.wire.kinetics.stress_slope_austenite)
    share = np.linspace(0.0, 1.0, samples)

    @eqx.filter_jit
    def fan(temperature: float, fraction: float) -> jax.Array:
        def along(angle: jax.Array) -> jax.Array:
            inputs = {
                "temperature": temperature + LENGTH * jnp.cos(angle) * share,
                "stress": STRESS + slope * LENGTH * jnp.sin(angle) * share,
            }
            run = simulate(set_parameters(system, {"start_fraction": fraction}), inputs, 1.0)
            return run.martensite_fraction[-1] - run.martensite_fraction[0]

        return jax.vmap(along)(jnp.asarray(around))

    points = {
        "a": float(np.mean(austenite_range(system, np.asarray(STRESS)))),
        "g": float(np.mean(martensite_range(system, np.asarray(STRESS)))),
    }
    change = {name: np.asarray(fan(at, 0.5)) for name, at in points.items()}
    # dT - dsigma/C, the same for both branches here because C_A = C_M.
    drive = np.cos(around) - np.sin(around)
    to_austenite, to_martensite = change["a"] < 0.0, change["g"] > 0.0
    right_a, right_g = to_austenite == (drive > 0.0), to_martensite == (drive < 0.0)
    quiet = float(max(np.abs(change["a"][~to_austenite]).max(), np.abs(change["g"][~to_martensite]).max()))

    def draw(figure: Figure) -> None:
        (axes,) = panels(figure, 1)
        levels = np.array([100e6, 200e6])
        for name, lines in (("A", austenite_range(system, levels)), ("M", martensite_range(system, levels))):
            for line, which in zip(lines, ("start", "finish"), strict=True):
                axes.plot(line, levels / 1e6, "--", color=GREY)
                axes.annotate(f"{name}_{which[0]}'", (line[1], 201.0), fontsize=8)
        for name, moved, colour, word in (
            ("a", to_austenite, RED, "M → A"),
            ("g", to_martensite, BLUE, "A → M"),
        ):
            for angle, transforms in zip(around, moved, strict=True):
                end = points[name] + 4 * np.cos(angle), (STRESS + slope * 4 * np.sin(angle)) / 1e6
                style = {"arrowstyle": "->", "color": colour if transforms else "#d9dce1"}
                axes.annotate("", end, (points[name], STRESS / 1e6), arrowprops=style)
            axes.plot([], [], color=colour, label=f"from {name}: {word}")
            axes.annotate(name, (points[name], STRESS / 1e6), fontsize=11, weight="bold")
        axes.plot([], [], color="#d9dce1", label="no transformation")
        keyed(axes)
        named(axes, "temperature (°C)", "stress (MPa)")

    return Result(
        holds=bool(right_a.all() and right_g.all()) and quiet == 0.0,
        found=f"of {count} directions, {int(to_austenite.sum())} from a give M → A and {int(to_martensite.sum())} from g "
        "give A → M: exactly those on the side of dT - dsigma/C that the conditions name; the others leave xi unchanged",
        numbers={
            "directions": float(count),
            "right_from_a": float(right_a.sum()),
            "right_from_g": float(right_g.sum()),
            "largest_change_elsewhere": quiet,
        },
        draw=draw,
    )


ROW = Row(
    "M10",
    "Fig. 3.34",
    "wire",
    "every drawn path direction from point a (those of eq. 3.17) gives M → A, from point g (eq. 3.18) A → M",
    work,
)
