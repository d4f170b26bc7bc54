"""The dead weight whose mass is taken off in steps and put back at a constant voltage (Fig. 3.24-3.33)."""

from __future__ import annotations

import functools

import jax.numpy as jnp
import numpy as np

from smajax.model.rigs import dead_weight
from smajax.simulation.simulate import DEFAULT_STEP

from .rigs import LAWS, Recorded, batch

INITIAL_MASS = 0.363  # kg: the captions'; the text says 388 g, eq. 3.23 uses 343 g
# Under a constant h_c 16 V is far above the range at 363 g; this one leaves the fraction of the experiment (M13).
VOLTS = 5.588
HEATED, HELD = 40.0, 20.0  # s: with the full mass, then between changes
CASES = {
    "96 g": (0.096, 1),
    "192 g": (0.192, 1),
    "288 g": (0.288, 1),
    "288 g in three steps": (0.288, 3),
}


SWEPT = (
    4.8,
    5.0,
    5.1,
    5.2,
    5.3,
    5.4,
    5.5,
    5.55,
    VOLTS,
    5.6,
    6.0,
    8.0,
    16.0,
)  # V: from no transformation to a whole one

PERIODS = 6  # of HELD seconds, enough for three steps down and three up; shorter cases rest at the end
Lane = tuple[str, float]  # (a key of CASES, volts)


def _mass(case: str, first: int, held: int) -> np.ndarray:
    removed, steps = CASES[case]
    down = [INITIAL_MASS - removed * (k + 1) / steps for k in range(steps)]
    levels = [*down, *down[-2::-1]]
    levels += [INITIAL_MASS] * (PERIODS - len(levels))
    return np.concatenate([np.full(first, INITIAL_MASS), np.repeat(levels, held), [INITIAL_MASS]])


@functools.cache
def unloaded(law: str, fast: bool, *lanes: Lane) -> tuple[Recorded, int, np.ndarray]:
    """(runs, sample just before the first change, masses), arrays of shape (lanes, time): all lanes in one batch."""
    dt = 0.04 if fast else DEFAULT_STEP
    first, held = round(HEATED / dt), round(HELD / dt)
    mass = np.stack([_mass(case, first, held) for case, _ in lanes])
    volts = np.array([volts for _, volts in lanes])[:, None] * np.ones(mass.shape[1])
    return batch(dead_weight(law), {"voltage": jnp.asarray(volts), "mass": jnp.asarray(mass)}, dt), first - 1, mass


def net_deflection(runs: Recorded, before: int) -> np.ndarray:
    """How much higher the mass hangs after it was taken off and put back, mm, by lane."""
    return 1e3 * (runs.position[:, -1] - runs.position[:, before])


__all__ = ["CASES", "INITIAL_MASS", "LAWS", "SWEPT", "VOLTS", "net_deflection", "unloaded"]
