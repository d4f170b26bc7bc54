r"""Gains of one plant from those of another, by similarity: each gain is a number times scales that its unit names.

The gains of the presets were searched for the preset arm. With the scales of a plant

    position   stroke of the recoverable strain, up to the upper stop                         rad, m
    command    what holds the wire at the end of its transformation at full stroke,
               A_f + max(sigma)/C_A above the air; at most 1/1.33 of the drive's limit        V, A, W
    time       m c_p / (h_c A_c), in which the wire cools                                     s
    force      largest resistance of the load at rest along the stroke; where it follows an
               input that nobody knows before, that of a wire under the arm's stress          N m, N
    stress     of the wire there                                                              Pa
    warmth     of the wire there, over the air                                                K
    inertia    of the load                                                                    kg m^2, kg
    damping    of the load, d(resistance)/dv there                                            N m s, N s/m

a gain of the unit V/(rad s) is multiplied by (command/arm's) / ((position/arm's) (time/arm's)), and so for every unit; its
box as well; a preset names the scales of a gain whose unit does not tell them. So a PID controller asks the same share of the command for the same share of the stroke. A second-order load
that swings has a time of its own, which the scales do not know: these gains are a place to begin from, and `tune` searches
its box around them. 1.33 is 10 V, the largest command of the arm's presets, over the voltage that holds the arm.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from functools import lru_cache
from typing import NamedTuple, TypeVar

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from smajax.control.load_equation import equation_of, force_per_stress, moving_load, stroke_of
from smajax.core.parameters import get_parameters, parameters, set_parameters
from smajax.model.load.arm import Arm
from smajax.model.rigs import arm
from smajax.model.system import System, heating_power
from smajax.model.types import Scalar
from smajax.model.wire.heat import convection, mass_per_metre
from smajax.model.wire.resistance import resistance_per_metre

HEADROOM = 1.33  # largest command over the one that holds, of the arm's presets
ARM_LIMIT = 10.0  # V, the largest command of the arm's presets
NO_LIMIT = (
    999.0  # V at the wire; an amplifier's limit from here on is the presets' 1000 V, which says that nobody knows it
)
POINTS = 65  # along the stroke
Module = TypeVar("Module", bound=eqx.Module)


class Scales(NamedTuple):
    """Of a plant, as the head of this file lists them."""

    position: Scalar
    command: Scalar
    time: Scalar
    force: Scalar
    stress: Scalar
    warmth: Scalar
    inertia: Scalar
    damping: Scalar


# Symbol of a unit -> the scale that it stands for.
_SYMBOLS = {
    "V": "command",
    "rad": "position",
    "m": "position",
    "s": "time",
    "Pa": "stress",
    "degC": "warmth",
    "K": "warmth",
}
_FORCES = ("N m", "N")


def scales_of(system: System) -> Scales:
    """The scales of a plant that is led by a command. Raises ValueError for a coupon or a drive that takes none."""
    load, wire, equation = moving_load(system), system.wire, equation_of(system)
    stroke = stroke_of(system)
    if load.inputs_required:
        # Its resistance follows an input: a wire under the stress of the arm's stands for it.
        stress = arm_scales().stress
        force, damping = stress * force_per_stress(system), jnp.zeros_like(stress)
    else:
        way = load.start() + stroke * jnp.linspace(0.0, 1.0, POINTS)
        force = jnp.max(jnp.abs(jax.vmap(equation.resistance)(way, jnp.zeros_like(way))))
        stress = force / force_per_stress(system)
        damping = jax.grad(equation.resistance, 1)(way[-1], jnp.zeros_like(stroke))
    inertia = jnp.zeros_like(stress) if load.inputs_required else equation.inertia()
    law, air = wire.kinetics, wire.heat.ambient_temperature
    hot = law.austenite_finish + stress / law.stress_slope_austenite
    ohms = resistance_per_metre(wire, system.terms.resistance, hot, jnp.zeros_like(hot))
    at_one = heating_power(system, ohms, system.drive.from_command(jnp.ones_like(hot)))
    needed = convection(wire, hot, air) / at_one
    holding = needed if system.drive.command[1] == "W" else jnp.sqrt(needed)
    per_kelvin = convection(wire, air + 1.0, air)
    time = mass_per_metre(wire) * wire.heat.specific_heat / per_kelvin
    command = jnp.minimum(holding, system.drive.largest_command() / HEADROOM)
    return Scales(stroke, command, time, force, stress, hot - air, inertia, damping)


def arm_scales() -> Scales:
    """Of the arm that the presets' gains were searched for."""
    return _arm_scales(jnp.zeros(()).dtype)


@lru_cache(maxsize=2)
def _arm_scales(precision: np.dtype) -> Scales:
    with jax.ensure_compile_time_eval():
        return scales_of(arm())


def exponents(unit: str) -> dict[str, int] | None:
    """Scale -> its power in a unit such as `V/(rad s)`; None of a unit that has another part."""
    result: dict[str, int] = {}
    for side, part in zip((1, -1), unit.partition("/")[::2], strict=True):
        text = part.strip("() ")
        for force in _FORCES:
            if re.search(rf"(^|\s){force}($|\s)", text):
                result["force"] = result.get("force", 0) + side
                text = re.sub(rf"(^|\s){force}($|\s)", " ", text)
                break
        for token in text.split():
            name, _, power = token.partition("^")
            if name in ("1", "-"):
                continue
            if name not in _SYMBOLS or (power and not power.isdigit()):
                return None
            scale = _SYMBOLS[name]
            result[scale] = result.get(scale, 0) + side * int(power or 1)
    return result


def unit_on(unit: str, system: System) -> str:
    """A gain's unit on a plant: `V/rad` of the arm is `A/m` where the position is a length and the drive a current source."""
    unit = re.sub(r"\bV\b", system.drive.command[1], unit)
    if moving_load(system).reading[1] == "rad":
        return unit
    return re.sub(r"\brad\b", "m", re.sub(r"\bN m\b", "N", unit))


def factors_for(
    system: System, controller: eqx.Module, special: Mapping[str, Sequence[Mapping[str, int]]]
) -> dict[str, Scalar]:
    """What each gain of an arm's controller is multiplied by on this plant. A unit that is not known keeps its number.

    special: gain -> scale -> its power, in the place of what its unit says; of several the least product.
    """
    here, there = scales_of(system), arm_scales()
    ratios = {name: getattr(here, name) / getattr(there, name) for name in Scales._fields}
    result: dict[str, Scalar] = {}
    for name, entry in parameters(controller).items():
        several = special[name] if name in special else [exponents(entry.unit) or {}]
        products = [_product(ratios, powers) for powers in several]
        result[name] = jnp.min(jnp.stack(products))
    return result


def _product(ratios: Mapping[str, Scalar], powers: Mapping[str, int]) -> Scalar:
    factor = jnp.ones(())
    for scale, power in powers.items():
        factor = factor * ratios[scale] ** power
    return factor


def is_arm(system: System) -> bool:
    """Whether gains of the arm's presets hold as they are."""
    return isinstance(system.load, Arm)


def _limit(system: System) -> tuple[Scalar, Scalar]:
    """(largest command of an arm's amplifier or supply, V; whether it is one: the presets' says that nobody knows it)."""
    limit = jnp.asarray(system.drive.largest_command())
    at_wire = get_parameters(system, ["amplifier_limit"])[0] if "amplifier_limit" in parameters(system) else limit
    return limit, at_wire < NO_LIMIT


def limited_as(system: System) -> Scalar | None:
    """The largest command of an arm's amplifier or supply, V, where it is known; None where the limits of the presets hold."""
    limit, known = _limit(system)
    return limit if known else None


def share_of_limit(name: str, limit: Scalar) -> Scalar:
    """Factor of a voltage of an arm's controller, or of its bounds, where the largest command is `limit` (V) and not `ARM_LIMIT`.

    A low level of a switch is one at which the wire cools, whatever the amplifier: it only goes down.
    """
    share = jnp.asarray(limit) / ARM_LIMIT
    return jnp.minimum(share, 1.0) if name.rpartition(".")[2].startswith("low") else share


def on_amplifier(controller: Module, system: System, own: frozenset[str]) -> Module:
    """The controller of an arm whose amplifier or supply has a limit: its largest command is that, other voltages keep their share of it.

    What it knows of its plant (`own`) stays.
    """
    limit, known = _limit(system)
    table = parameters(controller)
    names = [one for one in table if table[one].unit == "V" and not {one, str(table[one].path[0])} & own]
    if not names:
        return controller
    values = dict(zip(names, get_parameters(controller, names), strict=True))
    put = {
        name: limit if table[name].limits_command else one * share_of_limit(name, limit) for name, one in values.items()
    }
    return set_parameters(controller, {name: jnp.where(known, put[name], one) for name, one in values.items()})


def scaled(controller: Module, factors: Mapping[str, Scalar], own: frozenset[str]) -> Module:
    """The controller with its gains times their factors; what it knows of its plant (`own`) stays."""
    table = parameters(controller)
    names = [name for name, entry in table.items() if str(entry.path[0]) not in own and name not in own]
    values = get_parameters(controller, names)
    return set_parameters(controller, {name: values[k] * factors[name] for k, name in enumerate(names)})


def seconds_for(system: System) -> float:
    """Length of a closed loop: 10 s of the arm, and as many times longer as another wire cools more slowly, to a second."""
    if is_arm(system):
        return 10.0
    return float(max(10.0, round(10.0 * float(scales_of(system).time / arm_scales().time))))
