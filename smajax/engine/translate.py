"""A traced program of one member -> the text of a loop over groups of members, a lane each."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import jax
import jax.extend as jex
import jax.numpy as jnp
import numpy as np
from jax.interpreters import partial_eval

from smajax.engine.arithmetic import ELEMENTWISE, exact_quotient, select
from smajax.engine.expansions import EXPANSIONS
from smajax.engine.jax_versions import TABLE, expanded, kind_of, opened, parameters_of
from smajax.engine.loop import Loop
from smajax.engine.memory import copy, in_memory, in_registers, mapped, row, write
from smajax.engine.phases import laid_out
from smajax.engine.text import NAME, Array, Lane, Text, Unsupported, scalar_type
from smajax.engine.values import SMALL, Filled, Held, Stored, Value, held, is_known, size_of

VECTORS = 8  # of a group: while one waits for a result others go on
CALLS = {
    name for name, own in TABLE.items() if "program" in own and name != "scan"
}  # they stand for a program of their own
SAME = (
    "optimization_barrier",
    "name",
    "random_wrap",
    "random_unwrap",
)  # what says something to XLA, or to a derivative, and changes nothing
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


@dataclass(frozen=True)
class Translated:
    """The text of `void members(ptr shared, ptr own, ptr results, ptr scratch, i64 first, i64 last)`, over vectors of members."""

    text: str
    lanes: int  # members of a vector
    results: tuple[Array, ...]
    scratch: int  # bytes a thread needs


def _array(aval: Any) -> Array:
    return Array(*kind_of(aval))


def _only_lane(value: Value) -> Lane | None:
    """The one number that a large array is full of."""
    return value.lane if isinstance(value, Filled) else None


def _filled(lane: Lane, shape: tuple[int, ...]) -> Value:
    size = int(np.prod(shape))
    return held([lane] * size, shape) if size <= SMALL else Filled(lane, shape)


def _whole(known: Value) -> int:
    return int(np.asarray(known))


def _rounds(equation: Any) -> bool:
    """Whether it cuts its argument to a whole number: a quotient must not be a bit below one then."""
    name = equation.primitive.name
    if name in ("jit", "pjit"):
        name = str(parameters_of(equation)["name"])
    to_whole = name == "convert_element_type" and "int" in str(parameters_of(equation)["new_dtype"])
    return to_whole or name in ("floor", "ceil", "round", "trunc", "fix", "floor_divide")


def _numbers(known: Any) -> np.ndarray:
    """A known array; of random keys their words."""
    keys = isinstance(known, jax.Array) and jnp.issubdtype(known.dtype, jax.dtypes.prng_key)
    return np.asarray(jax.random.key_data(known) if keys else known)


def _constants(consts: Sequence[Any]) -> list[Value]:
    try:
        return [_numbers(one) for one in consts]
    except TypeError:
        raise Unsupported("a constant that is no array of numbers") from None


class _Translation:
    def __init__(self, text: Text) -> None:
        self.text = text

    def program(self, jaxpr: Any, consts: Sequence[Value], given: Sequence[Value]) -> list[Value]:
        """The results of a program of which the arguments are `given`."""
        names: dict[Any, Value] = {}

        def read(atom: Any) -> Value:
            if isinstance(atom, jex.core.Literal):
                return np.asarray(atom.val, dtype=_array(atom.aval).dtype)
            return names[atom]

        for variable, value in zip([*jaxpr.constvars, *jaxpr.invars], [*consts, *given], strict=True):
            names[variable] = value
        to_the_bit = {id(one) for equation in jaxpr.eqns if _rounds(equation) for one in equation.invars}
        for equation in jaxpr.eqns:
            given = [read(one) for one in equation.invars]
            whole = equation.primitive.name == "div" and id(equation.outvars[0]) in to_the_bit
            try:
                found = self.equation(equation, given, "exact_div" if whole else equation.primitive.name)
            except Exception as error:
                if not hasattr(error, "__notes__"):  # of the innermost alone
                    error.add_note(f"while the operation `{equation.primitive.name}` was translated")
                raise
            for variable, value in zip(equation.outvars, found, strict=True):
                names[variable] = value
        return [read(one) for one in jaxpr.outvars]

    def closed(self, program: Any, given: Sequence[Value]) -> list[Value]:
        jaxpr, consts = opened(program)
        return self.program(jaxpr, _constants(consts), given)

    def equation(self, equation: Any, given: list[Value], name: str) -> list[Value]:
        params = parameters_of(equation)
        if name in SAME:
            return given
        if name in CALLS:
            return self.closed(params["program"], given)
        if name == "scan":
            return self.scan(params, given, [_array(one.aval) for one in equation.outvars])
        if name == "while":
            return self.repeat(params, given)
        if name == "cond":
            return self.choice(params, given)
        if name in EXPANSIONS and not (name in ("threefry2x32", "erf_inv") and all(map(is_known, given))):
            return self.closed(expanded(equation), given)
        if all(is_known(one) for one in given):
            with jax.ensure_compile_time_eval():
                found = equation.primitive.bind(*given, **equation.params)
            return [_numbers(one) for one in (found if equation.primitive.multiple_results else [found])]
        out = _array(equation.outvars[0].aval)
        kinds = [str(one.aval.dtype) for one in equation.invars]
        if name == "exact_div" and not out.dtype.startswith("float"):
            name = "div"
        if name in ELEMENTWISE or name == "exact_div":
            return [self.elementwise(name, params, given, out)]
        if name == "gather" and "FILL" in str(params["mode"]) and not self.at_known_places(name, given):
            raise Unsupported("a gathering that puts something in the place of what is beyond the ends")
        if name in REDUCTIONS:
            return [self.reduced(REDUCTIONS[name], given, params["axes"], out)]
        small = all(size_of(one) <= SMALL for one in given)
        small &= all(int(np.prod(one.aval.shape)) <= SMALL for one in equation.outvars)
        if name in MOVES and small and self.at_known_places(name, given):
            return self.moved(equation.primitive, equation.params, given)
        if name in MOVES and len(set(map(_only_lane, given[: 1 if MOVES[name] else None]))) == 1:
            lane = _only_lane(given[0])
            if lane is not None and name not in ("dynamic_update_slice", "scatter", "split"):
                return [_filled(lane, out.shape)]
        if name == "split":
            return self.parted(given[0], params, [_array(one.aval) for one in equation.outvars])
        method: Callable[..., Value] | None = getattr(self, f"put_{name}", None)
        if method is None:
            program = expanded(equation)
            if program is None:
                raise Unsupported(f"the operation `{name}`")
            return self.closed(program, given)
        return [method(params, given, out, kinds)]

    # Arithmetic, and the shapes of arrays.

    def elementwise(self, name: str, params: dict[str, Any], given: list[Value], out: Array) -> Value:
        size = int(np.prod(out.shape))
        scalar_type(out.dtype)
        if name == "convert_element_type" and isinstance(given[0], Stored) and given[0].dtype == out.dtype:
            return given[0]

        operation = exact_quotient if name == "exact_div" else ELEMENTWISE[name]

        def put(*lanes: Lane) -> Lane:
            if (
                name not in ("select_n", "convert_element_type", "bitcast_convert_type")
                and len({one.dtype for one in lanes}) > 1
            ):
                raise Unsupported(f"`{name}` of different kinds of numbers")
            return operation(self.text, out.dtype, *lanes, **params)

        if size > SMALL:
            if all(isinstance(one, Filled) or (is_known(one) and size_of(one) == 1) for one in given):
                lanes = [
                    one.lane if isinstance(one, Filled) else in_registers(self.text, one).ravel()[0] for one in given
                ]
                return Filled(put(*lanes), out.shape)
            if any(size_of(one) not in (1, size) for one in given):
                raise Unsupported(f"`{name}` of arrays of the shapes {[self.shape_of(one) for one in given]}")
            room = Stored(self.text.reserve(size, out.dtype), out.shape, out.dtype, own=True)
            mapped(self.text, room, 0, put, given)
            return room
        # A predicate, the ends of `clamp` and axes of length one may stand for all.
        flat = [np.broadcast_to(np.asarray(in_registers(self.text, one)), out.shape).ravel() for one in given]
        return held([put(*(one[k] for one in flat)) for k in range(size)], out.shape)

    @staticmethod
    def at_known_places(name: str, given: list[Value]) -> bool:
        data = MOVES[name]
        return data is None or all(is_known(one) for number, one in enumerate(given) if number not in data)

    def moved(self, primitive: Any, params: dict[str, Any], given: list[Value]) -> list[Value]:
        """What only moves numbers of small arrays about: done with their numbers in the place of themselves."""
        data = MOVES[primitive.name]
        lanes: list[Lane] = []
        named = []
        for number, one in enumerate(given):
            if data is not None and number not in data:
                named.append(np.asarray(one))
                continue
            own = in_registers(self.text, one)
            named.append(np.arange(len(lanes), len(lanes) + own.size, dtype="int32").reshape(own.shape))
            lanes += list(own.ravel())
        if "FILL" in str(params.get("mode")):
            params = {**params, "fill_value": -1}  # not a place there is: found out below where it would be put in
        with jax.ensure_compile_time_eval():
            found = primitive.bind(*named, **params)
        results = found if primitive.multiple_results else [found]
        places = [np.asarray(one) for one in results]
        if any(((one < 0) | (one >= len(lanes))).any() for one in places):
            raise Unsupported(f"the operation `{primitive.name}` beyond the ends of an array")
        return [held([lanes[k] for k in one.ravel()], one.shape) for one in places]

    def put_reshape(self, params: Any, given: list[Value], out: Array, kinds: Any) -> Value:
        one = given[0]
        if isinstance(one, Stored):
            return Stored(one.address, out.shape, one.dtype, one.own)
        return held(list(in_registers(self.text, one).ravel()), out.shape)

    def put_squeeze(self, params: Any, given: list[Value], out: Array, kinds: Any) -> Value:
        return self.put_reshape(params, given, out, kinds)

    def put_expand_dims(self, params: Any, given: list[Value], out: Array, kinds: Any) -> Value:
        return self.put_reshape(params, given, out, kinds)

    def put_broadcast_in_dim(self, params: Any, given: list[Value], out: Array, kinds: Any) -> Value:
        one, dims = given[0], params["broadcast_dimensions"]
        if size_of(one) == int(np.prod(out.shape)) and list(dims) == sorted(dims):
            return self.put_reshape(params, given, out, kinds)
        if size_of(one) == 1:
            return Filled(in_registers(self.text, one).ravel()[0], out.shape)
        return self.spread(one, dims, out, kinds[0])

    def spread(self, one: Value, dims: Sequence[int], out: Array, dtype: str) -> Value:
        """A large array that repeats another along some of its axes: axis k of that is axis `dims[k]` of this."""
        text, shape = self.text, self.shape_of(one)
        source = in_memory(text, one, shape, dtype)
        room = Stored(text.reserve(int(np.prod(out.shape)), dtype), out.shape, dtype, own=True)
        loop = Loop(text, [], "spread")
        at = "0"
        for axis, size in enumerate(shape):
            if size == 1:
                continue
            behind = int(np.prod(out.shape[dims[axis] + 1 :]))
            place = text.assign(f"udiv i64 {loop.count}, {behind}")
            place = text.assign(f"urem i64 {place}, {size}")
            place = text.assign(f"mul i64 {place}, {int(np.prod(shape[axis + 1 :]))}")
            at = text.assign(f"add i64 {at}, {place}")
        write(text, room, loop.count, row(text, source, at, (), dtype))
        loop.end_after(room.size)
        return room

    def put_slice(self, params: Any, given: list[Value], out: Array, kinds: Any) -> Value:
        one, starts = given[0], params["starts"]
        if isinstance(one, Stored):
            rest_whole = tuple(out.shape[1:]) == tuple(one.shape[1:])
            if not rest_whole:
                raise Unsupported("a part of a large array that is not whole rows")
            if (params["strides"] or (1,))[0] != 1:
                return self.every_few(one, starts[0], params["strides"][0], out)
            first = starts[0] * int(np.prod(one.shape[1:])) * (self.text.room if one.own else 1)
            part = Stored(self.text.address(one.address, str(first), one.dtype), out.shape, one.dtype, one.own)
            return in_registers(self.text, part) if part.size <= SMALL else part
        raise AssertionError("a small array is moved")

    def every_few(self, one: Stored, start: int, stride: int, out: Array) -> Value:
        """Rows of a large array, one in so many."""
        text, size = self.text, int(np.prod(out.shape[1:]))
        room = Stored(text.reserve(int(np.prod(out.shape)), out.dtype), out.shape, out.dtype, own=True)
        loop = Loop(text, [], "few")
        source = text.assign(f"add i64 {text.assign(f'mul i64 {loop.count}, {stride}')}, {start}")
        taken = row(text, one, source, out.shape[1:], out.dtype)
        write(text, room, loop.count, taken if size > 1 else held(in_registers(text, taken).ravel()[0]))
        loop.end_after(out.shape[0])
        return in_registers(text, room) if room.size <= SMALL else room

    def parted(self, one: Value, params: Any, out: Sequence[Array]) -> list[Value]:
        """A large array cut into runs of rows."""
        if params["axis"] != 0:
            raise Unsupported("a large array cut along another axis than the first")
        if isinstance(one, Filled):
            return [_filled(one.lane, part.shape) for part in out]
        starts = np.cumsum([0, *params["sizes"]])[:-1]
        rest = (0,) * (len(out[0].shape) - 1)
        return [
            self.put_slice({"starts": (int(start), *rest), "strides": None}, [one], part, ())
            for start, part in zip(starts, out, strict=True)
        ]

    def put_dynamic_slice(self, params: Any, given: list[Value], out: Array, kinds: Any) -> Value:
        one, starts = given[0], given[1:]
        shape = self.shape_of(one)
        if all(is_known(start) for start in starts):
            begin = [min(max(_whole(s), 0), n - m) for s, n, m in zip(starts, shape, out.shape, strict=True)]
            return self.put_slice({"starts": begin, "strides": None}, [one], out, kinds)
        if len(shape) != 1 or int(np.prod(out.shape)) != 1:
            raise Unsupported("a part of an array that begins where each member says")
        return held(self.looked_up(one, in_registers(self.text, starts[0]).ravel()[0], kinds[0]), out.shape)

    def put_gather(self, params: Any, given: list[Value], out: Array, kinds: Any) -> Value:
        one, index = given
        numbers = params["dimension_numbers"]
        one_of_a_row = (
            len(self.shape_of(one)) == 1
            and tuple(params["slice_sizes"]) == (1,)
            and tuple(numbers.start_index_map) == (0,)
            and out.shape == ()
        )
        if not one_of_a_row:
            raise Unsupported("a gathering of more than one number")
        return held(self.looked_up(one, in_registers(self.text, index).ravel()[0], kinds[0]))

    def looked_up(self, array: Value, index: Lane, dtype: str) -> Lane:
        """Of a row of numbers the one that each lane asks for; the nearest end where there is none."""
        text, shape = self.text, self.shape_of(array)
        index = ELEMENTWISE["convert_element_type"](text, "int64", index)
        most = text.constant(shape[0] - 1, index.dtype)
        low = ELEMENTWISE["max"](text, index.dtype, index, text.constant(0, index.dtype))
        low = ELEMENTWISE["min"](text, index.dtype, low, most)
        if isinstance(array, Held) and array.size <= 8:
            return select(text, dtype, low, *array.ravel()) if array.size > 1 else array.ravel()[0]
        stored = in_memory(text, array, shape, dtype)
        kind = scalar_type(dtype)
        if dtype == "bool":
            raise Unsupported("truth values looked up in a table")
        offsets, of = low.name, text.vector("int64")
        base, places = text.fresh("p"), text.fresh("p")
        if stored.own:
            # Member k's own number lies at index * room + k.
            own = ", ".join(f"i64 {k}" for k in range(text.lanes))
            scaled = text.lane(f"mul {of} {offsets}, {text.constant(text.room, 'int64').name}", "int64")
            offsets = text.lane(f"add {of} {scaled.name}, <{own}>", "int64").name
        lines = [
            f"{base} = getelementptr {kind}, ptr {stored.address}, i64 {'%at' if stored.own else 0}",
            f"{places} = getelementptr {kind}, ptr {base}, {of} {offsets}",
        ]
        name = f"llvm.masked.gather.v{text.lanes}{text.suffix(dtype)}.v{text.lanes}p0"
        pointers = f"<{text.lanes} x ptr>"
        text.declare(name, text.vector(dtype), [pointers, text.vector("bool"), text.vector(dtype)])
        arguments = (
            f"{pointers} align {text.bytes(dtype)} {places}, {text.vector('bool')} splat (i1 true), "
            f"{text.vector(dtype)} poison"
        )
        return Lane(text.work([*lines, f"call {text.vector(dtype)} @{name}({arguments})"], dtype), dtype)

    def put_concatenate(self, params: Any, given: list[Value], out: Array, kinds: Any) -> Value:
        return self.joined(given, params["axis"], out)

    def put_stack(self, params: Any, given: list[Value], out: Array, kinds: Any) -> Value:
        return self.joined(given, params["axis"], out)

    def put_pad(self, params: Any, given: list[Value], out: Array, kinds: Any) -> Value:
        one, filling = given
        (before, after, between), *others = params["padding"]
        if between or before < 0 or after < 0 or any(any(rest) for rest in others):
            raise Unsupported("a large array that is padded otherwise than with rows before and behind it")
        lane = in_registers(self.text, filling).ravel()[0]
        ends = [_filled(lane, (count, *out.shape[1:])) for count in (before, after)]
        return self.joined([part for part in (ends[0], one, ends[1]) if size_of(part)], 0, out)

    def joined(self, given: list[Value], axis: int, out: Array) -> Value:
        """Large arrays one after the other."""
        if axis != 0:
            raise Unsupported("large arrays put together along another axis than the first")
        if len(given) == 1:
            return self.put_reshape({}, given, out, ())
        room = Stored(self.text.reserve(int(np.prod(out.shape)), out.dtype), out.shape, out.dtype, own=True)
        start = 0
        for one in given:
            copy(self.text, room, start, one)
            start += size_of(one)
        return room

    def folded(self, name: str, one: Value, dtype: str) -> Value:
        """A large array, all of it, one number after the other."""

        def at(index: str) -> Lane:
            return in_registers(self.text, row(self.text, flat, index, (), dtype)).ravel()[0]

        size = size_of(one)
        flat = self.put_reshape({}, [one], Array((size,), dtype), ()) if isinstance(one, Stored) else one
        loop = Loop(self.text, [held(at("0"))], "fold")
        now = at(self.text.assign(f"add i64 {loop.count}, 1"))
        loop.end_after(size - 1, [held(ELEMENTWISE[name](self.text, dtype, loop.carry[0].ravel()[0], now))])
        return loop.carried()[0]

    def reduced(self, name: str, given: list[Value], axes: Sequence[int], out: Array) -> Value:
        if size_of(given[0]) > SMALL and out.shape == () and not is_known(given[0]):
            return self.folded(name, given[0], out.dtype)
        lanes = np.asarray(in_registers(self.text, given[0]))
        if lanes.size == 0:
            raise Unsupported("the sum of no numbers")
        moved = np.moveaxis(lanes, axes, range(len(axes))).reshape(-1, *out.shape)
        total = moved[0]
        operation = ELEMENTWISE[name]
        for more in moved[1:]:
            flat = [
                operation(self.text, out.dtype, one, other)
                for one, other in zip(np.ravel(total), np.ravel(more), strict=True)
            ]
            total = np.asarray(held(flat, out.shape))
        return held(list(np.ravel(total)), out.shape)

    def put_dot_general(self, params: Any, given: list[Value], out: Array, kinds: Any) -> Value:
        (left_axes, right_axes), (left_batch, right_batch) = params["dimension_numbers"]
        if left_batch or right_batch or set(kinds) != {out.dtype} or out.dtype == "bool":
            raise Unsupported("products of matrices in batches, of truth values, or of different kinds of numbers")
        left, right = (np.asarray(in_registers(self.text, one)) for one in given)
        count = int(np.prod([left.shape[axis] for axis in left_axes]))
        rows = np.moveaxis(left, left_axes, range(-len(left_axes), 0)).reshape(-1, count)
        columns = np.moveaxis(right, right_axes, range(len(right_axes))).reshape(count, -1)
        put = ELEMENTWISE
        found = []
        for one in rows:
            for other in columns.T:
                total = put["mul"](self.text, out.dtype, one[0], other[0])
                for k in range(1, count):
                    product = put["mul"](self.text, out.dtype, one[k], other[k])
                    total = put["add"](self.text, out.dtype, total, product)
                found.append(total)
        return held(found, out.shape)

    @staticmethod
    def shape_of(value: Value) -> tuple[int, ...]:
        return tuple(value.shape)

    # Loops.

    def carried(self, value: Value) -> Held:
        if isinstance(value, Stored) or size_of(value) > SMALL:
            raise Unsupported(f"an array of the shape {value.shape} carried from step to step")
        return in_registers(self.text, value)

    def scan(self, params: dict[str, Any], given: list[Value], out: Sequence[Array]) -> list[Value]:
        text = self.text
        fixed, carry = params["constants"], params["carry"]
        length, backward = params["length"], params["backward"]
        jaxpr, consts = opened(params["program"])
        known = _constants(consts)
        start = [self.carried(one) for one in given[fixed : fixed + carry]]
        series = given[fixed + carry :]
        kinds = [_array(one.aval) for one in jaxpr.invars[fixed + carry :]]
        kept = out[carry:]
        if length == 0:
            raise Unsupported("a loop of no steps")
        series = [
            one if isinstance(one, Filled) else in_memory(text, one, (length, *kind.shape), kind.dtype)
            for one, kind in zip(series, kinds, strict=True)
        ]
        rooms = [Stored(text.reserve(int(np.prod(one.shape)), one.dtype), one.shape, one.dtype, True) for one in kept]
        loop = Loop(text, start, "scan")
        index = loop.count
        if backward:
            index = text.assign(f"sub i64 {length - 1}, {index}")
        now = [row(text, one, index, kind.shape, kind.dtype) for one, kind in zip(series, kinds, strict=True)]
        found = self.program(jaxpr, known, [*given[:fixed], *loop.carry, *now])
        for room, one in zip(rooms, found[carry:], strict=True):
            write(text, room, index, one)
        loop.end_after(length, [self.carried(one) for one in found[:carry]])
        return [*loop.carried(), *rooms]

    def repeat(self, params: dict[str, Any], given: list[Value]) -> list[Value]:
        text = self.text
        cond_fixed, body_fixed = params["test_constants"], params["body_constants"]
        tests, bodies = given[:cond_fixed], given[cond_fixed : cond_fixed + body_fixed]
        start = [self.carried(one) for one in given[cond_fixed + body_fixed :]]
        loop = Loop(text, start, "while", sure=False)
        going = in_registers(text, self.closed(params["test"], [*tests, *loop.carry])[0]).ravel()[0]
        inside, after = text.new_label("body"), text.new_label("end")
        # A lane that is done keeps what it has while others go on.
        some, chosen = text.any(going)
        text.branch(some, inside, after)
        text.label(inside)
        text.only(chosen)
        found = self.closed(params["body"], [*bodies, *loop.carry])
        new = [
            held(
                [
                    select(text, one.dtype, going, was, one)
                    for was, one in zip(old.ravel(), self.carried(value).ravel(), strict=True)
                ],
                old.shape,
            )
            for old, value in zip(loop.carry, found, strict=True)
        ]
        loop.again(new)
        text.label(after)
        return list(loop.carried())

    def choice(self, params: dict[str, Any], given: list[Value]) -> list[Value]:
        which, rest = given[0], given[1:]
        branches = params["branches"]
        if is_known(which):
            return self.closed(branches[min(max(_whole(which), 0), len(branches) - 1)], rest)
        number = in_registers(self.text, which).ravel()[0]
        found = [[self.carried(one) for one in self.closed(branch, rest)] for branch in branches]
        return [
            held(
                [
                    select(self.text, each[0].dtype, number, *each)
                    for each in zip(*(o.ravel() for o in of), strict=True)
                ],
                of[0].shape,
            )
            for of in zip(*found, strict=True)
        ]


def translate(
    program: Any,
    own: Sequence[bool],
    lanes: int,
    estimates: bool = False,
    vectors: int = VECTORS,
    mask: str = "i1",
) -> Translated:
    """`program` is `jax.make_jaxpr` of one member; `own[k]` says whether argument k differs from member to member.

    Such an argument is a number. `estimates`: 1/x by AVX-512's estimate. `vectors`: of a
    group, at most. `mask`: LLVM's kind of a truth value in memory. Raises Unsupported with what cannot be translated.
    """
    text = Text(lanes, estimates, vectors, mask)
    put = _Translation(text)
    arguments = [_array(aval) for aval in program.in_avals]
    shared: list[Value | None] = []
    places = {True: 0, False: 0}
    pointers = []
    for number, (argument, mine) in enumerate(zip(arguments, own, strict=True)):
        of = "own" if mine else "shared"
        slot = text.assign(f"getelementptr inbounds ptr, ptr %{of}, i64 {places[mine]}")
        pointers.append(text.assign(f"load ptr, ptr {slot}"))
        places[mine] += 1
        if mine:
            if argument.shape != ():
                raise Unsupported("a member's own argument that is an array")
            shared.append(None)
            continue
        whole = Stored(pointers[number], argument.shape, argument.dtype, own=False)
        shared.append(in_registers(text, whole) if whole.size <= SMALL else whole)
    outputs = []
    for number in range(len(program.out_avals)):
        slot = text.assign(f"getelementptr inbounds ptr, ptr %results, i64 {number}")
        outputs.append(text.assign(f"load ptr, ptr {slot}"))
    group = text.open("groups", sure=True)
    text.declare("llvm.smin.i64", "i64", ["i64", "i64"])
    text.put(f"%vectors = call i64 @llvm.smin.i64(i64 {text.assign(f'sub i64 %last, {group}')}, i64 {vectors})")
    first = text.assign(f"mul i64 {group}, {lanes}")
    given: list[Value] = []
    for pointer, argument, value in zip(pointers, arguments, shared, strict=True):
        if value is None:
            value = held(text.load_lanes(text.address(pointer, first, argument.dtype), argument.dtype))
        given.append(value)
    results = tuple(_array(aval) for aval in program.out_avals)
    # What no result asks for may well be what has no translation.
    asked, _ = partial_eval.dce_jaxpr(program.jaxpr, [True] * len(results), instantiate=True)
    found = put.program(asked, _constants(program.consts), given)
    for pointer, result, answer in zip(outputs, results, found, strict=True):
        _leave(text, pointer, first, result, answer)
    following = text.assign(f"add i64 {group}, {vectors}")
    text.branch(text.assign(f"icmp slt i64 {following}, %last"), "groups", "finished")
    text.close(group, following, "entry", "%first")
    text.label("finished")
    text.put("ret void")
    head = (
        f"define void @{NAME}(ptr noalias %shared, ptr noalias %own, ptr noalias %results, ptr noalias %scratch, "
        "i64 %first, i64 %last) #0 {\nentry:"
    )
    # The processor takes what it has of 512 bits. Without the alignment what does not fit its registers would lie across
    # cache lines.
    attributes = 'attributes #0 = { nounwind alignstack=64 "prefer-vector-width"="512" "min-legal-vector-width"="512" }'
    body, kept = laid_out(text.levels[0].items, text.names, lanes, vectors, text.scratch)
    lines = [*text.globals, *sorted(text.declared.values()), head, *body, "}", attributes]
    return Translated("\n".join(lines) + "\n", lanes, results, text.scratch + kept)


def _leave(text: Text, pointer: str, first: str, result: Array, value: Value) -> None:
    """A result where the caller finds it: members one after the other."""
    size = int(np.prod(result.shape))
    if size == 0:
        return
    if size == 1:
        text.store_lanes(in_registers(text, value).ravel()[0], text.address(pointer, first, result.dtype))
        return
    kept = "int8" if result.dtype == "bool" else result.dtype
    rows = in_memory(text, value, result.shape, result.dtype) if not isinstance(value, Filled) else value
    base = text.address(pointer, text.assign(f"mul i64 {first}, {size}"), result.dtype)
    loop = Loop(text, [], "leave")
    lane = in_registers(text, row(text, rows, loop.count, (), result.dtype)).ravel()[0]
    if result.dtype == "bool":
        lane = ELEMENTWISE["convert_element_type"](text, kept, lane)
    kind, where, at = scalar_type(kept), text.fresh("p"), text.fresh("p")
    lines = [
        f"{at} = mul i64 %at, {size}",
        f"{where} = getelementptr inbounds {kind}, ptr {text.address(base, loop.count, kept)}, i64 {at}",
    ]
    for k in range(text.lanes):
        one, there = text.fresh("r"), text.fresh("p")
        lines += [
            f"{one} = extractelement {text.vector(kept)} {lane.name}, i64 {k}",
            f"{there} = getelementptr inbounds {kind}, ptr {where}, i64 {k * size}",
            f"store {kind} {one}, ptr {there}",
        ]
    text.work(lines)
    loop.end_after(size)
