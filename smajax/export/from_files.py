"""From what the other commands write, a model file or a file of gains, to the C of it."""

from __future__ import annotations

import math
from pathlib import Path

from smajax.control.gains_file import read_gains
from smajax.control.loop_around import loop_around
from smajax.control.loop_settings import LoopSettings, joined
from smajax.control.model_as_plant import with_limit
from smajax.control.presets import CONTROLLERS
from smajax.export.controller import SHORT, check_reads, controller_block
from smajax.export.errors import ExportError
from smajax.export.plant import DEFAULT_TOLERANCE, check_plant, plant_block
from smajax.export.single_precision import DOUBLE, SingleBuild, single_build
from smajax.export.source import CSource, c_source
from smajax.model.system import System


def plant_source(
    system: System,
    name: str = "actuator",
    title: str = "",
    tolerance: float = DEFAULT_TOLERANCE,
    arithmetic: str = DOUBLE,
) -> CSource:
    """The C of a model. arithmetic: of a build with single-precision inputs and outputs, "double" or "float". Raises ExportError for what cannot be exported, with the part and the reason; ValueError as `check_bounds`."""
    if not 1e-9 <= tolerance <= 1e-2:
        raise ExportError(f"the tolerance of a step is {tolerance:g}; expected 1e-9 to 1e-2.")
    check_plant(system)
    single = SingleBuild(arithmetic)
    return c_source(lambda: plant_block(system, name, title, tolerance), name, single=single)


def controller_source(
    system: System,
    gains: Path,
    name: str = "controller",
    *,
    estimator: str | None = None,
    period: float | None = None,
    delay: int | None = None,
    own_limit: bool = False,
    arithmetic: str | None = None,
) -> CSource:
    """The C of the controller in a file of gains on `system`, the plant that it assumes.

    estimator: the name of one, "" for the reading alone. period: s. delay: periods until a command arrives. What is None is what the gains
    were tuned with, where their file says it; the estimator's noise of a reading is the one they were tuned with too. own_limit: the limit of the command is that of `system`, whatever the file says.
    arithmetic: of a build with single-precision inputs and outputs, "double" or "float"; None: "float" where that was measured to be enough.
    Raises GainsFileError as `read_gains`, ExportError for a controller that reads what nobody measures, KeyError for no estimator
    and ValueError as `loop_around`.
    """
    found = read_gains(gains, system)
    found = found.without_limit(system) if own_limit else found
    used = joined({found.controller: found.loop}, LoopSettings(period=period, delay=delay, estimator=estimator))
    if not 0.0 < used.period < math.inf or used.delay < 0:
        raise ExportError(
            f"the period is {used.period:g} s and the delay {used.delay} periods; expected more than 0 s, and 0 periods or more."
        )
    assumed = with_limit(system, used.command_limit)
    filtered, noise = used.estimator or None, found.loop.noise or 0.0
    loop = loop_around(assumed, found.controller, found, estimator=filtered, noise=noise, delay=used.delay)
    known = CONTROLLERS[found.controller].known
    source = c_source(
        lambda: controller_block(loop.system, loop.controller, loop.estimator, used.period, used.delay, name, known),
        name,
        SHORT,
        single_build(found.controller, used.estimator, used.period, arithmetic),
    )
    check_reads(source, f"the controller `{found.controller}`", loop.estimator is not None)
    return source
