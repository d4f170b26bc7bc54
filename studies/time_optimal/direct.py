"""Direct optimisation of the command: a voltage every 25 ms, by derivatives through the simulator.

For a time T the voltages are sought that keep the arm within the band from T on: the part of the error beyond the band is a
least-squares problem whose least value is zero where T can be met. T is halved in on, from a command that settles at a known time
towards the least time to be there. Local: it begins with what it is given, so the time is one that can be met, and may not be the least.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float
from scipy.optimize import least_squares

from smajax.control.figures_of_merit import band_of
from smajax.model.system import System
from smajax.simulation.simulate import simulate
from studies.time_optimal.bang import PERIOD as DT

PIECE = 5  # samples of one voltage
HELD = 1.5  # s that the arm is kept within the band
INNER = 0.9  # of the band, that the optimisation aims at
EVALUATIONS = 40
CLOSE = 1.5 * DT  # s, of the time to settle
LATER = 0.1  # s


@partial(jax.jit, static_argnames="pieces")
def _positions(system: System, shares: Float[Array, " piece"], limit: float, pieces: int) -> Float[Array, " time"]:
    voltage = limit * jnp.repeat(shares, PIECE, total_repeat_length=pieces * PIECE)
    return simulate(system, {"voltage": voltage}, DT).position


def _beyond(
    system: System, target: float, limit: float, pieces: int
) -> tuple[Callable[[np.ndarray, int], np.ndarray], Callable[[np.ndarray, int], np.ndarray]]:
    """(how far the arm is beyond the inner band, of the band, sample by sample; its derivative), both from sample `first` on."""
    band = float(band_of(system))

    def residual(shares: Array, first: Array) -> Array:
        error = jnp.abs(_positions(system, shares, limit, pieces) - target) / band
        return jnp.where(jnp.arange(error.size) >= first, jnp.maximum(error - INNER, 0.0), 0.0)

    value, slope = jax.jit(residual), jax.jit(jax.jacfwd(residual))
    return (
        lambda shares, first: np.asarray(value(jnp.asarray(shares), first)),
        lambda shares, first: np.asarray(slope(jnp.asarray(shares), first)),
    )


def settled_directly(
    system: System, degrees: float, limit: float, least: float, known: float, voltage: np.ndarray
) -> tuple[float, np.ndarray]:
    """(time to settle in s, voltages (pieces,)) that the optimisation comes to.

    `least`: s, below which no command is there; `known`: that `voltage` (samples of `DT`) settles at, from which it begins.
    """
    target = float(np.radians(degrees))
    pieces = int(np.ceil((known + LATER + HELD) / (DT * PIECE)))
    value, slope = _beyond(system, target, limit, pieces)
    padded = np.pad(voltage, (0, max(0, pieces * PIECE - len(voltage))), mode="edge")[: pieces * PIECE]
    heat = np.sqrt((padded.reshape(pieces, PIECE) ** 2).mean(axis=1))  # the same in each piece
    shares = np.clip(heat / limit, 1e-3, 1.0 - 1e-3)
    low, best = least, (np.inf, shares)
    trial = known
    while best[0] - low > CLOSE:
        first = round(trial / DT)
        found = least_squares(
            lambda at, first=first: value(at, first),
            best[1],
            lambda at, first=first: slope(at, first),
            bounds=(0.0, 1.0),
            max_nfev=EVALUATIONS,
            gtol=1e-12,
        )
        if value(found.x, first).max() <= 1.0 - INNER:
            outside = np.flatnonzero(value(found.x, 0) > 1.0 - INNER)
            best = ((outside[-1] + 1) * DT, found.x)
        elif np.isfinite(best[0]):
            low = trial
        elif trial > known + LATER:  # in voltages of this length even the known time is out of reach
            break
        trial = DT * round(0.5 * (low + best[0]) / DT) if np.isfinite(best[0]) else trial + LATER
    return best
