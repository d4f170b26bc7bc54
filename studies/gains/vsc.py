"""Gains of VSC2 and VSC3 at 10 V and 4 V: `python -m studies.gains.vsc` (a minute)."""

from __future__ import annotations

from typing import Any

import jax.numpy as jnp

from smajax.control.controllers.vsc2 import Vsc2
from smajax.control.controllers.vsc3 import Vsc3
from smajax.control.figures_of_merit import Merit
from smajax.model.types import Scalar
from studies.gains.record import Cost, main, or_never, searched

FULL_OVERSHOOT = 38.5  # degrees from 50 to where the arm stands when its wire comes to A_f'


def settles_in(printed: float) -> Cost:
    """The cost that aims at a printed settling time."""

    def cost(one: Merit, seconds: float) -> Scalar:
        """|settling time - printed| in s, per degree 1 of overshoot (VSC3) and 2 of steady error, 0.2 s per switch in a second."""
        late = jnp.abs(or_never(one.settling_time, seconds) - printed)
        # VSC2 overshoots in the source.
        over = jnp.degrees(one.overshoot) if printed < 5.0 else 0.0
        return late + over + 2.0 * jnp.degrees(one.steady_error) + 0.2 * one.switches_per_second

    return cost


def overshoots_to_the_finish(one: Merit, seconds: float) -> Scalar:
    """Degrees between the overshoot and the 38.5 left at A_f', settling time in s, 2 per degree of steady error."""
    missed = jnp.abs(jnp.degrees(one.overshoot) - FULL_OVERSHOOT)
    return missed + or_never(one.settling_time, seconds) + 2.0 * jnp.degrees(one.steady_error)


def searches() -> dict[str, dict[str, Any]]:
    """Every search of these controllers by name."""
    layer = Vsc2(high_voltage=10.0, low_voltage=4.0, boundary=0.1)
    surface = Vsc3(high_voltage=10.0, low_voltage=4.0, surface_slope=5.0, boundary=1.0, rate_filter=0.02)
    box = {"surface_slope": (0.5, 30.0), "boundary": (0.02, 30.0)}
    return {
        # Ends at the thin edge of its box: thinner than the cycle of VSC1 (0.17 degrees) a layer is none.
        "vsc2": searched(layer, {"boundary": (0.01, 1.0)}, [0.0], settles_in(8.0), candidates=64, rounds=6),
        "vsc3": searched(surface, box, [0.0], settles_in(3.0)),
        "vsc3_of_section_4_6": searched(surface, box, [50.0], overshoots_to_the_finish),
    }


if __name__ == "__main__":
    main("vsc", searches)
