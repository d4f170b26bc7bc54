"""A change at some time during a run, smooth so that its time can be found by gradients."""

from __future__ import annotations

import jax

from smajax.model.effects.candidate import Width
from smajax.model.types import Scalar

TIMES = (0.1, 0.25, 0.4, 0.55, 0.7)  # of a run
SHARP = 0.02
TIME_WIDTH = Width(0.5, "any time of a run alike: half a run about its middle", of="run", base=0.5)
STEP_WIDTH = Width(1.0, "a fiftieth of a run, within a factor of 2.7", of="run", logarithmic=True, base=SHARP)


def during(seconds: float) -> tuple[dict[str, float], ...]:
    """Times and widths (s) at which a change may be looked for in a run of so many seconds."""
    return tuple({"time": share * seconds, "width": SHARP * seconds} for share in TIMES)


def changed(time: Scalar, middle: Scalar, width: Scalar) -> Scalar:
    """Share of the change that has happened at `time` (s): a logistic step, a quarter to three quarters in 2.2 `width`."""
    return jax.nn.sigmoid((time - middle) / width)
