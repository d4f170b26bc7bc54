"""Elementwise operations that are others put together, said once for both targets: machine code (`arithmetic`) and C (`export.operations`).

What is left to those two is how the target writes a single operation, and what of JAX it lacks.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from smajax.engine.text import Unsupported

Operation = Callable[..., Any]  # (target, numpy's kind of the result, *numbers, **parameters) -> number


def _whole_power(put: Operation, unit: Any, one: Any, *, power: int, **_: Any) -> Any:
    """x^n by squares."""
    result: Any = None
    square, left = put("div", unit, one) if power < 0 else one, abs(power)
    while left:
        if left & 1:
            result = square if result is None else put("mul", result, square)
        left >>= 1
        square = put("mul", square, square) if left else square
    return unit if result is None else result


def _polynomial(put: Operation, unit: Any, one: Any, *coefficients: Any, **_: Any) -> Any:
    """c_0 + c_1 x + ... (an operation since JAX 0.12)."""
    result = coefficients[-1]
    for coefficient in reversed(coefficients[:-1]):
        result = put("add", put("mul", result, one), coefficient)
    return result


def _square(put: Operation, unit: Any, one: Any, **_: Any) -> Any:
    return put("mul", one, one)


def _one_less_square(put: Operation, unit: Any, one: Any, **_: Any) -> Any:
    """1 - x^2 as (1 + x)(1 - x), exact where x is near 1 (an operation since JAX 0.12)."""
    return put("mul", put("add", unit, one), put("sub", unit, one))


def _sigmoid(put: Operation, unit: Any, one: Any, **_: Any) -> Any:
    return put("div", unit, put("add", unit, put("exp", put("neg", one))))


def _inverse_root(put: Operation, unit: Any, one: Any, **_: Any) -> Any:
    return put("div", unit, put("sqrt", one))


def _clamped(put: Operation, unit: Any, low: Any, one: Any, high: Any, **_: Any) -> Any:
    return put("min", put("max", one, low), high)


def _same(put: Operation, unit: Any, one: Any, **_: Any) -> Any:
    return one


def _as_precise(put: Operation, unit: Any, one: Any, *, exponent_bits: int, mantissa_bits: int, **_: Any) -> Any:
    """What a derivative says of numbers that it computes again: no more digits than they had. Raises Unsupported for fewer."""
    whole = np.finfo(unit.dtype)
    if exponent_bits < whole.nexp or mantissa_bits < whole.nmant:
        raise Unsupported(f"numbers of {exponent_bits} and {mantissa_bits} bits")
    return one


COMPOSED: Mapping[str, Operation] = {
    "integer_pow": _whole_power,
    "polynomial": _polynomial,
    "square": _square,
    "one_minus_square": _one_less_square,
    "logistic": _sigmoid,
    "rsqrt": _inverse_root,
    "clamp": _clamped,
    "reduce_precision": _as_precise,
    "stop_gradient": _same,
    "copy": _same,
    "copy_p": _same,
}


def composed(table: Mapping[str, Operation], constant: Callable[..., Any]) -> dict[str, Operation]:
    """The operations as a target has them. table: those that they are made of; constant: `constant(target, value, kind)`, a number."""

    def of(operation: Operation) -> Operation:
        def written(target: Any, out: str, *numbers: Any, **params: Any) -> Any:
            def put(name: str, *given: Any) -> Any:
                return table[name](target, out, *given)

            return operation(put, constant(target, 1, out), *numbers, **params)

        return written

    return {name: of(operation) for name, operation in COMPOSED.items()}
