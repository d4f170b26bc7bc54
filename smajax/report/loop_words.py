"""What lies between a plant and its controller, for a page."""

from __future__ import annotations

from smajax.control.loop_settings import LoopSettings
from smajax.core.display_units import digits
from smajax.core.wording import counted


def loop_rows(loop: LoopSettings) -> list[list[str]]:
    """A row a setting: limit of the command, period, delay, filter, noise."""
    limit = "no limit" if loop.command_limit is None else f"up to {digits(loop.command_limit, 4)} {loop.command_unit}"
    return [
        ["limit of the command", limit],
        ["control period", "not known" if loop.period is None else f"{1e3 * loop.period:g} ms"],
        ["delay of the command", counted(loop.delay, "control period") if loop.delay else "no delay"],
        [
            "what the controller reads",
            f"the state from the filter {loop.estimator}" if loop.estimator else "the true state",
        ],
        ["sensor of the position", loop.noise_words()],
    ]
