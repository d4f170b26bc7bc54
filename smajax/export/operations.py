"""Arithmetic on single numbers: one operation of a traced program -> the C of it.

NaN goes through `max`, `min` and comparisons as JAX has it. Functions of math.h are written `F(name)`, which is the float's in single
precision. The native engine has the same operations as machine code (`engine.arithmetic`): there a number is a vector of lanes and what it lacks of
JAX is another list. What is made of several operations stands once, in `engine.composed`.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from smajax.engine.composed import composed
from smajax.export.errors import NoTranslation
from smajax.export.statements import Number, Writer, literal

Operation = Callable[..., Number]

# numpy's kinds of numbers -> C's. int64 is what JAX counts by in double precision and int32 in single.
TYPES = {
    "float64": "real",
    "float32": "real",
    "int64": "int64_t",
    "int32": "int32_t",
    "int16": "int16_t",
    "int8": "int8_t",
    "uint64": "uint64_t",
    "uint32": "uint32_t",
    "uint16": "uint16_t",
    "uint8": "uint8_t",
    "bool": "bool",
}


def type_of(dtype: str) -> str:
    """C's name of a kind of number. Raises NoTranslation."""
    if dtype not in TYPES:
        raise NoTranslation(f"numbers of the kind {dtype}")
    return TYPES[dtype]


def is_real(dtype: str) -> bool:
    """Whether it is a floating number."""
    return dtype.startswith("float")


def _infix(sign: str, cost: str) -> Operation:
    def put(writer: Writer, out: str, left: Number, right: Number, **_: Any) -> Number:
        return writer.assign(f"{left.text} {sign} {right.text}", out, cost if is_real(out) else "")

    return put


def _is(number: Number, value: float) -> bool:
    return number.known and number.value == value and number.dtype != "bool"


def _add(writer: Writer, out: str, left: Number, right: Number, **_: Any) -> Number:
    if _is(left, 0.0):
        return right
    return left if _is(right, 0.0) else _infix("+", "add")(writer, out, left, right)


def _subtract(writer: Writer, out: str, left: Number, right: Number, **_: Any) -> Number:
    if _is(right, 0.0):
        return left
    return negative(writer, out, right) if _is(left, 0.0) else _infix("-", "add")(writer, out, left, right)


def times(writer: Writer, out: str, left: Number, right: Number, **_: Any) -> Number:
    """left * right."""
    for one, other in ((left, right), (right, left)):
        if _is(one, 1.0):
            return other
        if _is(one, -1.0):
            return negative(writer, out, other)
    return _infix("*", "mul")(writer, out, left, right)


def negative(writer: Writer, out: str, one: Number, **_: Any) -> Number:
    """-one."""
    return literal(-one.value, out) if one.known and one.value is not None else writer.assign(f"-{one.text}", out, "")


def divided(writer: Writer, out: str, left: Number, right: Number, **_: Any) -> Number:
    """left / right; of whole numbers by a known one alone, for one by zero is no C."""
    if _is(right, 1.0):
        return left
    if not is_real(out) and (not right.known or right.value in (0, -1)):
        raise NoTranslation("a whole division by a number that may be 0 or -1")
    return _infix("/", "div")(writer, out, left, right)


def _remainder(writer: Writer, out: str, left: Number, right: Number, **_: Any) -> Number:
    if is_real(out):
        return writer.assign(f"F(fmod)({left.text}, {right.text})", out, "call")
    if not right.known or right.value in (0, -1):
        raise NoTranslation("a remainder by a whole number that may be 0 or -1")
    return _infix("%", "div")(writer, out, left, right)


def _called(name: str) -> Operation:
    def put(writer: Writer, out: str, *given: Number, **_: Any) -> Number:
        if not is_real(out):
            raise NoTranslation(f"`{name}` of whole numbers")
        return writer.assign(f"F({name})({', '.join(one.text for one in given)})", out, "call")

    return put


def _helped(real: str, whole: str, cost: str) -> Operation:
    """By a small function of the file (`prelude`), for real and for whole numbers."""

    def put(writer: Writer, out: str, *given: Number, **_: Any) -> Number:
        if out == "bool":
            raise NoTranslation(f"`{real}` of truth values")
        texts = [one.text for one in given]
        if is_real(out):
            return writer.assign(f"{real}({', '.join(texts)})", out, cost)
        return writer.assign(whole.format(*texts), out, "")

    return put


def _compared(sign: str) -> Operation:
    def put(writer: Writer, out: str, left: Number, right: Number, **_: Any) -> Number:
        return writer.assign(f"{left.text} {sign} {right.text}", "bool", "compare")

    return put


def _logical(of_truth: str, of_bits: str) -> Operation:
    def put(writer: Writer, out: str, left: Number, right: Number, **_: Any) -> Number:
        if out != "bool":
            return _infix(of_bits, "")(writer, out, left, right)
        for one, other in ((left, right), (right, left)):
            if one.known and of_truth == "&&":
                return other if one.value else one
            if one.known and of_truth == "||":
                return one if one.value else other
        return (
            left if left == right and of_truth != "!=" else writer.assign(f"{left.text} {of_truth} {right.text}", out)
        )

    return put


def _not(writer: Writer, out: str, one: Number, **_: Any) -> Number:
    return writer.assign(f"!{one.text}" if out == "bool" else f"~{one.text}", out)


def select(writer: Writer, out: str, which: Number, *cases: Number, **_: Any) -> Number:
    """The case with the number `which`; of a truth value the first for false, the second for true."""
    if len(set(cases)) == 1:
        return cases[0]
    if which.known and which.value is not None:
        return cases[min(max(int(which.value), 0), len(cases) - 1)]
    if which.dtype == "bool":
        return writer.assign(f"{which.text} ? {cases[1].text} : {cases[0].text}", out, "compare")
    result = cases[-1]
    for number in range(len(cases) - 2, -1, -1):
        result = writer.assign(f"{which.text} <= {number} ? {cases[number].text} : {result.text}", out, "compare")
    return result


def _rounded(writer: Writer, out: str, one: Number, *, rounding_method: Any, **_: Any) -> Number:
    return writer.assign(f"F({'rint' if int(rounding_method) == 1 else 'round'})({one.text})", out, "call")


def _converted(writer: Writer, out: str, one: Number, **_: Any) -> Number:
    if type_of(one.dtype) == type_of(out):
        return Number(one.text, out, one.value)
    if out == "bool":
        return writer.assign(f"{one.text} != 0", out, "compare")
    if one.dtype == "bool" and is_real(out):
        return writer.assign(f"{one.text} ? R(1.0) : R(0.0)", out, "compare")
    if is_real(one.dtype) and not is_real(out):
        if np.dtype(out).kind == "u":
            raise NoTranslation(f"a real number made a {out}")
        # Beyond its range the nearest, as XLA has it, and 0 of NaN: in C it would be undefined.
        return writer.assign(f"whole{8 * np.dtype(out).itemsize}({one.text})", out, "compare")
    return writer.assign(f"({type_of(out)}){one.text}", out)


def _finite(writer: Writer, out: str, one: Number, **_: Any) -> Number:
    return writer.assign(f"(isfinite({one.text}) != 0)", "bool", "compare")


BASIC: Mapping[str, Operation] = {
    "add": _add,
    "add_any": _add,
    "sub": _subtract,
    "mul": times,
    "div": divided,
    "rem": _remainder,
    "max": _helped("larger", "({0} > {1} ? {0} : {1})", "compare"),
    "min": _helped("smaller", "({0} < {1} ? {0} : {1})", "compare"),
    "neg": negative,
    "abs": _helped("F(fabs)", "({0} < 0 ? -{0} : {0})", ""),
    "sign": _helped("sign_of", "(({0} > 0) - ({0} < 0))", "compare"),
    "floor": _called("floor"),
    "ceil": _called("ceil"),
    "round": _rounded,
    "sqrt": _called("sqrt"),
    "cbrt": _called("cbrt"),
    "exp": _called("exp"),
    "exp2": _called("exp2"),
    "expm1": _called("expm1"),
    "log": _called("log"),
    "log1p": _called("log1p"),
    "sin": _called("sin"),
    "cos": _called("cos"),
    "tan": _called("tan"),
    "acos": _called("acos"),
    "asin": _called("asin"),
    "atan": _called("atan"),
    "sinh": _called("sinh"),
    "cosh": _called("cosh"),
    "tanh": _called("tanh"),
    "asinh": _called("asinh"),
    "acosh": _called("acosh"),
    "atanh": _called("atanh"),
    "erf": _called("erf"),
    "erfc": _called("erfc"),
    "lgamma": _called("lgamma"),
    "pow": _called("pow"),
    "atan2": _called("atan2"),
    "nextafter": _called("nextafter"),
    "is_finite": _finite,
    "eq": _compared("=="),
    "ne": _compared("!="),
    "lt": _compared("<"),
    "le": _compared("<="),
    "gt": _compared(">"),
    "ge": _compared(">="),
    "and": _logical("&&", "&"),
    "or": _logical("||", "|"),
    "xor": _logical("!=", "^"),
    "not": _not,
    "select_n": select,
    "convert_element_type": _converted,
}
MADE = composed(BASIC, lambda _, value, dtype: literal(value, dtype))


def _whole_power(writer: Writer, out: str, one: Number, *, power: int, **_: Any) -> Number:
    """Divides last, which rounds once less; machine code takes powers of 1/x, as its division is an estimate of that."""
    result: Number = MADE["integer_pow"](writer, out, one, power=abs(power))
    return divided(writer, out, literal(1, out), result) if power < 0 else result


ELEMENTWISE: Mapping[str, Operation] = {**BASIC, **MADE, "integer_pow": _whole_power}
