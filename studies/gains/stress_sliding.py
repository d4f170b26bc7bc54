"""Gains of stress-based sliding control in chapter 4: `python -m studies.gains.stress_sliding` (a minute)."""

from __future__ import annotations

from typing import Any

from smajax.control.gain_search import regulation_cost
from smajax.control.presets import STRESS_BOX, quick_stress_sliding
from smajax.model.rigs import arm
from studies.gains.record import main, searched

TARGETS = [-40.0, -20.0, 0.0, 20.0, 40.0, 60.0]  # degrees


def searches() -> dict[str, dict[str, Any]]:
    """The one search: one set of gains for all set points."""
    controller = quick_stress_sliding(arm())
    return {"tuned_everywhere": searched(controller, STRESS_BOX, TARGETS, regulation_cost, candidates=44, rounds=10)}


if __name__ == "__main__":
    main("stress_sliding", searches)
