"""Gains of stress-based sliding control in chapter 4: `python -m studies.gains.stress_sliding` (a minute)."""

from __future__ import annotations

from typing import Any

from smajax.control_presets import quick_stress_sliding
from smajax.figures.rigs import arm
from smajax.gain_search import regulation_cost
from studies.gains.record import main, searched

# A stress known to 1 MPa is what an estimator gives: 1e-6 V/Pa answers that with one volt.
BOX = {
    "surface_slope": (0.5, 20.0),
    "gain": (1e-3, 0.1),
    "boundary": (0.3, 30.0),
    "stress_gain": (2e-8, 1e-6),
    "stress_integral_gain": (1e-8, 5e-6),
    "stress_derivative_gain": (1e-10, 1e-7),
}
TARGETS = [-40.0, -20.0, 0.0, 20.0, 40.0, 60.0]  # degrees


def searches() -> dict[str, dict[str, Any]]:
    """The one search: one set of gains for all set points."""
    controller = quick_stress_sliding(arm())
    return {"tuned_everywhere": searched(controller, BOX, TARGETS, regulation_cost, candidates=44, rounds=10)}


if __name__ == "__main__":
    main("stress_sliding", searches)
