r"""The command itself, piece by piece, by least squares through the simulator's derivatives: can it be inside the band from a time T on?

The unknowns are voltages of `PIECE` seconds, held in [0, u_max]. The residuals are what the position is outside of `INSIDE` of the band at each sample
from T to T + `HELD`. Levenberg-Marquardt steps make them zero or not; T goes down by `EARLIER` as long as they do. It begins from the command of the other
method (`bang`), of which it keeps neither the switches nor the controller that holds.
"""

from __future__ import annotations

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from smajax.control.figures_of_merit import band_of
from smajax.model.system import System
from smajax.simulation.simulate import simulate

DT = 0.01  # s
PIECE = 0.1  # s, of one voltage
HELD = 0.6  # s after T in which the position has to stay inside
INSIDE = 0.95  # of the band: the rest is for what lies between samples
EARLIER = 0.02  # s
STEPS = 8  # of a T
START, FALLS, RISES, LARGEST = 1e-2, 0.2, 8.0, 1e4  # damping
UNLIKELY = 2  # T's in a row that fail


@eqx.filter_jit
def _residuals(
    system: System, pieces: Float[Array, "runs pieces"], targets: Array, earliest: Array, slopes: bool
) -> tuple[Array, Array]:
    """((runs, samples), their derivatives by the pieces)."""
    inside, each = INSIDE * band_of(system), round(PIECE / DT)
    samples = pieces.shape[1] * each + 1

    def of(one: Array, target: Array, begin: Array) -> Array:
        voltage = jnp.append(jnp.repeat(one, each), one[-1])
        run = simulate(system, {"voltage": voltage}, DT)
        off = run.position - target
        judged = (run.time >= begin - 1e-9) & (run.time <= begin + HELD)
        return jnp.where(judged, jnp.sign(off) * jnp.maximum(jnp.abs(off) - inside, 0.0) / inside, 0.0)

    found = jax.vmap(of)(pieces, targets, earliest)
    if not slopes:
        return found, jnp.zeros((pieces.shape[0], samples, 0))
    return found, jax.vmap(jax.jacfwd(of))(pieces, targets, earliest)


def _step(residual: np.ndarray, slope: np.ndarray, pieces: np.ndarray, damping: float, largest: float) -> np.ndarray:
    """The pieces after a damped step. Those at a bound that the step would leave stay there."""
    slope = np.nan_to_num(slope)
    free = np.ones(len(pieces), bool)
    for _ in range(4):
        normal = slope[:, free].T @ slope[:, free]
        normal = normal + damping * (np.diag(np.diag(normal)) + 1e-6 * np.eye(int(free.sum())))
        change = np.zeros(len(pieces))
        change[free] = -np.linalg.solve(normal, slope[:, free].T @ residual)
        beyond = free & ((pieces + change < 0.0) & (pieces <= 0.0) | (pieces + change > largest) & (pieces >= largest))
        if not beyond.any():
            break
        free &= ~beyond
    return np.clip(pieces + change, 0.0, largest)


def earliest(
    system: System, targets: np.ndarray, begin: np.ndarray, pieces: np.ndarray, largest: float, least: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """(least T found, its pieces) of each set point (rad). `begin`, `pieces`: where the search begins; `least`: no T can be below.

    A T that the pieces do not meet to begin with is infinite until one is met.
    """
    runs = len(targets)
    best, kept = np.full(runs, np.inf), pieces.copy()
    wanted, now = begin.copy(), pieces.copy()
    damping, failed, tried = np.full(runs, START), np.zeros(runs, int), np.zeros(runs, int)
    open_ = np.ones(runs, bool)
    at = jnp.asarray(targets)
    while open_.any():
        residual, slope = (
            np.asarray(one) for one in _residuals(system, jnp.asarray(now), at, jnp.asarray(wanted), True)
        )
        cost = (residual**2).sum(axis=1)
        met = open_ & (cost == 0.0)
        best[met], kept[met] = wanted[met], now[met]
        failed[met], tried[met], damping[met] = 0, 0, START
        wanted[met] -= EARLIER
        going = open_ & ~met
        trial = now.copy()
        for k in np.flatnonzero(going):
            trial[k] = _step(residual[k], slope[k], now[k], damping[k], largest)
        after = (np.asarray(_residuals(system, jnp.asarray(trial), at, jnp.asarray(wanted), False)[0]) ** 2).sum(axis=1)
        better = going & (after < cost)
        now[better] = trial[better]
        damping = np.where(better, np.maximum(damping * FALLS, 1e-8), np.where(going, damping * RISES, damping))
        tried[going] += 1
        given_up = going & ((tried >= STEPS) | (damping > LARGEST))
        # A T that is not met may be met from where a later one ends: begin there again, further down, a few times.
        failed[given_up] += 1
        now[given_up], tried[given_up], damping[given_up] = kept[given_up], 0, START
        wanted[given_up] = np.where(np.isfinite(best[given_up]), best[given_up], wanted[given_up] + EARLIER)
        wanted[given_up] -= EARLIER / (2.0 ** failed[given_up])
        open_ &= (failed < UNLIKELY) & (wanted > least - 1e-9)
    return best, kept
