"""Gains of the PID tuned at 40 degrees (C2): whether any leaves a steady error at other set points (Fig. 4.4).

"For this angle, the system has a reach time of 4 seconds and has no overshoot ... For other set-points system has both
steady-state error and overshoot." Gains at random; those that fit the first sentence are looked at after 40 s elsewhere.
"""

from __future__ import annotations

from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from smajax.control.closed_loop import simulate_closed_loop
from smajax.control.figures_of_merit import merit
from smajax.control.presets import pid_tuned_at
from smajax.control.reference import clock, constant
from smajax.core.parameters import set_vector
from smajax.model.rigs import arm
from studies.source.c02_pid_at_40 import LONG, PRINTED
from studies.source.set_points import PERIOD, SECONDS, SET_POINTS

from .candidates import drawn, each

BOX = {"proportional_gain": (3.0, 120.0), "integral_gain": (0.3, 20.0), "derivative_gain": (0.05, 40.0)}
CANDIDATES, SEED, OWN = 3000, 0, 40.0


@eqx.filter_jit
def _merits(gains: Any, targets: Any, seconds: float) -> Any:
    system, time = arm(), clock(seconds, PERIOD)
    controller = pid_tuned_at(system, round(OWN))

    def one(row: Any, target: Any) -> Any:
        tuned = set_vector(controller, tuple(BOX), row)
        return merit(simulate_closed_loop(system, tuned, constant(time, target), PERIOD, 1), system)

    return each(one, gains, targets)


def found() -> dict[str, Any]:
    """No values: how many candidates fit the tuned set point, and the largest error that one of them leaves both below and above."""
    gains = drawn(BOX, CANDIDATES, SEED)
    own = jax.tree.map(
        lambda one: np.asarray(one)[:, 0], _merits(jnp.asarray(gains), jnp.radians(jnp.asarray([OWN])), SECONDS)
    )
    fits = np.abs(own.reach_time / PRINTED - 1.0) < 0.25
    fits &= (np.degrees(own.overshoot) < 0.1) & (np.degrees(own.steady_error) < 0.25)
    late = _merits(jnp.asarray(gains[fits]), jnp.radians(jnp.asarray(SET_POINTS)), LONG)
    error = np.degrees(np.asarray(late.steady_error))
    below, above = (error[:, [side * at < side * OWN for at in SET_POINTS]].max(axis=1) for side in (1.0, -1.0))
    both = np.minimum(below, above)
    best = int(both.argmax())
    return {
        "values": {},
        "tried": CANDIDATES,
        "fit_their_own_set_point": int(fits.sum()),
        "largest_error_after_40_s_below_and_above_deg": round(float(both.max()), 3),
        "with": {name: float(f"{value:.3g}") for name, value in zip(BOX, gains[fits][best], strict=True)},
    }
