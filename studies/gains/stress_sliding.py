"""Gains of stress-based sliding control: one set for all set points. `python -m studies.gains.stress_sliding`."""

from __future__ import annotations

import jax
import numpy as np

from smajax.figures.rigs import arm
from smajax.gain_search import search_gains
from smajax.presets import quick_stress_sliding
from studies.gains.record import write

# A stress known to 1 MPa is what an estimator gives: 1e-6 V/Pa answers that with one volt.
BOX = {
    "surface_slope": (0.5, 20.0),
    "gain": (1e-3, 0.1),
    "boundary": (0.3, 30.0),
    "stress_gain": (2e-8, 1e-6),
    "stress_integral_gain": (1e-8, 5e-6),
    "stress_derivative_gain": (1e-10, 1e-7),
}
TARGETS = (-40.0, -20.0, 0.0, 20.0, 40.0, 60.0)
SECONDS, SEED = 10.0, 0


def main() -> None:
    jax.config.update("jax_enable_x64", True)
    system = arm()
    found = search_gains(
        system,
        quick_stress_sliding(system),
        BOX,
        list(np.radians(TARGETS)),
        seconds=SECONDS,
        candidates=44,
        rounds=10,
        seed=SEED,
    )
    write("stress_sliding", found, BOX, TARGETS, seconds=SECONDS, seed=SEED)


if __name__ == "__main__":
    main()
