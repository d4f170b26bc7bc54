"""Gains of backstepping, approach I: `python -m studies.gains.backstepping_one` (a minute)."""

from __future__ import annotations

from typing import Any

from smajax.control.gain_search import regulation_cost
from smajax.control.presets import CONTROLLERS, backstepping_one
from studies.gains.record import main, searched
from studies.source.backstepping_runs import plant

BOX = CONTROLLERS["backstepping1"].box
TARGETS = [-20.0, 0.0, 20.0, 40.0]  # degrees


def searches() -> dict[str, dict[str, Any]]:
    """The one search: one set of gains for all set points."""
    system = plant()
    return {
        "tuned_everywhere": searched(
            backstepping_one(system),
            BOX,
            TARGETS,
            regulation_cost,
            system=system,
            seconds=15.0,
            candidates=40,
            rounds=6,
        )
    }


if __name__ == "__main__":
    main("backstepping_one", searches)
