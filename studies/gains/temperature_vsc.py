"""Gains of the temperature-based VSC, around the VSC of section 4.6: `python -m studies.gains.temperature_vsc`."""

from __future__ import annotations

from typing import Any

import jax.numpy as jnp

from smajax.control.figures_of_merit import Merit
from smajax.control.presets import PASSING_BOX, temperature_vsc
from smajax.model.rigs import arm
from smajax.model.types import Scalar
from studies.gains.record import main, or_never, searched


def as_soon_and_no_further(one: Merit, seconds: float) -> Scalar:
    """3 times the reach time in s, the settling time in s, and per degree 1 of overshoot and 2 of steady error."""
    times = 3.0 * or_never(one.reach_time, seconds) + or_never(one.settling_time, seconds)
    return times + jnp.degrees(one.overshoot) + 2.0 * jnp.degrees(one.steady_error)


def searches() -> dict[str, dict[str, Any]]:
    """Every search of this controller by name."""
    targets = [0.0, 25.0, 50.0, 70.0]
    return {
        "temperature_vsc": searched(temperature_vsc(arm()), PASSING_BOX, targets, as_soon_and_no_further, candidates=72)
    }


if __name__ == "__main__":
    main("temperature_vsc", searches)
