"""The dead weight whose mass is taken off in steps and put back at a constant voltage (Fig. 3.24-3.33)."""

from __future__ import annotations

import functools

import numpy as np

from .rigs import LAWS
from .uneven_wire import Hung, hung

INITIAL_MASS = 0.363  # kg: the captions'; the text says 388 g, eq. 3.23 uses 343 g
VOLTS = 16.0  # the captions'
# Of the preset's rig, one temperature along the wire: with it the wire is partly transformed. Not for the figures.
EVEN_VOLTS = 5.588
HEATED, HELD = 40.0, 20.0  # s: with the full mass, then between changes
CASES = {
    "96 g": (0.096, 1),
    "192 g": (0.192, 1),
    "288 g": (0.288, 1),
    "288 g in three steps": (0.288, 3),
}
SWEPT = (6.0, 8.0, 10.0, 12.0, 14.0, VOLTS)  # V
PERIODS = 6  # of HELD seconds, enough for three steps down and three up; shorter cases rest at the end
Lane = tuple[str, float]  # (a key of CASES, volts)


def mass_over_time(case: str, first: int, held: int) -> np.ndarray:
    """kg at each sample: `first` samples of the full mass, then `held` of each step."""
    removed, steps = CASES[case]
    down = [INITIAL_MASS - removed * (k + 1) / steps for k in range(steps)]
    levels = [*down, *down[-2::-1]]
    levels += [INITIAL_MASS] * (PERIODS - len(levels))
    return np.concatenate([np.full(first, INITIAL_MASS), np.repeat(levels, held), [INITIAL_MASS]])


@functools.cache
def unloaded(law: str, fast: bool, *lanes: Lane) -> tuple[Hung, int, np.ndarray, np.ndarray]:
    """(runs, sample just before the first change, masses, time), arrays of shape (lanes, time)."""
    dt = 0.1 if fast else 0.02
    first, held = round(HEATED / dt), round(HELD / dt)
    mass = np.stack([mass_over_time(case, first, held) for case, _ in lanes])
    volts = np.array([volts for _, volts in lanes])[:, None] * np.ones(mass.shape[1])
    return hung(volts, mass, dt, law), first - 1, mass, dt * np.arange(mass.shape[1])


def net_deflection(rise: np.ndarray, before: int) -> np.ndarray:
    """How much higher the mass hangs after it was taken off and put back, mm, by lane."""
    net: np.ndarray = 1e3 * (rise[:, -1] - rise[:, before])
    return net


__all__ = [
    "CASES",
    "EVEN_VOLTS",
    "INITIAL_MASS",
    "LAWS",
    "SWEPT",
    "VOLTS",
    "mass_over_time",
    "net_deflection",
    "unloaded",
]
