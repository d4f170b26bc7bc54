"""A model of an actuator as a block: the package's own step, and steps within a step as its error asks for them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import jax.numpy as jnp
from jax import lax

from smajax.core.names import listed
from smajax.core.parameters import check_bounds, parameter_values, parameters, set_parameters
from smajax.export.block import Block, Quantity, Values
from smajax.export.compiled import cast
from smajax.export.errors import ExportError
from smajax.model.channels import INPUT_UNITS, REPLACED
from smajax.model.load.base import AbstractMovingLoad
from smajax.model.system import System, initial_state
from smajax.model.types import Scalar, State
from smajax.model.wire.heat import cross_section
from smajax.model.wire.resistance import resistance_per_metre
from smajax.simulation.adaptive_steps import advance
from smajax.simulation.simulate import DEFAULT_STEP
from smajax.simulation.steppers import CouponSubsteps

TOLERANCE = "integration_tolerance"
DEFAULT_TOLERANCE = 1e-5  # shares of 1 C and of 1 % strain a step: a tenth of what one run by itself begins with
# s: error-controlled steps go through no more at a time. Where a load hits a stop they become as short as a share of that and no shorter,
# so that a longer communication step would leave more of an error there.
LONGEST = DEFAULT_STEP
COUPON_STEPS = 32  # between two communication points, along a straight line
ABOUT = {
    "voltage": "voltage at the amplifier's input",
    "current": "current of the source",
    "power": "electrical power in the wire",
    "duty": "share of the time that the switch is closed, 0 to 1",
    "mass": "mass that hangs on the wire",
    "load_torque": "disturbance against the angle",
    "added_mass": "payload beside that of the model",
    "temperature": "temperature of the wire",
    "stress": "stress of the wire",
    "strain": "strain of the wire",
    "ambient_temperature": "temperature of the air",
}


def check_plant(system: System) -> None:
    """ExportError for a model that needs more than its inputs at the present time; ValueError for parameters out of their bounds."""
    check_bounds(system)
    late = [one.effect_name for one in system.terms.input_lag]
    if late:
        raise ExportError(
            f"the effect {listed(late)} cannot be exported: it needs the whole series of the command, of which a block sees the present "
            "value alone. Leave it out and delay the command where the block is used."
        )


def channels_of(system: System) -> list[str]:
    """Input channels, those of the drive first."""
    drive, load = system.drive, system.load
    names = [
        *sorted(drive.inputs_required),
        *sorted(load.inputs_required | load.inputs_optional | drive.inputs_optional),
    ]
    return [*names, "ambient_temperature"] if isinstance(load, AbstractMovingLoad) else names


def _input(name: str, values: Mapping[str, float]) -> Quantity:
    replaced = {channel: parameter for parameter, channel in REPLACED.items()}.get(name, "")
    start = values.get(replaced, values.get("ambient_temperature", 0.0) if name == "temperature" else 0.0)
    low, high = (0.0, 1.0) if name == "duty" else (0.0, jnp.inf) if name == "mass" else (-jnp.inf, jnp.inf)
    return Quantity(name, INPUT_UNITS.get(name, "1"), ABOUT.get(name, ""), start, low, high)


def parameter_name(name: str, inputs: list[str]) -> str:
    """Its name beside the inputs: that of the air at which the wire was mounted is not the input's."""
    return f"{name}_at_start" if name in inputs else name


def _outputs(system: System) -> tuple[Quantity, ...]:
    shown, unit = system.load.reading
    moving = isinstance(system.load, AbstractMovingLoad)
    position = system.load.position_unit if isinstance(system.load, AbstractMovingLoad) else "-"
    motion = (
        Quantity("position", position, "of the load, positive when the wire contracts"),
        Quantity("velocity", f"{position}/s", "of the load"),
    )
    quantities = (
        Quantity("reading", unit, f"what the sensor shows of the {shown}"),
        *(motion if moving else ()),
        Quantity("temperature", "degC", "of the wire"),
        Quantity("stress", "Pa", "of the wire, tension"),
        Quantity("strain", "-", "of the wire"),
        Quantity("force", "N", "in the wire"),
        Quantity("martensite_fraction", "-", "share of martensite, 0 to 1"),
        Quantity("resistance", "ohm", "of the wire"),
        *((Quantity("unsolved", "-", "stages so far that did not converge: 0 in a run to rely on"),) if moving else ()),
    )
    return tuple(
        one for one in quantities if one.name not in system.load.inputs_required
    )  # of a coupon they are prescribed


def shown(system: System, state: State) -> dict[str, Scalar]:
    """The outputs of a state, SI."""
    wire = state.wire
    ohms = resistance_per_metre(system.wire, system.terms.resistance, wire.temperature, wire.martensite_fraction)
    return {
        "reading": state.reading,
        "position": state.motion.position,
        "velocity": state.motion.velocity,
        "temperature": wire.temperature,
        "stress": wire.stress,
        "strain": wire.strain,
        "force": wire.stress * cross_section(system.wire),
        "martensite_fraction": wire.martensite_fraction,
        "resistance": ohms * system.wire.wire_length,
        "unsolved": state.unsolved,
    }


def _moved(
    system: System, state: State, inputs: Values, seconds: Scalar, tried: Scalar, tolerance: Scalar
) -> tuple[State, Scalar]:
    """(the state after `seconds`, the step to try next). tried: 0 before the first one."""
    parts = jnp.maximum(jnp.ceil(seconds / LONGEST - 1e-9), 1.0)
    part = seconds / parts

    def one(at: tuple[State, Scalar, Scalar]) -> tuple[State, Scalar, Scalar]:
        following = jnp.where(at[1] > 0.0, at[1], part)
        new, following, _ = advance(system, at[0], inputs, part, following, tolerance)
        return new, following, at[2] + 1.0

    end, following, _ = lax.while_loop(lambda at: at[2] < parts, one, (state, tried, jnp.zeros_like(parts)))
    return end, following


def plant_block(system: System, name: str = "actuator", title: str = "", tolerance: float = DEFAULT_TOLERANCE) -> Block:
    """`system` with its values as start values. Raises ExportError for what no block can be.

    A moving load takes as many steps of order 3 within a step as `tolerance` asks for, so that any communication step gives the
    same run; a coupon goes to its new inputs along a straight line.
    """
    check_plant(system)
    channels, own = channels_of(system), cast(system)
    values, table = parameter_values(own), parameters(own)
    quantities = [
        Quantity(parameter_name(one.name, channels), one.unit, one.about, values[one.name], one.low, one.high)
        for one in table.values()
    ]
    of_block = {one: parameter_name(one, channels) for one in table}
    moving = isinstance(system.load, AbstractMovingLoad)
    if moving:
        about = "error of a step within a step, shares of 1 C and of 1 % strain"
        quantities.append(Quantity(TOLERANCE, "-", about, tolerance, 1e-9, 1e-2))

    def with_values(p: Values) -> System:
        return set_parameters(own, {one: p[as_named] for one, as_named in of_block.items()})

    def start(p: Values, u: Values) -> tuple[Any, Values]:
        plant = with_values(p)
        state = initial_state(plant, u)
        memory = {name: u[name] for name in sorted(u)} if not moving else {"next_step": jnp.zeros(())}
        return (state, memory), shown(plant, state)

    def step(p: Values, x: Any, u: Values, seconds: Scalar) -> tuple[Any, Values]:
        plant, (state, memory) = with_values(p), x
        if moving:
            state, following = _moved(plant, state, u, seconds, memory["next_step"], p[TOLERANCE])
            return (state, {"next_step": following}), shown(plant, state)
        substeps = CouponSubsteps(plant, seconds, COUPON_STEPS)
        end = substeps(substeps.start(state, memory), u)
        return (end.state, dict(end.memory)), shown(plant, end.state)

    inputs = tuple(_input(one, values) for one in channels)
    return Block(name, title or name, tuple(quantities), inputs, _outputs(system), start, step)
