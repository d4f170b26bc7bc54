"""M15: R and E mix linearly, and the fraction can be read from the elongation under an added mass (eq. 3.15, 3.25)."""

from __future__ import annotations

import jax.numpy as jnp
import numpy as np
from matplotlib.figure import Figure

from smajax.model.rigs import coupon
from smajax.model.wire.constitutive import young_modulus
from smajax.model.wire.heat import cross_section
from smajax.model.wire.resistance import resistance_per_metre
from smajax.report.drawing import BLUE, GREY, keyed, named, panels

from .rigs import batch
from .row import Result, Row

BIAS, ADDED = 100e6, 20e6  # Pa: the stress held, and what an added mass puts on top
RESTING = 60.0  # C: between the ranges, where a little more stress transforms nothing


def work(fast: bool) -> Result:
    """Heat to many temperatures, cool to where nothing transforms, add a stress, and read E and xi from the strain."""
    count = 9 if fast else 33
    wire = coupon().wire
    # The middle of the gap between the two ranges at this stress.
    gap = RESTING + BIAS / 6.89e6
    tops = np.linspace(gap, 95.0, count)
    share = np.linspace(0.0, 1.0, 300)
    heat = 23.0 + (tops[:, None] - 23.0) * share
    cool = tops[:, None] + (gap - tops[:, None]) * share
    temperature = np.concatenate([heat, cool, np.full((count, 50), gap)], axis=1)
    stress = np.concatenate([np.full(600, BIAS), np.linspace(BIAS, BIAS + ADDED, 50)])
    run = batch(coupon(), {"temperature": jnp.asarray(temperature), "stress": jnp.tile(stress, (count, 1))}, 1.0)
    modulus = ADDED / (run.strain[:, -1] - run.strain[:, 599])
    true, read = run.martensite_fraction[:, -1], (modulus - 75e9) / (28e9 - 75e9)
    off = float(np.abs(true - read).max())
    xi = np.linspace(0.0, 1.0, 11)
    resistance = np.asarray(resistance_per_metre(wire, (), jnp.asarray(60.0), jnp.asarray(xi)))
    area = float(cross_section(wire))
    bent = float(np.abs(resistance * area - (84e-8 + xi * (76e-8 - 84e-8))).max() / 80e-8)
    stiffness = np.asarray(young_modulus(wire, jnp.asarray(xi)))
    bent = max(bent, float(np.abs(stiffness - (75e9 + xi * (28e9 - 75e9))).max() / 75e9))

    def draw(figure: Figure) -> None:
        left, middle, right = panels(figure, 1, 3)
        left.plot(xi, resistance, color=BLUE)
        named(left, "martensite fraction", "resistance (Ω/m)")
        middle.plot(xi, stiffness / 1e9, color=BLUE)
        named(middle, "martensite fraction", "Young's modulus (GPa)")
        right.plot([0, 1], [0, 1], "--", color=GREY, label="equal")
        right.plot(true, read, "o", color=BLUE, label="read")
        keyed(right)
        named(right, "simulated fraction", "fraction read from the elongation")

    return Result(
        holds=bent < 1e-12 and off < 1e-3 and float(np.ptp(true)) > 0.9,
        found=f"R and E are linear in xi to {bent:.0e}; the fraction read from the elongation under {ADDED / 1e6:.0f} MPa "
        f"more is off by {off:.1e} at most, xi from {true.min():.2f} to {true.max():.2f}",
        numbers={"departure_from_linear": bent, "largest_error_of_fraction_read": off},
        draw=draw,
        caveat="eq. 3.25 takes the whole stress over the elongation; with the change of both, as here, it needs no "
        "reference length.",
    )


ROW = Row(
    "M15",
    "eq. 3.15, 3.25",
    "wire",
    "R(xi), E(xi) mix linearly; xi is recovered from the elongation under an added mass",
    work,
)
