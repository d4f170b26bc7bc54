"""Named physical parameters: unit, bounds and meaning written once beside the field, read by every later stage."""

from __future__ import annotations

import dataclasses
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, TypeVar

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float

from smajax.core.names import of_many
from smajax.core.units import UnitError, parse_quantity

Module = TypeVar("Module", bound=eqx.Module)
Tree = TypeVar("Tree")
# Such as +20%, of text that `compose` takes: of a number without a unit it would be read as 0.2.
_CHANGE = re.compile(r"\s*[+\-\u2212\u00b1]\s*(?:\d+\.?\d*|\.\d+)\s*%\s*")


def _as_float_array(value: Any) -> Any:
    # Arrays, not Python floats: a float would be static under jit and every new value would compile again.
    return value if isinstance(value, jax.core.Tracer) else jnp.asarray(value, dtype=float)


def by_numpy(values: Any) -> Any:
    """An array of JAX whose values are known as numpy's, anything else as it is: of JAX each index into another shape is a program to compile."""
    if not isinstance(values, jax.Array) or isinstance(values, jax.core.Tracer) or values.committed:
        return values  # what lies on a device by request stays there
    return np.asarray(values)


def all_by_numpy(values: Tree) -> Tree:
    """A model, or inputs, whose known values are numpy's: what of its equations is plain arithmetic compiles nothing for a number or two."""
    return jax.tree.map(by_numpy, values)


def parameter(
    unit: str, low: float, high: float, about: str, of_load: str = "", limits_command: bool = False, **kwargs: Any
) -> Any:
    """A dataclass field for one physical parameter.

    `unit` is SI with temperatures in C; `low` and `high` are the widest values that make physical sense (the bounds
    within which the simulator promises finite results); `about` is one line for tables and reports. `of_load`: what of the load it is measured
    as, `reading`, `reading rate` or `force`; its unit in a system is then that of the system's load (`System.units_of_load`), and `unit`
    that of a load whose position is a length. `limits_command`: of a controller, that it never asks for a larger command than this.
    """
    metadata = {"unit": unit, "low": low, "high": high, "about": about, "of_load": of_load, "limits": limits_command}
    return eqx.field(converter=_as_float_array, metadata=metadata, **kwargs)


@dataclass(frozen=True)
class Parameter:
    """Where a parameter lives in a model, and what it is."""

    name: str
    unit: str
    low: float
    high: float
    about: str
    path: tuple[str | int, ...]
    also: str = ""  # the unit of its field where the load has another: files of before give the same number in it
    limits_command: bool = False  # of a controller, which never asks for a larger command


def parameters(model: eqx.Module) -> dict[str, Parameter]:
    """Every parameter of `model` by name. Effects (anything with an `effect_name`) prefix theirs: `latent_heat.enthalpy`.

    Their units are those of the model's load (rad and N m on an arm), where it has one.
    """
    result: dict[str, Parameter] = {}
    of_load: Mapping[str, str] = getattr(model, "units_of_load", {})

    def walk(node: Any, path: tuple[str | int, ...], prefix: str) -> None:
        if isinstance(node, (tuple, list)):
            for index, child in enumerate(node):
                walk(child, (*path, index), prefix)
        if not isinstance(node, eqx.Module):
            return
        prefix = f"{node.effect_name}." if hasattr(node, "effect_name") else prefix
        for entry in dataclasses.fields(node):
            here = (*path, entry.name)
            if "unit" in entry.metadata:
                name = prefix + entry.name
                if name in result:
                    raise ValueError(
                        f"Two parameters are named `{name}`, at {result[name].path} and at {here}. Rename one: "
                        "every stage after this one knows parameters by name."
                    )
                meta = entry.metadata
                unit = of_load.get(meta["of_load"], meta["unit"])
                also = meta["unit"] if unit != meta["unit"] else ""
                limits = meta.get("limits", False)
                result[name] = Parameter(name, unit, meta["low"], meta["high"], meta["about"], here, also, limits)
            else:
                walk(getattr(node, entry.name), here, prefix)

    walk(model, (), "")
    return result


def value_at(model: Any, path: tuple[str | int, ...]) -> Any:
    """The leaf of a model at `Parameter.path`."""
    for key in path:
        model = model[key] if isinstance(key, int) else getattr(model, key)
    return model


def _select(model: eqx.Module, names: Sequence[str]) -> list[Parameter]:
    table = parameters(model)
    unknown = [name for name in names if name not in table]
    if unknown:
        matches = of_many(unknown[0], table, "`smajax.parameter_values(model)` lists all of this model")
        raise ValueError(f"No parameter `{unknown[0]}`{matches}.")
    return [table[name] for name in names]


def get_parameters(model: eqx.Module, names: Sequence[str]) -> Float[Array, " names"]:
    """The values of `names`, in that order, SI."""
    values = [value_at(model, entry.path) for entry in _select(model, names)]
    if not values:
        return jnp.zeros(0)
    if any(isinstance(one, jax.core.Tracer) for one in values):
        return jnp.stack([jnp.asarray(one, dtype=float) for one in values])
    # By numpy: of JAX each operation is a program of its own for each number of names, which takes longer to compile than all else here.
    return jnp.asarray(np.stack([np.asarray(one, dtype=float) for one in values]), dtype=float)


def parameter_values(model: eqx.Module) -> dict[str, float]:
    """Every parameter's value by name, SI; also of a model of known values inside a function that JAX traces."""
    names = list(parameters(model))
    with jax.ensure_compile_time_eval():
        values = get_parameters(model, names)
    return dict(zip(names, np.asarray(values, dtype=float).tolist(), strict=True))


def quantity(entry: Parameter, value: Any, name: str = "") -> Any:
    """`value` of a parameter, in its own unit: text is read, with a unit of its own or none, and everything else is as it is.

    name: what messages call the parameter. Raises UnitError for text that is no value, a unit of another kind, and True or False.
    """
    name = name or entry.name
    unit = "1" if entry.unit == "-" else entry.unit
    if isinstance(value, bool | np.bool_):
        raise UnitError(f"{name}: got {value}, expected a number{'' if unit == '1' else f' in {unit}'}")
    if not isinstance(value, str):
        return value
    try:
        return float(value)
    except ValueError:
        pass
    if _CHANGE.fullmatch(value):
        raise UnitError(
            f"{name}: got {value!r}, a change of what it is, expected the value; `smajax.compose(..., values=...)` takes changes"
        )
    try:
        return parse_quantity(value, unit, also=entry.also)
    except UnitError as error:
        raise UnitError(f"{name}: {error}") from None


def set_parameters(model: Module, values: Mapping[str, Any]) -> Module:
    """`model` with the named values put in; everything else is shared.

    A number is in the parameter's own unit (SI, degC, rad); text may carry another (`"50 g"`). Values may be traced, so their bounds are
    not looked at here: every run does so where it knows them, and `check_bounds` says it before. Raises ValueError when a name is not a
    parameter of the model, UnitError (a ValueError) for text that is no value, a unit of another kind, and True or False.
    """
    entries = _select(model, list(values))
    if not entries:
        return model
    where = lambda m: [value_at(m, entry.path) for entry in entries]  # noqa: E731
    return eqx.tree_at(where, model, [_as_float_array(quantity(entry, values[entry.name])) for entry in entries])


def set_vector(model: Module, names: Sequence[str], vector: Float[Array, " names"]) -> Module:
    """`set_parameters` from a vector in the order of `names`: the form that an optimiser differentiates."""
    vector = by_numpy(vector)
    return set_parameters(model, {name: vector[index] for index, name in enumerate(names)})


def check_bounds(model: eqx.Module) -> None:
    """ValueError that names every parameter outside its bounds, with its value and unit; of a system, and two in the wrong order.

    These are transformation temperatures, such as an `austenite_start` that is not below `austenite_finish`, and end stops. Values under `jit`, `vmap` or `grad` are not known yet and are passed over.
    """
    wrong = []
    for entry in parameters(model).values():
        value = value_at(model, entry.path)
        if isinstance(value, jax.core.Tracer):
            continue
        result = np.asarray(value)
        inside = (result >= entry.low) & (result <= entry.high)  # nan is not
        if not inside.all():
            first = result[~inside].ravel()[0]
            wrong.append(f"`{entry.name}` = {first:g} {entry.unit} (from {entry.low:g} to {entry.high:g})")
    if wrong:
        raise ValueError(f"outside of the bounds: {'; '.join(wrong)}.")
    # What a model asks of several of its values together, it says itself.
    check_together: Callable[[], None] | None = getattr(model, "check_order", None)
    if check_together is not None:
        check_together()


def inside_bounds(model: eqx.Module) -> Bool[Array, ""]:
    """Whether every parameter lies within its bounds; also of values that are not known yet, lane by lane of a batch."""
    inside = jnp.asarray(True)
    for entry in parameters(model).values():
        value = value_at(model, entry.path)
        inside = inside & jnp.all((value >= entry.low) & (value <= entry.high))  # nan is not
    return inside
