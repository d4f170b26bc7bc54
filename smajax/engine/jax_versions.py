"""What a traced program is called in each release of JAX from 0.7 on: a release that calls something otherwise is a row here.

The translator reads a primitive's parameters by the names on the left, which are ours.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable, Mapping, Sequence
from functools import partial
from typing import Any

import jax

from smajax.engine.expansions import EXPANSIONS
from smajax.engine.text import Unsupported
from smajax.engine.values import name_of

Parameters = Mapping[str, Any]
Reading = str | Callable[[Parameters], Any]  # the name that JAX has for it, or how it follows from the others


def _counted(place: int) -> Callable[[Parameters], int]:
    """How many values are in one of the groups of a scan's arguments (constants, carry, series), since JAX 0.11."""
    return lambda params: len(params["ft_in"].unpack()[place])


# Primitive -> our name of a parameter -> how to read it, the newest release first; what cannot be read that way is
# tried the next.
TABLE: Mapping[str, Mapping[str, tuple[Reading, ...]]] = {
    "broadcast_in_dim": {"broadcast_dimensions": ("broadcast_dimensions",)},
    "bitcast_convert_type": {"new_dtype": ("new_dtype",)},
    "concatenate": {"axis": ("dimension",)},
    "cond": {"branches": ("branches",)},
    "convert_element_type": {"new_dtype": ("new_dtype",)},
    "dot_general": {"dimension_numbers": ("dimension_numbers",)},
    "gather": {
        "mode": ("mode",),
        "dimension_numbers": ("dimension_numbers",),
        "slice_sizes": ("slice_sizes",),
    },
    "integer_pow": {"power": ("y",)},
    "pad": {"padding": ("padding_config",)},
    "random_bits": {"bit_width": ("bit_width",), "shape": ("shape",)},
    "random_split": {"shape": ("shape",)},
    "reduce_precision": {"exponent_bits": ("exponent_bits",), "mantissa_bits": ("mantissa_bits",)},
    "reshape": {"dimensions": ("dimensions",)},
    "round": {"rounding_method": ("rounding_method",)},
    "scan": {
        "program": ("jaxpr",),
        "constants": (_counted(0), "num_consts"),
        "carry": (_counted(1), "num_carry"),
        "length": ("length",),
        "backward": ("reverse",),
    },
    "slice": {"starts": ("start_indices",), "strides": ("strides",)},
    "split": {"axis": ("axis",), "sizes": ("sizes",)},
    "stack": {"axis": ("axis",)},
    "while": {
        "test": ("cond_jaxpr",),
        "test_constants": ("cond_nconsts",),
        "body": ("body_jaxpr",),
        "body_constants": ("body_nconsts",),
    },
    # Primitives that stand for a program of their own.
    "jit": {"program": ("jaxpr",), "name": ("name",)},
    "pjit": {"program": ("jaxpr",), "name": ("name",)},
    "eval_jaxpr": {"program": ("call_jaxpr", "jaxpr")},
    "closed_call": {"program": ("call_jaxpr", "jaxpr")},
    "core_call": {"program": ("call_jaxpr", "jaxpr")},
    "remat2": {"program": ("jaxpr", "call_jaxpr")},
    "checkpoint": {"program": ("jaxpr", "call_jaxpr")},
    "custom_jvp_call": {"program": ("call_jaxpr", "fun_jaxpr", "jaxpr")},
    "custom_vjp_call": {"program": ("call_jaxpr", "fun_jaxpr", "jaxpr")},
    "custom_vjp_call_jaxpr": {"program": ("fun_jaxpr", "call_jaxpr")},
    **{f"reduce_{name}": {"axes": ("axes",)} for name in ("sum", "prod", "max", "min", "and", "or")},
}


# What says something to XLA, or to a derivative, and changes nothing.
SAME = ("optimization_barrier", "name", "random_wrap", "random_unwrap")
# What stands for a program of its own, once.
CALLS = {name for name, own in TABLE.items() if "program" in own and name != "scan"}
# Parameters of arithmetic that say where a result lies, or what its type already says.
OF_PLACE_OR_TYPE = {"sharding", "out_sharding", "weak_type", "new_dtype"}


def refuse_unread(equation: Any) -> None:
    """Arithmetic asked for in a way that the translator does not read, by a parameter of a later release. Raises Unsupported."""
    name = equation.primitive.name
    readings = TABLE.get(name, {}).values()
    for parameter, value in equation.params.items():
        if value is None or parameter in OF_PLACE_OR_TYPE:
            continue
        if not any(parameter in one for one in readings):
            raise Unsupported(f"the operation `{name}` with `{parameter}={value}`")


def parameters_of(equation: Any) -> dict[str, Any]:
    """An equation's parameters by our names; empty for a primitive that needs none. Raises Unsupported."""
    name, given = equation.primitive.name, equation.params
    result = {}
    for own, readings in TABLE.get(name, {}).items():
        for reading in readings:
            try:
                result[own] = given[reading] if isinstance(reading, str) else reading(given)
                break
            except (KeyError, AttributeError, TypeError, ValueError, IndexError):
                continue
        else:
            raise Unsupported(
                f"the operation `{name}` of this version of JAX: it has no parameter that says its {own.replace('_', ' ')}, but "
                f"{sorted(given)}"
            )
    return result


def opened(program: Any) -> tuple[Any, list[Any]]:
    """(equations, values of constants) of a program, which is one class since JAX 0.11 and was two before."""
    return getattr(program, "jaxpr", program), list(getattr(program, "consts", ()))


def kind_of(aval: Any) -> tuple[tuple[int, ...], str]:
    """(shape, kind of number) of a value; a random key is its two words. Raises Unsupported for keys of another kind."""
    shape, dtype = tuple(aval.shape), name_of(aval.dtype)
    if not dtype.startswith("key<"):
        return shape, dtype
    if dtype != "key<fry>":
        raise Unsupported(f"random keys of the kind {dtype}")
    return (*shape, 2), "uint32"


def expanded(equation: Any) -> Any | None:
    """The program that a primitive stands for: one of ours, or JAX's own (of its "hijax" primitives, since 0.11)."""
    primitive, params = equation.primitive, equation.params
    if primitive.name in EXPANSIONS:
        stands_for = EXPANSIONS[primitive.name](parameters_of(equation))
    elif (lower := vars(primitive).get("to_lojax")) is not None:
        stands_for = partial(lower, **params)
    else:
        return None
    kinds = tuple((*kind_of(one.aval), bool(getattr(one.aval, "weak_type", False))) for one in equation.invars)
    try:
        key = (primitive, tuple(sorted(params.items())), kinds)
        if key not in _traced:
            _traced[key] = _traced_for(stands_for, primitive.name, kinds)
        return _traced[key]
    except TypeError:  # parameters that cannot be looked up by
        return _traced_for(stands_for, primitive.name, kinds)


# Programs, by primitive, parameters and kinds: few, and each asked for in every program.
_traced: dict[Hashable, Any] = {}


def _traced_for(stands_for: Callable[..., Any], name: str, kinds: Sequence[tuple[tuple[int, ...], str, bool]]) -> Any:
    try:
        return jax.make_jaxpr(stands_for)(
            *(jax.ShapeDtypeStruct(shape, dtype, weak_type=weak) for shape, dtype, weak in kinds)
        )
    except Exception as error:  # of JAX's own: it has a lowering there that is not meant for this primitive
        raise Unsupported(f"the operation `{name}`") from error
