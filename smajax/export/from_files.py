"""From what the other commands write, a model file or a file of gains, to the C of it."""

from __future__ import annotations

import math
from pathlib import Path

from smajax.control.gains_file import read_gains
from smajax.control.loop_around import loop_around
from smajax.control.presets import CONTROLLERS
from smajax.export.controller import SHORT, check_reads, controller_block
from smajax.export.errors import ExportError
from smajax.export.plant import DEFAULT_TOLERANCE, check_plant, plant_block
from smajax.export.source import CSource, c_source
from smajax.model.system import System

PERIOD = 0.01  # s, of a controller


def plant_source(
    system: System, name: str = "actuator", title: str = "", tolerance: float = DEFAULT_TOLERANCE
) -> CSource:
    """The C of a model. Raises ExportError for what cannot be exported, with the part and the reason; ValueError as `check_bounds`."""
    if not 1e-9 <= tolerance <= 1e-2:
        raise ExportError(f"the tolerance of a step is {tolerance:g}; expected 1e-9 to 1e-2.")
    check_plant(system)
    return c_source(lambda: plant_block(system, name, title, tolerance), name)


def controller_source(
    system: System,
    gains: Path,
    name: str = "controller",
    *,
    estimator: str = "",
    period: float = PERIOD,
    delay: int = 0,
) -> CSource:
    """The C of the controller in a file of gains on `system`, the plant that it assumes.

    estimator: the name of one, "" for the reading alone. period: s. delay: periods until a command arrives.
    Raises GainsFileError as `read_gains`, ExportError for a controller that reads what nobody measures, KeyError for no estimator
    and ValueError as `loop_around`.
    """
    if not 0.0 < period < math.inf or delay < 0:
        raise ExportError(
            f"the period is {period:g} s and the delay {delay} periods; expected more than 0 s, and 0 periods or more."
        )
    found = read_gains(gains, system)
    loop = loop_around(system, found.controller, found, estimator=estimator or None, delay=delay)
    known = CONTROLLERS[found.controller].known
    source = c_source(
        lambda: controller_block(loop.system, loop.controller, loop.estimator, period, delay, name, known), name, SHORT
    )
    check_reads(source, f"the controller `{found.controller}`", loop.estimator is not None)
    return source
