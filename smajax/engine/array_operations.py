"""Operations on arrays that move, join, look up or fold numbers: for small arrays in registers, for large ones in memory."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from math import prod
from typing import Any

import numpy as np

from smajax.engine.arithmetic import ELEMENTWISE, select
from smajax.engine.by_numpy import by_jax, by_numpy
from smajax.engine.loop import Loop
from smajax.engine.memory import copy, in_memory, in_registers, literals, mapped, row, write
from smajax.engine.text import Array, Lane, Text, Unsupported, scalar_type
from smajax.engine.values import SMALL, Filled, Held, Stored, Value, held, is_known, size_of

LISTED = 8  # numbers among which one is selected, in the place of memory
ALIGNED_BY_ATTRIBUTE = 22  # major version of LLVM from which a masked load states its alignment beside the pointers

# What only moves numbers about, and which of the arguments are the numbers; the others say where to. None: all are.
MOVES: dict[str, tuple[int, ...] | None] = {
    "broadcast_in_dim": None,
    "concatenate": None,
    "dynamic_slice": (0,),
    "dynamic_update_slice": (0, 1),
    "expand_dims": None,
    "gather": (0,),
    "pad": None,
    "reshape": None,
    "rev": None,
    "scatter": (0, 2),
    "slice": None,
    "split": None,
    "squeeze": None,
    "stack": None,
    "transpose": None,
    "unstack": None,
}
# What folds an array along some of its axes, and by which operation.
REDUCTIONS = {
    "reduce_sum": "add",
    "reduce_prod": "mul",
    "reduce_max": "max",
    "reduce_min": "min",
    "reduce_and": "and",
    "reduce_or": "or",
}


def only_lane(value: Value) -> Lane | None:
    """The one number that a large array is full of."""
    return value.lane if isinstance(value, Filled) else None


def filled(lane: Lane, shape: tuple[int, ...]) -> Value:
    size = prod(shape)
    return held([lane] * size, shape) if size <= SMALL else Filled(lane, shape)


def whole_number(known: Value) -> int:
    return int(np.asarray(known))


def at_known_places(name: str, given: list[Value]) -> bool:
    data = MOVES[name]
    return data is None or all(is_known(one) for number, one in enumerate(given) if number not in data)


def moved(
    text: Text, primitive: Any, params: dict[str, Any], given: list[Value], keys: Sequence[bool] = ()
) -> list[Value]:
    """What only moves numbers of small arrays about: done with their numbers in the place of themselves.

    `keys`: which of them are random keys, of two words each, along a last axis of which the primitive knows nothing.
    """
    if any(keys):
        words = []
        for word in (0, 1):
            halves = [in_registers(text, one)[..., word] if key else one for one, key in zip(given, keys, strict=True)]
            words.append([in_registers(text, one) for one in moved(text, primitive, params, halves)])
        pairs = zip(*words, strict=True)
        return [
            held([lane for both in zip(one.ravel(), other.ravel(), strict=True) for lane in both], (*one.shape, 2))
            for one, other in pairs
        ]
    data = MOVES[primitive.name]
    lanes: list[Lane] = []
    named = []
    for number, one in enumerate(given):
        if data is not None and number not in data:
            named.append(np.asarray(one))
            continue
        own = in_registers(text, one)
        named.append(np.arange(len(lanes), len(lanes) + own.size, dtype="int32").reshape(own.shape))
        lanes += list(own.ravel())
    if primitive.name == "gather" and "FILL" in str(params.get("mode")):
        params = {**params, "fill_value": -1}  # not a place there is: found out below where it would be put in
    plain = by_numpy(primitive.name, params, named)
    places = [np.asarray(one) for one in by_jax(primitive, params, named)] if plain is None else [plain]
    if any(((one < 0) | (one >= len(lanes))).any() for one in places):
        raise Unsupported(f"the operation `{primitive.name}` beyond the ends of an array")
    return [held([lanes[k] for k in one.ravel()], one.shape) for one in places]


def _reshape(text: Text, params: Any, given: list[Value], out: Array, kinds: Any) -> Value:
    one = given[0]
    if params.get("dimensions") is not None:
        raise Unsupported("the operation `reshape` in another order of the dimensions")
    if isinstance(one, Stored):
        return Stored(one.address, out.shape, one.dtype, one.own)
    return held(list(in_registers(text, one).ravel()), out.shape)


def _squeeze(text: Text, params: Any, given: list[Value], out: Array, kinds: Any) -> Value:
    return _reshape(text, params, given, out, kinds)


def _expand_dims(text: Text, params: Any, given: list[Value], out: Array, kinds: Any) -> Value:
    return _reshape(text, params, given, out, kinds)


def _broadcast_in_dim(text: Text, params: Any, given: list[Value], out: Array, kinds: Any) -> Value:
    one, dims = given[0], params["broadcast_dimensions"]
    if size_of(one) == prod(out.shape) and list(dims) == sorted(dims):
        return _reshape(text, params, given, out, kinds)
    if size_of(one) == 1:
        return Filled(in_registers(text, one).ravel()[0], out.shape)
    return spread(text, one, dims, out, kinds[0])


def spread(text: Text, one: Value, dims: Sequence[int], out: Array, dtype: str) -> Value:
    """A large array that repeats another along some of its axes: axis k of that is axis `dims[k]` of this."""
    shape = tuple(one.shape)
    source = in_memory(text, one, shape, dtype)
    room = Stored(text.reserve(prod(out.shape), dtype), out.shape, dtype, own=True)
    loop = Loop(text, [], "spread")
    at = "0"
    for axis, size in enumerate(shape):
        if size == 1:
            continue
        behind = prod(out.shape[dims[axis] + 1 :])
        place = text.assign(f"udiv i64 {loop.count}, {behind}")
        place = text.assign(f"urem i64 {place}, {size}")
        place = text.assign(f"mul i64 {place}, {prod(shape[axis + 1 :])}")
        at = text.assign(f"add i64 {at}, {place}")
    write(text, room, loop.count, row(text, source, at, (), dtype))
    loop.end_after(room.size)
    return room


def _slice(text: Text, params: Any, given: list[Value], out: Array, kinds: Any) -> Value:
    one, starts = given[0], params["starts"]
    if isinstance(one, Stored):
        rest_whole = tuple(out.shape[1:]) == tuple(one.shape[1:])
        if not rest_whole:
            raise Unsupported("a part of a large array that is not whole rows")
        if (params["strides"] or (1,))[0] != 1:
            return every_few(text, one, starts[0], params["strides"][0], out)
        first = starts[0] * prod(one.shape[1:]) * (text.room if one.own else 1)
        part = Stored(text.address(one.address, str(first), one.dtype), out.shape, one.dtype, one.own)
        return in_registers(text, part) if part.size <= SMALL else part
    raise AssertionError("a small array is moved")


def every_few(text: Text, one: Stored, start: int, stride: int, out: Array) -> Value:
    """Rows of a large array, one in so many."""
    size = prod(out.shape[1:])
    room = Stored(text.reserve(prod(out.shape), out.dtype), out.shape, out.dtype, own=True)
    loop = Loop(text, [], "few")
    source = text.assign(f"add i64 {text.assign(f'mul i64 {loop.count}, {stride}')}, {start}")
    taken = row(text, one, source, out.shape[1:], out.dtype)
    write(text, room, loop.count, taken if size > 1 else held(in_registers(text, taken).ravel()[0]))
    loop.end_after(out.shape[0])
    return in_registers(text, room) if room.size <= SMALL else room


def parted(text: Text, one: Value, params: Any, out: Sequence[Array]) -> list[Value]:
    """A large array cut into runs of rows."""
    if params["axis"] != 0:
        raise Unsupported("a large array cut along another axis than the first")
    if isinstance(one, Filled):
        return [filled(one.lane, part.shape) for part in out]
    starts = np.cumsum([0, *params["sizes"]])[:-1]
    rest = (0,) * (len(out[0].shape) - 1)
    return [
        _slice(text, {"starts": (int(start), *rest), "strides": None}, [one], part, ())
        for start, part in zip(starts, out, strict=True)
    ]


def _dynamic_slice(text: Text, params: Any, given: list[Value], out: Array, kinds: Any) -> Value:
    one, starts = given[0], given[1:]
    shape = tuple(one.shape)
    if all(is_known(start) for start in starts):
        begin = [min(max(whole_number(s), 0), n - m) for s, n, m in zip(starts, shape, out.shape, strict=True)]
        return _slice(text, {"starts": begin, "strides": None}, [one], out, kinds)
    if len(shape) != 1 or prod(out.shape) != 1:
        raise Unsupported("a part of an array that begins where each run says")
    return held(looked_up(text, one, in_registers(text, starts[0]).ravel()[0], kinds[0]), out.shape)


def _gather(text: Text, params: Any, given: list[Value], out: Array, kinds: Any) -> Value:
    one, index = given
    numbers, rest = params["dimension_numbers"], tuple(one.shape)[1:]
    of_rows = (
        tuple(params["slice_sizes"]) == (1, *rest)
        and tuple(numbers.start_index_map) == (0,)
        and tuple(numbers.collapsed_slice_dims) == (0,)
        and tuple(numbers.offset_dims) == tuple(range(len(out.shape) - len(rest), len(out.shape)))
    )
    if not of_rows:
        raise Unsupported("a gathering of anything but rows of an array")
    if is_known(index):
        places = np.asarray(index).ravel()
        if "FILL" in str(params["mode"]) and ((places < 0) | (places >= one.shape[0])).any():
            raise Unsupported("a gathering that puts something in the place of what is beyond the ends")
        rows = rows_at(text, one, np.clip(places, 0, one.shape[0] - 1), out)
        if rows is not None:
            return rows
    if rest:
        raise Unsupported("a gathering of rows of more than one number")
    source = one if isinstance(one, Held) and one.size <= LISTED else in_memory(text, one, tuple(one.shape), kinds[0])

    def at(place: Lane) -> Lane:
        return looked_up(text, source, place, kinds[0])

    if prod(out.shape) <= SMALL:
        return held([at(place) for place in in_registers(text, index).ravel()], out.shape)
    room = Stored(text.reserve(prod(out.shape), out.dtype), out.shape, out.dtype, own=True)
    mapped(text, room, 0, at, [index])
    return room


def rows_at(text: Text, one: Value, places: np.ndarray, out: Array) -> Value | None:
    """Rows of an array at places that are known, evenly spaced or few; JAX 0.7 writes `x[::2]` as that. None: neither."""
    steps = set(np.diff(places).tolist())
    stride = steps.pop() if len(steps) == 1 else 0
    if stride <= 0 and len(places) > SMALL:
        return None
    stored = in_memory(text, one, tuple(one.shape), out.dtype)
    if stride > 0:
        start = (int(places[0]), *(0 for _ in stored.shape[1:]))
        return _slice(text, {"starts": start, "strides": (stride,)}, [stored], out, ())
    parts = [row(text, stored, str(place), stored.shape[1:], out.dtype) for place in places]
    if prod(out.shape) <= SMALL:
        return held([lane for part in parts for lane in in_registers(text, part).ravel()], out.shape)
    return joined(text, parts, 0, out)


def looked_up(text: Text, array: Value, index: Lane, dtype: str) -> Lane:
    """Of a row of numbers the one that each lane asks for; the nearest end where there is none."""
    shape = tuple(array.shape)
    index = ELEMENTWISE["convert_element_type"](text, "int64", index)
    most = text.constant(shape[0] - 1, index.dtype)
    low = ELEMENTWISE["max"](text, index.dtype, index, text.constant(0, index.dtype))
    low = ELEMENTWISE["min"](text, index.dtype, low, most)
    if isinstance(array, Held) and array.size <= LISTED:
        return select(text, dtype, low, *array.ravel()) if array.size > 1 else array.ravel()[0]
    stored = in_memory(text, array, shape, dtype)
    kind = scalar_type(dtype)
    if dtype == "bool":
        raise Unsupported("truth values looked up in a table")
    offsets, of = low.name, text.vector("int64")
    base, places = text.fresh("p"), text.fresh("p")
    if stored.own:
        # The number of the run in lane k lies at index * room + k.
        own = ", ".join(f"i64 {k}" for k in range(text.lanes))
        scaled = text.lane(f"mul {of} {offsets}, {text.constant(text.room, 'int64').name}", "int64")
        offsets = text.lane(f"add {of} {scaled.name}, <{own}>", "int64").name
    lines = [
        f"{base} = getelementptr {kind}, ptr {stored.address}, i64 {'%at' if stored.own else 0}",
        f"{places} = getelementptr {kind}, ptr {base}, {of} {offsets}",
    ]
    name = f"llvm.masked.gather.v{text.lanes}{text.suffix(dtype)}.v{text.lanes}p0"
    pointers = f"<{text.lanes} x ptr>"
    everywhere = f"{text.vector('bool')} splat (i1 true), {text.vector(dtype)} poison"
    if llvm_version() >= ALIGNED_BY_ATTRIBUTE:
        text.declare(name, text.vector(dtype), [pointers, text.vector("bool"), text.vector(dtype)])
        arguments = f"{pointers} align {text.bytes(dtype)} {places}, {everywhere}"
    else:
        text.declare(name, text.vector(dtype), [pointers, "i32", text.vector("bool"), text.vector(dtype)])
        arguments = f"{pointers} {places}, i32 {text.bytes(dtype)}, {everywhere}"
    return Lane(text.work([*lines, f"call {text.vector(dtype)} @{name}({arguments})"], dtype), dtype)


def llvm_version() -> int:
    """Major version of the LLVM that llvmlite brings."""
    import llvmlite.binding as llvm

    return int(llvm.llvm_version_info[0])


def _concatenate(text: Text, params: Any, given: list[Value], out: Array, kinds: Any) -> Value:
    return joined(text, given, params["axis"], out)


def _stack(text: Text, params: Any, given: list[Value], out: Array, kinds: Any) -> Value:
    return joined(text, given, params["axis"], out)


def _pad(text: Text, params: Any, given: list[Value], out: Array, kinds: Any) -> Value:
    one, filling = given
    (before, after, between), *others = params["padding"]
    if between or before < 0 or after < 0 or any(any(rest) for rest in others):
        raise Unsupported("a large array that is padded otherwise than with rows before and behind it")
    lane = in_registers(text, filling).ravel()[0]
    ends = [filled(lane, (count, *out.shape[1:])) for count in (before, after)]
    return joined(text, [part for part in (ends[0], one, ends[1]) if size_of(part)], 0, out)


def joined(text: Text, given: list[Value], axis: int, out: Array) -> Value:
    """Large arrays one after the other."""
    if axis != 0:
        raise Unsupported("large arrays put together along another axis than the first")
    if len(given) == 1:
        return _reshape(text, {}, given, out, ())
    room = Stored(text.reserve(prod(out.shape), out.dtype), out.shape, out.dtype, own=True)
    start = 0
    for one in given:
        copy(text, room, start, one)
        start += size_of(one)
    return room


def folded(text: Text, name: str, one: Value, dtype: str) -> Value:
    """A large array, all of it, one number after the other."""

    def at(index: str) -> Lane:
        return in_registers(text, row(text, flat, index, (), dtype)).ravel()[0]

    size = size_of(one)
    flat = _reshape(text, {}, [one], Array((size,), dtype), ()) if isinstance(one, Stored) else one
    loop = Loop(text, [held(at("0"))], "fold")
    now = at(text.assign(f"add i64 {loop.count}, 1"))
    loop.end_after(size - 1, [held(ELEMENTWISE[name](text, dtype, loop.carry[0].ravel()[0], now))])
    return loop.carried()[0]


def reduced(text: Text, name: str, given: list[Value], axes: Sequence[int], out: Array) -> Value:
    if size_of(given[0]) > SMALL and out.shape == () and not is_known(given[0]):
        return folded(text, name, given[0], out.dtype)
    lanes = np.asarray(in_registers(text, given[0]))
    if lanes.size == 0:
        raise Unsupported("the sum of no numbers")
    moved = np.moveaxis(lanes, axes, range(len(axes))).reshape(-1, *out.shape)
    total = moved[0]
    operation = ELEMENTWISE[name]
    for more in moved[1:]:
        flat = [
            operation(text, out.dtype, one, other) for one, other in zip(np.ravel(total), np.ravel(more), strict=True)
        ]
        total = np.asarray(held(flat, out.shape))
    return held(list(np.ravel(total)), out.shape)


def _dot_general(text: Text, params: Any, given: list[Value], out: Array, kinds: Any) -> Value:
    (left_axes, right_axes), (left_batch, right_batch) = params["dimension_numbers"]
    if left_batch or right_batch or set(kinds) != {out.dtype} or out.dtype == "bool":
        raise Unsupported("products of matrices in batches, of truth values, or of different kinds of numbers")
    left, right = (
        np.asarray(literals(text, np.asarray(one)) if is_known(one) else in_registers(text, one)) for one in given
    )
    count = prod([left.shape[axis] for axis in left_axes])
    rows = np.moveaxis(left, left_axes, range(-len(left_axes), 0)).reshape(-1, count)
    columns = np.moveaxis(right, right_axes, range(len(right_axes))).reshape(count, -1)
    put = ELEMENTWISE
    result = []
    for one in rows:
        for other in columns.T:
            total = put["mul"](text, out.dtype, one[0], other[0])
            for k in range(1, count):
                product = put["mul"](text, out.dtype, one[k], other[k])
                total = put["add"](text, out.dtype, total, product)
            result.append(total)
    return held(result, out.shape)


# Primitive -> what is done where an array is large, or where its numbers come from is known only when the program runs:
# (text, parameters, arguments, shape and kind of the result, kinds of the arguments) -> result.
OPERATIONS: Mapping[str, Callable[[Text, Any, list[Value], Array, Any], Value]] = {
    "broadcast_in_dim": _broadcast_in_dim,
    "concatenate": _concatenate,
    "dot_general": _dot_general,
    "dynamic_slice": _dynamic_slice,
    "expand_dims": _expand_dims,
    "gather": _gather,
    "pad": _pad,
    "reshape": _reshape,
    "slice": _slice,
    "squeeze": _squeeze,
    "stack": _stack,
}
