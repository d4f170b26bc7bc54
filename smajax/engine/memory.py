"""Arrays of a traced program in registers and in memory, and the ways between the two."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from math import prod

import numpy as np

from smajax.engine.loop import Loop
from smajax.engine.text import Lane, Text, Unsupported
from smajax.engine.values import SMALL, Filled, Held, Stored, Value, held, is_known, name_of, size_of


def _element(text: Text, value: Stored, index: str) -> Lane:
    """The number with the flat index (an i64) of an array in memory."""
    if value.own:
        index = text.assign(f"mul i64 {index}, {text.room}")
    address = text.address(value.address, index, value.dtype)
    return text.load_lanes(address, value.dtype) if value.own else text.load_everywhere(address, value.dtype)


def in_registers(text: Text, value: Value) -> Held:
    """The same as an array of lanes. Raises Unsupported where it is large."""
    if isinstance(value, Held):
        return value
    if size_of(value) > SMALL:
        raise Unsupported(f"an array of the shape {value.shape} in arithmetic of its own")
    if isinstance(value, Filled):
        return held([value.lane] * size_of(value), value.shape)
    if isinstance(value, Stored):
        return held([_element(text, value, str(k)) for k in range(value.size)], value.shape)
    return literals(text, value)


def literals(text: Text, value: np.ndarray) -> Held:
    """A known array of any size, which takes no registers before its numbers are used."""
    dtype = name_of(value.dtype)
    return held([text.constant(one, dtype) for one in value.ravel()], value.shape)


def table(text: Text, value: np.ndarray) -> Stored:
    """A known array as a constant of the program."""
    dtype = name_of(value.dtype)
    stored = value.astype("int8") if dtype == "bool" else value
    name = f"@known{len(text.globals)}"
    raw = "".join(f"\\{byte:02X}" for byte in np.ascontiguousarray(stored).tobytes())
    text.globals.append(f'{name} = private constant [{stored.nbytes} x i8] c"{raw}", align 64')
    return Stored(name, value.shape, dtype, own=False)


def in_memory(text: Text, value: Value, shape: tuple[int, ...], dtype: str) -> Stored:
    """The same in memory, where a loop finds it by a number that changes."""
    if isinstance(value, Stored):
        return value
    if is_known(value):
        return table(text, np.asarray(value))
    if isinstance(value, Filled):
        raise AssertionError("of a filled array every number is known")
    assert isinstance(value, Held)
    room = Stored(text.reserve(value.size, dtype), shape, dtype, own=True)
    for number, lane in enumerate(value.ravel()):
        text.store_lanes(lane, text.address(room.address, str(number * text.room), dtype))
    return room


def row(text: Text, value: Value, index: str, shape: tuple[int, ...], dtype: str) -> Value:
    """`value[index]`, an array of `shape`, for an index (an i64) that is known when the program runs."""
    if isinstance(value, Filled):
        size = prod(shape)
        return held([value.lane] * size, shape) if size <= SMALL else Filled(value.lane, shape)
    stored = in_memory(text, value, (0, *shape), dtype)
    size = prod(shape)
    first = index if size == 1 else text.assign(f"mul i64 {index}, {size}")
    if shape == ():
        return held(_element(text, stored, first))
    lanes = text.room if stored.own else 1
    start = text.assign(f"mul i64 {first}, {lanes}") if lanes > 1 else first
    part = Stored(text.address(stored.address, start, dtype), shape, dtype, stored.own)
    return in_registers(text, part) if size <= SMALL else part


def write(text: Text, room: Stored, index: str, value: Value) -> None:
    """`room[index] = value` in memory of each run's own."""
    size = size_of(value)
    first = text.assign(f"mul i64 {index}, {size * text.room}")
    if isinstance(value, Filled) or (isinstance(value, Stored) and size > SMALL):
        copy(text, Stored(text.address(room.address, first, room.dtype), (size,), room.dtype, own=True), 0, value)
        return
    for number, lane in enumerate(in_registers(text, value).ravel()):
        at = text.assign(f"add i64 {first}, {number * text.room}") if number else first
        text.store_lanes(lane, text.address(room.address, at, room.dtype))


def copy(text: Text, room: Stored, start: int, value: Value) -> None:
    """All of `value` into `room` from its number `start` on."""
    size = size_of(value)
    if size <= SMALL:
        for number, lane in enumerate(in_registers(text, value).ravel()):
            text.store_lanes(lane, text.address(room.address, str((start + number) * text.room), room.dtype))
        return
    mapped(text, room, start, lambda lane: lane, [value])


def mapped(text: Text, room: Stored, start: int, operation: Callable[..., Lane], given: Sequence[Value]) -> None:
    """`operation` of the numbers of large arrays of one shape, each with each, into `room` from its number `start` on."""
    size = max(map(size_of, given))
    sources = [table(text, np.asarray(one)) if is_known(one) and size_of(one) > 1 else one for one in given]
    loop = Loop(text, [], "map")

    def now(one: Value) -> Lane:
        if isinstance(one, Filled):
            return one.lane
        return _element(text, one, loop.count) if isinstance(one, Stored) else in_registers(text, one).ravel()[0]

    lane = operation(*(now(one) for one in sources))
    at = text.assign(f"add i64 {loop.count}, {start}")
    at = text.assign(f"mul i64 {at}, {text.room}")
    text.store_lanes(lane, text.address(room.address, at, room.dtype))
    loop.end_after(size)
