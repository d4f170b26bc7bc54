"""Gains of backstepping, approach I: one pair for all set points. `python -m studies.gains.backstepping_one`."""

from __future__ import annotations

import jax
import numpy as np

from smajax.figures.backstepping_runs import plant
from smajax.gain_search import search_gains
from smajax.presets import backstepping_one
from studies.gains.record import write

BOX = {"damping_gain": (0.2, 10.0), "stress_gain": (1.0, 150.0)}
TARGETS = (-20.0, 0.0, 20.0, 40.0)
SECONDS, SEED = 15.0, 0


def main() -> None:
    jax.config.update("jax_enable_x64", True)
    system = plant()
    found = search_gains(
        system,
        backstepping_one(system),
        BOX,
        list(np.radians(TARGETS)),
        seconds=SECONDS,
        candidates=40,
        rounds=6,
        seed=SEED,
    )
    write("backstepping_one", found, BOX, TARGETS, seconds=SECONDS, seed=SEED)


if __name__ == "__main__":
    main()
