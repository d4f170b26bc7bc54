"""Gains of the PID controller: `python -m studies.gains.pid` (some minutes).

Without anti-windup, as the source names none (Fig. 4.3-4.5), at one set point each; and with it, at all of them.
"""

from __future__ import annotations

from typing import Any

import jax.numpy as jnp

from smajax.control.controllers.pid import Pid
from smajax.control.figures_of_merit import Merit
from smajax.control.gain_search import regulation_cost
from smajax.control.presets import PID_BOX
from smajax.model.types import Scalar
from studies.gains.record import Cost, main, or_never, searched

# The source names no anti-windup.
BOX = {name: bounds for name, bounds in PID_BOX.items() if name != "unwinding_time"}


def reaches_in(printed: float) -> Cost:
    """The cost that aims at a printed reach time."""

    def cost(one: Merit, seconds: float) -> Scalar:
        """|reach time - printed| in s, and per degree 1 of overshoot and 2 of steady error."""
        late = jnp.abs(or_never(one.reach_time, seconds) - printed)
        return late + jnp.degrees(one.overshoot) + 2.0 * jnp.degrees(one.steady_error)

    return cost


def searches() -> dict[str, dict[str, Any]]:
    """Every search of this controller by name."""
    plain = Pid(proportional_gain=5.0, integral_gain=5.0, derivative_gain=1.0, largest_voltage=10.0, unwinding_time=1e9)
    return {
        "tuned_at_0_deg": searched(plain, BOX, [0.0], regulation_cost),
        "tuned_at_10_deg": searched(plain, BOX, [10.0], reaches_in(2.5)),
        "tuned_at_40_deg": searched(plain, BOX, [40.0], reaches_in(4.0)),
        "tuned_everywhere": searched(plain, PID_BOX, [-30.0, 10.0, 40.0, 70.0], regulation_cost, candidates=72),
    }


if __name__ == "__main__":
    main("pid", searches)
