"""A model from names: wire, load, drive, law, effects, values that differ from the presets', and a controller around it."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from contextlib import suppress
from typing import overload

from smajax.control.controllers.base import AbstractController
from smajax.control.loop_around import loop_around
from smajax.control.loop_dataset import Loop
from smajax.control.mismatch import MISMATCHES, mismatches_of, ratio_of
from smajax.control.presets import FILTERS
from smajax.core.names import of_many
from smajax.core.parameters import check_bounds, parameter_values, parameters, quantity, set_parameters
from smajax.core.wording import and_listed
from smajax.data.model_catalogue import check_together
from smajax.model.effects.library import LIBRARY
from smajax.model.extended import extended, with_effects
from smajax.model.presets import build
from smajax.model.system import System
from smajax.model.wire.laws import under_law

PARAMETERS = "`smajax presets WIRE LOAD DRIVE` lists those of a model, `smajax effects` those of effects"

OF_FILTER = {
    "reading_noise": "A filter takes the noise of the loop's readings for it: --noise of a command, `noise` of `loop_around`."
}
IN_PYTHON = (
    "It is set in Python: `loop_around(..., estimator=set_parameters(FILTERS[NAME](system), {PARAMETER: VALUE}))`."
)


def parameter_name(system: System, name: str) -> str:
    """The parameter that `name` means: its own name, its place in the model (`wire.heat.convection_coefficient`), or short.

    Short names are those of `mismatches_of`. Raises ValueError with the nearest names, and what lists all.
    """
    table = parameters(system)
    places = {".".join(map(str, entry.path)): own for own, entry in table.items()}
    short = {short: own for short, own in mismatches_of(system).items() if own in table}
    meant = {**short, **places, **{own: own for own in table}}
    if name in meant:
        return meant[name]
    which = f"{name!r} ({MISMATCHES[name]})" if name in MISMATCHES else f"{name!r}"
    if filters := _filters_with(system, name):
        raise ValueError(f"no parameter {which} of the model: it is one of {filters}. {OF_FILTER.get(name, IN_PYTHON)}")
    raise ValueError(f"no parameter {which}{of_many(name, [*table, *short], PARAMETERS)}")


def _filters_with(system: System, name: str) -> str:
    """The filters that have a parameter of this name; "" of none, and of a load that no filter goes with."""
    found = []
    for own, make in FILTERS.items():
        with suppress(ValueError):
            found += [f"`{own}`"] if name in parameters(make(system)) else []
    return f"the filter{'s' * (len(found) > 1)} {and_listed(found)}" if found else ""


def _value(before: System, system: System, name: str, own: str, value: str | float) -> float:
    """The value in the program's own unit; text may carry a unit of its own, a plain number is SI, degC, rad.

    Text such as `+20%` is a change of the value that `before` has.
    """
    entry = parameters(system)[own]
    unit = entry.unit
    if not isinstance(value, str):
        return float(quantity(entry, value, name))
    ratio = ratio_of(name, value, plain=unit == "-" and name not in MISMATCHES)
    if ratio is not None:
        if unit == "degC" and own not in MISMATCHES.values():
            # A share of what 0 degC makes small or large; of the air it is what sweeps vary.
            raise ValueError(
                f"{name}={value.strip()} is a share of degrees Celsius, which says little: expected the temperature, such as "
                f"'{parameter_values(before).get(own, 0.0):g} degC'."
            )
        return ratio * _changed(before, own, f"{name}={value.strip()}", unit)
    try:
        plain = float(value)
    except ValueError:
        pass
    else:
        if value.strip().startswith("+"):
            raise ValueError(
                f"{name}={value.strip()} may be a change without its %, or a value: write '{value.strip()}%' or '{plain:g}'."
            )
        return plain
    return float(quantity(entry, value, name))


def _changed(before: System, own: str, which: str, unit: str) -> float:
    """The value that a change is a share of. ValueError where there is none, or zero."""
    value = parameter_values(before).get(own)
    effect, _, coefficient = own.partition(".")
    started = LIBRARY[effect].candidate.initial_guess.get(coefficient) if effect in LIBRARY else None
    like = "a value" + (f" in {unit}" if unit != "-" else "") + (f", such as '{started:g} {unit}'" if started else "")
    like = like.replace(" -'", "'")  # of a number without unit
    if value is None:
        raise ValueError(f"{which} is a change of what is there, and the effect {effect} is not: give {like}.")
    if value == 0.0:
        raise ValueError(f"{which} is a change of what is there, which is 0, as any share of it: give {like}.")
    return value


def with_values(system: System, values: Mapping[str, str | float]) -> System:
    """`system` with parameters put in, as `compose` takes them; what is a change (`+20%`) is one of `system`'s own value.

    An effect of which a parameter is given is added. Raises as `compose` does.
    """
    known = {one.effect_name for one in system.effects}
    named = {name.split(".")[0] for name in values} & LIBRARY.keys()
    wider = with_effects(system, sorted(named - known))
    own: dict[str, str] = {}
    for name in values:
        meant = parameter_name(wider, name)
        if meant in own:
            raise ValueError(f"{name!r} and {own[meant]!r} are the same parameter: give it once.")
        own[meant] = name
    result = set_parameters(
        wider, {meant: _value(system, wider, name, meant, values[name]) for meant, name in own.items()}
    )
    check_bounds(result)
    return result


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

    law: of `LAWS` (`smajax.model.wire.laws`): the kinetics, or `integrated`, under which every cycle closes; "" for the wire's own.
    values: parameter -> a number (SI, temperatures in degC, angles in rad), text with a unit (`"80 W/m^2/K"`), or a change of
    the preset's value (`"+20%"`, `"-50%"`); by its name, its place in the model, or a name of `MISMATCHES`. An effect is part
    of the model when one of its parameters is given (`latent_heat.enthalpy`).
    controller: the name of one in `CONTROLLERS` with its preset gains, scaled to the load, which knows this system, or one of
    one's own; what comes back is then a `Loop`, for `simulate_loop_dataset`. `loop_around` takes gains, a filter and noise too.
    Raises KeyError for a preset, law, effect or controller there is not, ValueError for a parameter there is not, one given twice, a
    change of nothing, a value out of its bounds, transformation temperatures in the wrong order, or presets that do not go
    together, UnitError for a unit of another kind, TypeError for a parameter that is not in `values`.
    """
    if others:
        name, value = next(iter(others.items()))
        raise TypeError(f"compose() has no argument {name!r}; a parameter goes into values={{{name!r}: {value!r}}}")
    if (
        isinstance(effects, str)
        or not isinstance(effects, Sequence)
        or not all(isinstance(one, str) for one in effects)
    ):
        raise TypeError(
            f"effects={effects!r}; expected their names in a list, such as effects=['latent_heat']. One of your own goes into "
            "`dataclasses.replace(system, effects=(YourEffect(...),))`."
        )
    system = build(wire, load, drive)
    check_together(system, load, drive)
    if law:
        system = dataclasses.replace(system, wire=under_law(system.wire, law))
    system = with_values(extended(system, [*dict.fromkeys(effects)]), values or {})
    return system if controller is None else loop_around(system, controller)
