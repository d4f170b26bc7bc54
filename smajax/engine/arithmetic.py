"""JAX's elementwise primitives on lanes. Numbers that are none stay so, as everywhere in JAX."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from smajax.engine.composed import composed
from smajax.engine.text import Lane, Text, Unsupported, scalar_type

Operation = Callable[..., Lane]

# Multiply-and-add in one rounding, x/d as x (1/d), no care for the sign of zero: nothing that takes anything for a number.
FLAGS = "contract arcp nsz "
NORMAL = 0x108  # LLVM's class of numbers that are neither zero, tiny, infinite nor none


def _floating(dtype: str) -> bool:
    return dtype.startswith("float")


def _signed(dtype: str) -> bool:
    return not dtype.startswith("uint")


def _binary(floating: str | None, whole: str | None) -> Operation:
    def put(text: Text, out: str, left: Lane, right: Lane, **_: Any) -> Lane:
        name = floating if _floating(left.dtype) else whole
        if name is None:
            raise Unsupported(f"an operation on {left.dtype}")
        flags = FLAGS if _floating(left.dtype) else ""
        return text.lane(f"{name} {flags}{text.vector(left.dtype)} {left.name}, {right.name}", out)

    return put


def _extreme(larger: bool) -> Operation:
    sign = "gt" if larger else "lt"

    def put(text: Text, out: str, left: Lane, right: Lane, **_: Any) -> Lane:
        kind = text.vector(left.dtype)
        if not _floating(left.dtype):
            how = "or" if larger else "and"
            if left.dtype == "bool":
                return text.lane(f"{how} {kind} {left.name}, {right.name}", out)
            order = ("s" if _signed(left.dtype) else "u") + sign
            first = text.assign(f"icmp {order} {kind} {left.name}, {right.name}", "bool")
            return _chosen(text, first, left, right)
        if right.constant:
            left, right = right, left
        if left.number is not None and math.isnan(left.number):
            return left
        # The second where one is no number: enough where the first is a constant.
        result = _chosen(text, text.assign(f"fcmp o{sign} {kind} {left.name}, {right.name}", "bool"), left, right)
        if left.constant:
            return result
        return _chosen(text, text.assign(f"fcmp uno {kind} {left.name}, {left.name}", "bool"), left, result)

    return put


def _chosen(text: Text, mask: str, yes: Lane, no: Lane) -> Lane:
    kind = text.vector(yes.dtype)
    result = text.lane(f"select {text.vector('bool')} {mask}, {kind} {yes.name}, {kind} {no.name}", yes.dtype)
    if yes.number is not None and no.number is not None:
        text.either[result.name] = mask, yes.number, no.number
    return result


def _compare(floating: str, whole: str) -> Operation:
    def put(text: Text, out: str, left: Lane, right: Lane, **_: Any) -> Lane:
        kind = text.vector(left.dtype)
        if _floating(left.dtype):
            return text.lane(f"fcmp {floating} {kind} {left.name}, {right.name}", out)
        signed = "s" if _signed(left.dtype) and left.dtype != "bool" else "u"
        name = whole if whole in ("eq", "ne") else signed + whole
        return text.lane(f"icmp {name} {kind} {left.name}, {right.name}", out)

    return put


def _function(name: str) -> Operation:
    def put(text: Text, out: str, *given: Lane, **_: Any) -> Lane:
        return text.call(f"llvm.{name}", out, *(one.name for one in given))

    return put


def _negative(text: Text, out: str, one: Lane, **_: Any) -> Lane:
    kind = text.vector(out)
    return text.lane(f"fneg {kind} {one.name}" if _floating(out) else f"sub {kind} zeroinitializer, {one.name}", out)


def _absolute(text: Text, out: str, one: Lane, **_: Any) -> Lane:
    if _floating(out):
        return text.call("llvm.fabs", out, one.name)
    return _extreme(True)(text, out, one, _negative(text, out, one))


def _sign(text: Text, out: str, one: Lane, **_: Any) -> Lane:
    kind, zero = text.vector(out), text.constant(0, out)
    if not _signed(out):
        some = text.assign(f"icmp ne {kind} {one.name}, {zero.name}", "bool")
        return _chosen(text, some, text.constant(1, out), zero)
    above, below = ("fcmp ogt", "fcmp olt") if _floating(out) else ("icmp sgt", "icmp slt")
    positive = text.assign(f"{above} {kind} {one.name}, {zero.name}", "bool")
    negative = text.assign(f"{below} {kind} {one.name}, {zero.name}", "bool")
    result = _chosen(text, positive, text.constant(1, out), one)
    return _chosen(text, negative, text.constant(-1, out), result)


def _finite(text: Text, out: str, one: Lane, **_: Any) -> Lane:
    size = text.call("llvm.fabs", one.dtype, one.name)
    most = text.constant(np.inf, one.dtype)
    return text.lane(f"fcmp olt {text.vector(one.dtype)} {size.name}, {most.name}", out)


def _not(text: Text, out: str, one: Lane, **_: Any) -> Lane:
    return text.lane(f"xor {text.vector(out)} {one.name}, {text.constant(-1 if out != 'bool' else 1, out).name}", out)


def _times(text: Text, left: Lane, right: Lane) -> Lane:
    return _binary("fmul", "mul")(text, left.dtype, left, right)


def reciprocal(text: Text, one: Lane) -> Lane:
    """1/x. Where the divider is slow for vectors, by an estimate and Newton's steps, to an ulp."""
    dtype = one.dtype
    parts = {"float64": ("pd", 8, 2), "float32": ("ps", 16, 1)}[dtype]
    if not text.estimates or one.constant or text.lanes != parts[1]:
        return _binary("fdiv", None)(text, dtype, text.constant(1, dtype), one)
    rough = _estimated(text, one, parts[0])
    result, unit = rough, text.constant(1, dtype)
    for _ in range(parts[2]):
        missed = _binary("fsub", None)(text, dtype, unit, _times(text, one, result))
        result = _binary("fadd", None)(text, dtype, result, _times(text, result, missed))
    name, mask = f"llvm.is.fpclass.v{text.lanes}{text.suffix(dtype)}", text.vector("bool")
    text.declare(name, mask, [text.vector(dtype), "i32"])
    ordinary = text.assign(f"call {mask} @{name}({text.vector(dtype)} {rough.name}, i32 {NORMAL})", "bool")
    return _chosen(text, ordinary, result, rough)  # of infinity the estimate is exact, and so it is of zero


def _estimated(text: Text, one: Lane, kind: str) -> Lane:
    """1/x to 14 bits."""
    of, mask = text.vector(one.dtype), f"i{text.lanes}"
    name = text.declare(f"llvm.x86.avx512.rcp14.{kind}.512", of, [of, of, mask])
    return text.lane(f"call {of} @{name}({of} {one.name}, {of} zeroinitializer, {mask} -1)", one.dtype)


def _grown_less_one(text: Text, out: str, one: Lane, **_: Any) -> Lane:
    """exp(x) - 1 = 2 sinh(x/2) exp(x/2): exact where x is small; -1 where the product would be nothing times infinity."""
    half = _times(text, one, text.constant(0.5, out))
    wave, grown = text.call("llvm.sinh", out, half.name), text.call("llvm.exp", out, half.name)
    result = _times(text, _times(text, text.constant(2.0, out), wave), grown)
    least = text.constant(-80.0, out)
    low = text.assign(f"fcmp olt {text.vector(out)} {one.name}, {least.name}", "bool")
    return _chosen(text, low, text.constant(-1.0, out), result)


def _log_beside_one(text: Text, out: str, one: Lane, **_: Any) -> Lane:
    """log(1 + x) = log(u) x/(u - 1) with the rounded u = 1 + x, whose own error cancels (Kahan)."""
    kind, unit = text.vector(out), text.constant(1.0, out)
    # Without the freedom to put another order of sums in its place.
    u = text.lane(f"fadd {kind} {unit.name}, {one.name}", out)
    above = text.lane(f"fsub {kind} {u.name}, {unit.name}", out)
    logarithm = text.call("llvm.log", out, u.name, flags="")
    result = text.lane(f"fmul {kind} {logarithm.name}, {exact_quotient(text, out, one, above).name}", out)
    small = text.assign(f"fcmp oeq {kind} {above.name}, {text.constant(0.0, out).name}", "bool")
    endless = text.assign(f"fcmp oeq {kind} {u.name}, {text.constant(np.inf, out).name}", "bool")
    least = text.assign(f"fcmp oeq {kind} {u.name}, {text.constant(0.0, out).name}", "bool")
    result = _chosen(text, least, text.constant(-np.inf, out), result)
    return _chosen(text, small, one, _chosen(text, endless, u, result))


def _shifted(how: str) -> Operation:
    """JAX's shifts: by as many bits as there are, or more, nothing is left (of a signed shift to the right, the sign)."""

    def put(text: Text, out: str, one: Lane, by: Lane, **_: Any) -> Lane:
        kind, bits = text.vector(out), 8 * np.dtype(out).itemsize
        most = text.constant(bits - 1, out)
        inside = text.assign(f"icmp ule {kind} {by.name}, {most.name}", "bool")
        near = _chosen(text, inside, by, most)
        result = text.lane(f"{how} {kind} {one.name}, {near.name}", out)
        return result if how == "ashr" else _chosen(text, inside, result, text.constant(0, out))

    return put


def _same_bits(text: Text, out: str, one: Lane, **_: Any) -> Lane:
    if np.dtype(out).itemsize != np.dtype(one.dtype).itemsize:
        raise Unsupported("bits of a number taken for those of one of another size")
    if scalar_type(out) == scalar_type(one.dtype):
        return Lane(one.name, out)
    return text.lane(f"bitcast {text.vector(one.dtype)} {one.name} to {text.vector(out)}", out)


def _rounded(text: Text, out: str, one: Lane, *, rounding_method: Any, **_: Any) -> Lane:
    even = int(rounding_method) == 1
    return text.call("llvm.roundeven" if even else "llvm.round", out, one.name)


def _remainder(text: Text, out: str, left: Lane, right: Lane, **_: Any) -> Lane:
    if not _floating(out) and right.number in (None, 0.0, -1.0):
        raise Unsupported("a remainder by a number that may be none")  # by zero it would stop the program
    return _binary("frem", "srem" if _signed(out) else "urem")(text, out, left, right)


def exact_quotient(text: Text, out: str, left: Lane, right: Lane, **_: Any) -> Lane:
    """x/y to the last bit: where 3 y / y has to be 3."""
    return text.lane(f"fdiv {text.vector(out)} {left.name}, {right.name}", out)


def _divided(text: Text, out: str, left: Lane, right: Lane, **_: Any) -> Lane:
    if not _floating(out) and right.number in (None, 0.0, -1.0):
        raise Unsupported("a whole division by a number that may be none")
    if not _floating(out):
        return _binary(None, "sdiv" if _signed(out) else "udiv")(text, out, left, right)
    if right.name in text.either:
        # A derivative where two ends are equal: half of each.
        mask, yes, no = text.either[right.name]
        if yes != 0.0 and no != 0.0:
            return _times(text, left, _chosen(text, mask, text.constant(1.0 / yes, out), text.constant(1.0 / no, out)))
    if right.constant:
        return _binary("fdiv", None)(text, out, left, right)
    inverse = reciprocal(text, right)
    return inverse if left.number == 1.0 else _times(text, left, inverse)


def _converted(text: Text, out: str, one: Lane, **_: Any) -> Lane:
    if scalar_type(one.dtype) == scalar_type(out):
        return Lane(one.name, out, one.number if _floating(out) else None)
    source, target = text.vector(one.dtype), text.vector(out)
    if out == "bool":
        test = "fcmp une" if _floating(one.dtype) else "icmp ne"
        return text.lane(f"{test} {source} {one.name}, zeroinitializer", out)
    if one.dtype == "bool":
        return _chosen(text, one.name, text.constant(1, out), text.constant(0, out))
    if _floating(one.dtype) and _floating(out):
        how = "fpext" if out == "float64" else "fptrunc"
    elif _floating(out):
        how = "sitofp" if _signed(one.dtype) else "uitofp"
    elif _floating(one.dtype):
        # Out of range: the nearest, as XLA does, in the place of anything.
        name = f"llvm.fpto{'s' if _signed(out) else 'u'}i.sat.v{text.lanes}{scalar_type(out)}"
        name += f".v{text.lanes}{text.suffix(one.dtype)}"
        text.declare(name, target, [source])
        return text.lane(f"call {target} @{name}({source} {one.name})", out)
    else:
        wider = np.dtype(out).itemsize > np.dtype(one.dtype).itemsize
        how = ("sext" if _signed(one.dtype) else "zext") if wider else "trunc"
    return text.lane(f"{how} {source} {one.name} to {target}", out)


def select(text: Text, out: str, which: Lane, *cases: Lane, **_: Any) -> Lane:
    """JAX's `select_n`: the case with the number `which`; the first for false, the second for true."""
    if which.dtype == "bool":
        return _chosen(text, which.name, cases[1], cases[0])
    result = cases[0]
    for number, case in enumerate(cases[1:], start=1):
        is_it = text.assign(
            f"icmp sge {text.vector(which.dtype)} {which.name}, {text.constant(number, which.dtype).name}", "bool"
        )
        result = _chosen(text, is_it, case, result)
    return result


BASIC: Mapping[str, Operation] = {
    "add": _binary("fadd", "add"),
    "add_any": _binary("fadd", "add"),
    "sub": _binary("fsub", "sub"),
    "mul": _binary("fmul", "mul"),
    "div": _divided,
    "rem": _remainder,
    "max": _extreme(True),
    "min": _extreme(False),
    "neg": _negative,
    "abs": _absolute,
    "sign": _sign,
    "floor": _function("floor"),
    "ceil": _function("ceil"),
    "round": _rounded,
    "sqrt": _function("sqrt"),
    "exp": _function("exp"),
    "exp2": _function("exp2"),
    "expm1": _grown_less_one,
    "log": _function("log"),
    "log1p": _log_beside_one,
    "sin": _function("sin"),
    "cos": _function("cos"),
    "tan": _function("tan"),
    "acos": _function("acos"),
    "asin": _function("asin"),
    "atan": _function("atan"),
    "sinh": _function("sinh"),
    "cosh": _function("cosh"),
    "tanh": _function("tanh"),
    "pow": _function("pow"),
    "atan2": _function("atan2"),
    "is_finite": _finite,
    "eq": _compare("oeq", "eq"),
    "ne": _compare("une", "ne"),
    "lt": _compare("olt", "lt"),
    "le": _compare("ole", "le"),
    "gt": _compare("ogt", "gt"),
    "ge": _compare("oge", "ge"),
    "and": _binary(None, "and"),
    "or": _binary(None, "or"),
    "xor": _binary(None, "xor"),
    "not": _not,
    "shift_left": _shifted("shl"),
    "shift_right_logical": _shifted("lshr"),
    "shift_right_arithmetic": _shifted("ashr"),
    "bitcast_convert_type": _same_bits,
    "select_n": select,
    "convert_element_type": _converted,
}
ELEMENTWISE: Mapping[str, Operation] = {**BASIC, **composed(BASIC, Text.constant)}
