"""Small arrays of numbers, one C name an entry: moved about, reduced, multiplied; large or unknown places are no C here."""

from __future__ import annotations

from functools import reduce
from math import prod
from typing import Any

import numpy as np

from smajax.engine.array_operations import MOVES, REDUCTIONS
from smajax.engine.by_numpy import by_jax, by_numpy
from smajax.engine.values import Held, held
from smajax.export.errors import NoTranslation
from smajax.export.operations import ELEMENTWISE, select
from smajax.export.statements import Number, Writer, literal

MOST = 4096  # entries of an array; each is a name in the C


Value = np.ndarray | Held  # known before the program runs, or not


def is_known(value: Value) -> bool:
    """Whether it is known before the program runs."""
    return not isinstance(value, Held)


def numbers_of(value: Value) -> Held:
    """The entries as they are written. Raises NoTranslation for an array that is too large."""
    if value.size > MOST:
        raise NoTranslation(f"an array of the shape {tuple(value.shape)}: {value.size} numbers, of {MOST} at most")
    if isinstance(value, Held):
        return value
    dtype = str(value.dtype)
    return held([literal(one, dtype) for one in value.ravel()], value.shape)


def settled(value: Held) -> Value:
    """A known array where every entry is."""
    flat = list(value.ravel())
    if not flat or not all(one.known for one in flat):
        return value
    return np.asarray([one.value for one in flat], dtype=flat[0].dtype).reshape(value.shape)


def moved(primitive: Any, params: dict[str, Any], given: list[Value]) -> list[Value]:
    """What only moves numbers about: done with the places of the numbers in the place of themselves. Raises NoTranslation."""
    data = MOVES[primitive.name]
    numbers: list[Number] = []
    places: list[np.ndarray] = []
    for k, one in enumerate(given):
        if data is not None and k not in data:
            if not is_known(one):
                raise NoTranslation(
                    f"the operation `{primitive.name}` at a place that is not known before the program runs"
                )
            places.append(np.asarray(one))
            continue
        own = numbers_of(one)
        places.append(np.arange(len(numbers), len(numbers) + own.size, dtype="int32").reshape(own.shape))
        numbers += list(own.ravel())
    if primitive.name == "gather" and "FILL" in str(params.get("mode")):
        params = {**params, "fill_value": -1}  # not a place there is: found out below where it would be put in
    plain = by_numpy(primitive.name, params, places)
    results = [np.asarray(one) for one in by_jax(primitive, params, places)] if plain is None else [plain]
    if any(((one < 0) | (one >= len(numbers))).any() for one in results):
        raise NoTranslation(f"the operation `{primitive.name}` beyond the ends of an array")
    return [settled(held([numbers[k] for k in one.ravel()], one.shape)) for one in results]


def reduced(writer: Writer, name: str, value: Value, axes: tuple[int, ...], dtype: str) -> Value:
    """`reduce_sum` and the like, along axes."""
    operation, own = ELEMENTWISE[REDUCTIONS[name]], numbers_of(value)
    kept = [axis for axis in range(own.ndim) if axis not in axes]
    shape = tuple(own.shape[axis] for axis in kept)
    rows = own.transpose([*kept, *axes]).reshape(prod(shape), -1)
    if rows.shape[1] == 0:
        raise NoTranslation(f"`{name}` of no numbers")
    return settled(held([reduce(lambda a, b: operation(writer, dtype, a, b), row) for row in rows], shape))


def product(writer: Writer, left: Value, right: Value, dimension_numbers: Any, dtype: str) -> Value:
    """`dot_general`: sums of products along the contracted axes, for each of the batch."""
    (left_sum, right_sum), (left_batch, right_batch) = dimension_numbers
    rows, batch = [], []
    for value, summed, batched in ((left, left_sum, left_batch), (right, right_sum, right_batch)):
        own = numbers_of(value)
        free = [axis for axis in range(own.ndim) if axis not in (*summed, *batched)]
        batch = [own.shape[axis] for axis in batched]
        ordered = own.transpose([*batched, *free, *summed])
        length = prod(own.shape[axis] for axis in summed)
        rows.append((ordered.reshape(prod(batch), -1, length), tuple(own.shape[axis] for axis in free)))
    (first, first_shape), (second, second_shape) = rows
    add, times = ELEMENTWISE["add"], ELEMENTWISE["mul"]
    zero, flat = literal(0, dtype), []
    for ours, theirs in zip(first, second, strict=True):
        for one in ours:
            for other in theirs:
                terms = [times(writer, dtype, a, b) for a, b in zip(one, other, strict=True) if not _zero(a, b)]
                flat.append(reduce(lambda a, b: add(writer, dtype, a, b), terms) if terms else zero)
    return settled(held(flat, (*batch, *first_shape, *second_shape)))


def _zero(one: Number, other: Number) -> bool:
    """A product with a 0 that is known, as of a selection matrix."""
    return any(number.known and number.value == 0 for number in (one, other))


def _inside(writer: Writer, start: Number, last: int) -> str:
    """A place between 0 and `last`, the nearest end where there is none."""
    if last <= 0:
        return "0"
    place = start.text
    return writer.assign(f"({place} < 0 ? 0 : {place} > {last} ? {last} : {place})", start.dtype).text


def part_at(writer: Writer, value: Value, starts: list[Number], sizes: tuple[int, ...]) -> Held:
    """`dynamic_slice`: a part of an array from a place that is known when the program runs."""
    own = numbers_of(value)
    flat = list(own.ravel())
    if len(flat) == 1:
        return held(flat, sizes)
    array = writer.array(flat)
    strides = [prod(own.shape[axis + 1 :]) for axis in range(own.ndim)]
    terms = []
    for start, stride, length, size in zip(starts, strides, own.shape, sizes, strict=True):
        place = _inside(writer, start, length - size)
        terms += [] if place == "0" else [place if stride == 1 else f"{stride} * {place}"]
    result = []
    for offsets in np.ndindex(*sizes):
        offset = sum(at * stride for at, stride in zip(offsets, strides, strict=True))
        index = " + ".join([*terms, *([str(offset)] if offset or not terms else [])])
        result.append(writer.assign(f"{array}[{index}]", own.ravel()[0].dtype))
    return held(result, sizes)


def with_entry(writer: Writer, value: Value, start: Number, new: Number) -> Held:
    """The row with `new` at place `start`, the nearest end where there is none."""
    own = list(numbers_of(value).ravel())
    last = len(own) - 1
    result = []
    for k, one in enumerate(own):
        sign = "<=" if k == 0 else ">=" if k == last else "=="
        here = writer.assign(f"{start.text} {sign} {k}", "bool", "compare") if last else Number("true", "bool", True)
        result.append(select(writer, one.dtype, here, one, new))
    return held(result, value.shape)
