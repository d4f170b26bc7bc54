"""What lies between a plant and its controller, for a page."""

from __future__ import annotations

from smajax.control.loop_settings import LoopSettings
from smajax.core.display_units import digits
from smajax.core.wording import counted


def limit_words(loop: LoopSettings, largest: float | None = None) -> str:
    """Up to which command the loop goes, and by which of its two limits. largest: the controller's own, in the command's unit."""
    limits = {"controller": largest, "drive": loop.command_limit}
    known = {of: f"{digits(one, 4)} {loop.command_unit}" for of, one in limits.items() if one is not None}
    if largest is None or loop.command_limit is None or known["controller"] == known["drive"]:
        return f"up to {next(iter(known.values()))}" if known else "no limit"
    least, other = ("controller", "drive") if largest < loop.command_limit else ("drive", "controller")
    return f"up to {known[least]}, the limit of the {least}; that of the {other} is {known[other]}"


def loop_rows(loop: LoopSettings, largest: float | None = None) -> list[list[str]]:
    """A row a setting: limit of the command, period, delay, filter, noise. largest: as `limit_words`'."""
    return [
        ["limit of the command", limit_words(loop, largest)],
        ["control period", "not known" if loop.period is None else f"{1e3 * loop.period:g} ms"],
        ["delay of the command", counted(loop.delay, "control period") if loop.delay else "no delay"],
        [
            "what the controller reads",
            f"the state from the filter {loop.estimator}" if loop.estimator else "the true state",
        ],
        ["sensor of the position", loop.noise_words()],
    ]
