"""A model from names: wire, load, drive, law, effects, values that differ from the presets', and a controller around it."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from typing import overload

from smajax.catalogue import check_together
from smajax.control_presets import CONTROLLERS
from smajax.controller.base import AbstractController
from smajax.effects.library import LIBRARY
from smajax.extended import extended
from smajax.load.base import AbstractMovingLoad
from smajax.loop import Loop
from smajax.measured.names import instead, own_first
from smajax.parameters import check_bounds, parameters, set_parameters
from smajax.presets import build
from smajax.system import System
from smajax.units import UnitError, parse_quantity
from smajax.wire.laws import under_law
from smajax.wire.order import check_order


def parameter_name(system: System, name: str) -> str:
    """The parameter that `name` means: its own name, or its place in the model (`wire.heat.convection_coefficient`).

    Raises ValueError with the nearest name, and all there are.
    """
    table = parameters(system)
    places = {".".join(map(str, entry.path)): own for own, entry in table.items()}
    if name in table or name in places:
        return name if name in table else places[name]
    raise ValueError(f"no parameter {name!r}{instead(name, own_first(table), 'this model has')}")


def _value(system: System, name: str, value: str | float) -> float:
    """The value in the program's own unit; text may carry a unit of its own, a plain number is SI, degC, rad."""
    unit = parameters(system)[name].unit
    if not isinstance(value, str):
        return float(value)
    try:
        return float(value)
    except ValueError:
        pass
    try:
        return parse_quantity(value, "1" if unit == "-" else unit)
    except UnitError as error:
        raise UnitError(f"{name}: {error}") from None


@overload
def compose(
    wire: str,
    load: str,
    drive: str,
    *,
    law: str = "",
    effects: Sequence[str] = (),
    values: Mapping[str, str | float] | None = None,
    controller: None = None,
    **others: object,
) -> System: ...


@overload
def compose(
    wire: str,
    load: str,
    drive: str,
    *,
    law: str = "",
    effects: Sequence[str] = (),
    values: Mapping[str, str | float] | None = None,
    controller: str | AbstractController,
    **others: object,
) -> Loop: ...


def compose(
    wire: str,
    load: str,
    drive: str,
    *,
    law: str = "",
    effects: Sequence[str] = (),
    values: Mapping[str, str | float] | None = None,
    controller: str | AbstractController | None = None,
    **others: object,
) -> System | Loop:
    """Presets by name, under a kinetics law, with effects and parameters of one's own: a system, or a loop around it.

    values: parameter -> a number (SI, temperatures in degC, angles in rad) or text with a unit (`"80 W/m^2/K"`); by its name
    or its place in the model. An effect is part of the model when one of its parameters is given (`latent_heat.enthalpy`).
    controller: the name of one in `CONTROLLERS` with its preset gains, which knows this system, or one of one's own; what
    comes back is then a `Loop`, for `simulate_loop_dataset`.
    Raises KeyError for a preset, law, effect or controller there is not, ValueError for a parameter there is not, a value out of its
    bounds, transformation temperatures in the wrong order, or presets that do not go together, UnitError for a unit of
    another kind, TypeError for a parameter that is not in `values`.
    """
    if others:
        name, value = next(iter(others.items()))
        raise TypeError(f"compose() has no argument {name!r}; a parameter goes into values={{{name!r}: {value!r}}}")
    system = build(wire, load, drive)
    check_together(system, load, drive)
    if law:
        system = dataclasses.replace(system, wire=under_law(system.wire, law))
    given = dict(values or {})
    named = {name.split(".")[0] for name in given} & LIBRARY.keys()
    system = extended(system, [*dict.fromkeys([*effects, *sorted(named)])])
    known = {parameter_name(system, name): value for name, value in given.items()}
    system = set_parameters(system, {name: _value(system, name, value) for name, value in known.items()})
    check_bounds(system)
    check_order(system)
    return system if controller is None else _around(system, controller, load)


def _around(system: System, controller: str | AbstractController, load: str) -> Loop:
    """The loop; a preset is made for the system, and takes the plant that its section is written for."""
    if isinstance(controller, AbstractController):
        return Loop(system, controller)
    if controller not in CONTROLLERS:
        raise KeyError(f"no controller {controller!r}{instead(controller, CONTROLLERS, 'there are')}")
    if not isinstance(system.load, AbstractMovingLoad) or system.load.reading[1] != "rad":
        raise ValueError(
            f"controllers by name have gains for the arm: give the load 'arm', not {load!r}, or a controller of your own."
        )
    preset = CONTROLLERS[controller]
    plant = preset.plant(system)
    return Loop(plant, preset.make(plant))
