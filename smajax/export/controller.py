"""A controller with its estimator as a block: a reading and a set point once a period -> the command to hold until the next."""

from __future__ import annotations

from typing import Any

import jax.numpy as jnp

from smajax.control.controllers.base import AbstractController
from smajax.control.estimators.base import AbstractEstimator
from smajax.control.load_equation import moving_load
from smajax.control.measured_state import MeasuredState
from smajax.control.reference import Reference
from smajax.control.scales import unit_on
from smajax.core.parameters import check_bounds, parameter_values, parameters, set_parameters
from smajax.export.block import Block, Quantity, Values
from smajax.export.compiled import cast
from smajax.export.errors import ExportError
from smajax.export.source import CSource, ShortCall
from smajax.model.channels import INPUT_UNITS
from smajax.model.system import System
from smajax.model.types import Scalar

SHORT = ShortCall(("reading", "set_point"), "command")
# What a controller may be told beside the reading; only an estimator knows it on a bench.
STATES = ("velocity", "stress", "temperature", "martensite_fraction", "xi_M", "xi_A")
NO_GAINS = frozenset({"believed", "equation"})  # fields of a controller of one's own that are of the plant


def _gains(controller: AbstractController, system: System, known: frozenset[str]) -> tuple[Quantity, ...]:
    """Its parameters that are its own, not the plant's."""
    values = parameter_values(controller)
    return tuple(
        Quantity(one.name, unit_on(one.unit, system), one.about, values[one.name], one.low, one.high)
        for one in parameters(controller).values()
        if not known & {one.name, *map(str, one.path)}
    )


def controller_block(
    system: System,
    controller: AbstractController,
    estimator: AbstractEstimator | None,
    period: float,
    delay: int = 0,
    name: str = "controller",
    known: frozenset[str] = NO_GAINS,
) -> Block:
    """`controller` on `system`, the plant that it assumes, called every `period` seconds; its gains are parameters.

    Without an estimator the states that it reads are inputs. delay: periods until a command arrives, as the estimator has to know.
    known: its fields and parameters that are the plant's (`ControllerPreset.known`) and stay as they are.
    Raises ValueError for gains out of their bounds.
    """
    check_bounds(controller)
    own, filtered, plant = cast(controller), cast(estimator), cast(system)
    load, drive = moving_load(plant), plant.drive
    gains, unit = _gains(own, plant, known), load.position_unit
    seconds = float(period)

    def acted(p: Values, memory: Any, measured: MeasuredState, u: Values) -> tuple[Any, Values]:
        """What follows from a measured state: (memory, outputs)."""
        tuned = set_parameters(own, {one.name: p[one.name] for one in gains})
        wanted = _wanted(u)
        if "controller" not in memory:
            memory = {**memory, "controller": tuned.start(measured, wanted)}
        after, answer = tuned.step(memory["controller"], measured, wanted, jnp.asarray(seconds, dtype=float))
        # A command that is no number: 0 from here on, as in a simulated loop.
        failed = memory["failed"] | ~jnp.isfinite(answer)
        queue = jnp.append(memory["queue"], jnp.where(failed, 0.0, answer))
        held = queue[0]
        new = {**memory, "controller": after, "failed": failed, "queue": queue[1:], "held": held}
        return new, {"command": held, **_reaching(plant, held), **_estimate(measured)}

    def start(p: Values, u: Values) -> tuple[Any, Values]:
        estimate, measured = (None, _told(u)) if filtered is None else filtered.start(u["reading"])
        nothing = jnp.zeros(())
        memory = {"estimate": estimate, "failed": nothing > 0.0, "queue": jnp.zeros(delay), "held": nothing}
        return acted(p, memory, measured, u)

    def step(p: Values, x: Any, u: Values, _: Scalar) -> tuple[Any, Values]:
        estimate, measured = x["estimate"], _told(u)
        if filtered is not None:
            span = jnp.asarray(seconds, dtype=float)
            estimate, measured = filtered.step(x["estimate"], u["reading"], x["held"], span)
        return acted(p, {**x, "estimate": estimate}, measured, u)

    told = () if estimator is not None else tuple(Quantity(one, *_state(one, unit)) for one in STATES)
    inputs = (
        Quantity("reading", unit, f"of the {load.reading[0]}", float(load.start())),
        Quantity("set_point", unit, f"{load.reading[0]} wanted", float(load.start())),
        Quantity("set_point_rate", f"{unit}/s", "its derivative"),
        Quantity("set_point_acceleration", f"{unit}/s^2", "its second derivative"),
        *told,
    )
    kind, symbol = drive.command
    outputs = (
        Quantity("command", symbol, f"{kind} to hold until the next call"),
        *(
            Quantity(one, INPUT_UNITS.get(one, "1"), "the same as the drive takes it")
            for one in _reaching(plant, jnp.zeros(()))
        ),
        *(() if estimator is None else (Quantity(f"estimated_{one}", *_state(one, unit)) for one in STATES[:4])),
    )
    title = _title(own, filtered, plant)
    return Block(name, title, gains, inputs, outputs, start, step, seconds)


def _title(controller: AbstractController, estimator: AbstractEstimator | None, system: System) -> str:
    behind = f" behind the estimator {type(estimator).__name__}" if estimator is not None else ""
    return f"Controller {type(controller).__name__}{behind} of the load {type(system.load).__name__}"


def _state(name: str, unit: str) -> tuple[str, str]:
    units = {"velocity": f"{unit}/s", "stress": "Pa", "temperature": "degC"}
    return units.get(name, "-"), "of the load" if name == "velocity" else "of the wire"


def _told(u: Values) -> MeasuredState:
    """The reading and states as the inputs have them."""
    return MeasuredState(u["reading"], *(u.get(one, jnp.full((), jnp.nan)) for one in STATES))


def _wanted(u: Values) -> Reference:
    return Reference(u["set_point"], u["set_point_rate"], u["set_point_acceleration"])


def _reaching(system: System, command: Scalar) -> dict[str, Scalar]:
    """The drive's channels, where they are not the command itself."""
    inputs = system.drive.from_command(command)
    return {} if set(inputs) == {system.drive.command[0]} else dict(inputs)


def _estimate(measured: MeasuredState) -> dict[str, Scalar]:
    return {f"estimated_{one}": getattr(measured, one) for one in STATES[:4]}


def check_reads(source: CSource, what: str, estimated: bool) -> None:
    """ExportError for a controller that reads states which a bench does not measure, and has no estimator."""
    lacking = [one.name for one in source.inputs if one.name in STATES]
    if lacking and not estimated:
        raise ExportError(
            f"{what} cannot be exported without an estimator: it reads the {', '.join(one.replace('_', ' ') for one in lacking)}, which a "
            "bench does not measure. Give one (`--estimator model`, or `printed` on the arm)."
        )
