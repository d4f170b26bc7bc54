"""Where a load comes to rest between no command and the largest one: set points beyond are out of reach of every controller."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from typing import NamedTuple

import jax.numpy as jnp
import numpy as np

from smajax.control.controllers.base import AbstractController, limits_of
from smajax.control.load_equation import moving_load, stroke_of
from smajax.control.position_unit import SHARES, PositionUnit, band_shown, unit_of
from smajax.control.scales import HEADROOM, limited_as, seconds_for
from smajax.core.display_units import digits
from smajax.core.parameters import parameters
from smajax.data.experiment.magnitude import ANNEALS
from smajax.model.system import System
from smajax.simulation.compiled import simulate_compiled

STEP = 0.02  # s
LONGER = 2.0  # times a closed loop's length, in which the wire comes to rest
AT_REST = 0.2  # of the run, at its end
LARGER = 1.1  # limits of a command that are tried, each over the one before
TOLERANCE = 1e-3  # of a step: enough for a reach that is said to three digits


class Reach(NamedTuple):
    """Positions in the unit shown; command: the largest one, in the drive's unit."""

    low: float
    high: float
    command: float
    unit: PositionUnit
    by_drive: bool = True  # whether the largest command is the drive's; False: the controller's own
    parameters: tuple[str, ...] = ()  # of the controller, which limit its command
    hottest: float = 0.0  # degC, of the wire with the largest command

    def words(self) -> str:
        """`with up to 5 V this load comes to rest between 0 and 12.3 mm`."""
        ends = [digits(0.0 if abs(end) < 1e-6 * abs(self.high - self.low) else end, 3) for end in (self.low, self.high)]
        return f"with up to {digits(self.command, 4)} {self.unit.command} this load comes to rest between {ends[0]} and {ends[1]} {self.unit.shown}"


def reach_of(
    system: System, controller: AbstractController | None = None, assumed: System | None = None
) -> Reach | None:
    """The reach of a plant, by a run without a command and one with the largest, from the start, cold and at rest.

    The largest command is that of the drive, or of the controller where it stays below. None where the reach cannot be known: neither has a
    limit, or the load follows an input. assumed: the plant as the controller knows it, by whose drive a command becomes an input.
    """
    load = moving_load(system)
    drive = (system if assumed is None else assumed).drive
    of_drive = float(drive.largest_command())
    of_controller = math.inf if controller is None else float(controller.largest_command())
    largest = min(of_drive, of_controller)
    if not math.isfinite(largest) or load.inputs_required:
        return None
    samples = round(LONGER * seconds_for(system) / STEP) + 1
    ends, hottest = [], 0.0
    for command in (0.0, largest):
        inputs = drive.from_command(jnp.full(samples, command))
        run = simulate_compiled(system, inputs, STEP, TOLERANCE)
        position, hottest = np.asarray(run.position), float(np.max(run.temperature))
        ends.append(position[-round(AT_REST * samples) :])
    if not np.isfinite(ends).all():
        return None
    unit = unit_of(system)
    limiting = () if controller is None else tuple(limits_of(controller))
    low, high = float(unit.of(np.min(ends))), float(unit.of(np.max(ends)))
    return Reach(low, high, largest, unit, of_drive <= of_controller, limiting, hottest)


def shared_set_points(systems: Iterable[System], count: int) -> tuple[float, ...]:
    """Evenly over what all these plants reach (their stroke where that cannot be known), in the unit shown, to three digits.

    Raises ValueError where nothing is within the reach of all.
    """
    lows, highs = [], []
    for system in systems:
        reach, unit = reach_of(system), unit_of(system)
        start = float(moving_load(system).start())
        stroke = tuple(float(unit.of(end)) for end in (start, start + float(stroke_of(system))))
        lows.append(max(stroke[0], reach.low) if reach else stroke[0])
        highs.append(min(stroke[1], reach.high) if reach else stroke[1])
    low, high = max(lows), min(highs)
    if not low < high:
        raise ValueError(
            f"no set point is within the reach of all models: they have from {lows} to {highs}; give set points."
        )
    return tuple(float(f"{one:.3g}") for one in low + np.linspace(SHARES[0], SHARES[-1], count) * (high - low))


def out_of_reach(reach: Reach | None, system: System, set_points: Sequence[float]) -> list[float]:
    """Those of the set points, in the unit shown, that are farther from the reach than what counts as there."""
    if reach is None:
        return []
    near = band_shown(system)
    return [point for point in set_points if not reach.low - near <= point <= reach.high + near]


def higher_limit(
    reach: Reach,
    system: System,
    set_points: Sequence[float],
    reach_with: Callable[[dict[str, float]], Reach | None],
) -> dict[str, float]:
    """A higher limit of a controller's command, with as much above what the set points need as presets have; by its parameters, in the drive's unit.

    `reach_with`: the reach with values of these. Empty where the set points are in reach, the drive's limit is lower or not known, or the wire anneals
    before it reaches them.
    """
    known = limited_as(system)
    too_high = any(one > reach.high for one in out_of_reach(reach, system, set_points))
    if known is None or reach.by_drive or not too_high:
        return {}
    of_drive, limit = float(known), LARGER * reach.command
    # From below: of a wire that is far too hot expansion takes the stroke away again.
    while limit < LARGER * of_drive:
        with_it = reach_with(dict.fromkeys(reach.parameters, min(limit, of_drive)))
        if with_it is not None and with_it.hottest > max(ANNEALS, reach.hottest):
            return {}
        if with_it is not None and not out_of_reach(with_it, system, set_points):
            return dict.fromkeys(reach.parameters, min(HEADROOM * limit, of_drive))
        limit *= LARGER
    return {}


def reach_sentence(reach: Reach | None, system: System, set_points: Sequence[float]) -> str:
    """Which set points are out of reach, what the reach is, and what to do; "" for none."""
    beyond = out_of_reach(reach, system, set_points)
    if reach is None or not beyond:
        return ""
    several = len(beyond) > 1
    named = ", ".join(f"{point:g}" for point in beyond)
    higher = f" a higher limit of the command ({_raised(reach, system)})," if max(beyond) > reach.high else ""
    return (
        f"The set point{'s' * several} {named} {reach.unit.shown} {'are' if several else 'is'} out of reach of every controller: {reach.words()}. "
        f"Give a set point within,{higher} or another load (--set)."
    )


def _raised(reach: Reach, system: System) -> str:
    """What raises the limit of the command that holds: parameters of the drive, of an amplifier also where its controller has the lower one."""
    table = parameters(system.drive)
    options = [f"--set {name}=..." for name in ("amplifier_limit", "supply_voltage") if name in table]
    if not reach.by_drive:
        options.extend(f"{name} of the gains file (--gains, --start)" for name in reach.parameters)
    return " or ".join(options)
