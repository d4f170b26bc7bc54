"""A traced program of one run -> the text of a loop over groups of runs, a lane each."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import prod
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax.interpreters import partial_eval

from smajax.engine.arithmetic import ELEMENTWISE, Operation, select
from smajax.engine.array_operations import (
    MOVES,
    OPERATIONS,
    REDUCTIONS,
    at_known_places,
    filled,
    moved,
    only_lane,
    parted,
    reduced,
    whole_number,
)
from smajax.engine.by_numpy import computed
from smajax.engine.equations import Read, Step, array_of, note, read_of, steps_of
from smajax.engine.expansions import EXPANSIONS
from smajax.engine.jax_versions import TABLE, expanded, opened
from smajax.engine.loop import Loop
from smajax.engine.memory import in_memory, in_registers, mapped, row, write
from smajax.engine.phases import laid_out
from smajax.engine.text import NAME, Array, Lane, Text, Unsupported, scalar_type
from smajax.engine.values import SMALL, Filled, Held, Stored, Value, held, is_known, name_of, size_of

OF_TWO_KINDS = ("select_n", "convert_element_type", "bitcast_convert_type")
VECTORS = 6  # of a group: while one waits for a result others go on
CALLS = {
    name for name, own in TABLE.items() if "program" in own and name != "scan"
}  # they stand for a program of their own
Prepared = tuple[tuple[Step, ...], list[Read]]  # the equations of a program, and what it ends with
SAME = (
    "optimization_barrier",
    "name",
    "random_wrap",
    "random_unwrap",
)  # what says something to XLA, or to a derivative, and changes nothing


@dataclass(frozen=True)
class Translated:
    """The text of `void runs(ptr shared, ptr own, ptr results, ptr scratch, i64 first, i64 last)`, over vectors of runs."""

    text: str
    lanes: int  # runs of a vector
    results: tuple[Array, ...]
    scratch: int  # bytes a thread needs
    vectors: int = 1  # of a group


def _numbers(known: Any) -> np.ndarray:
    """A known array; of random keys their words."""
    keys = isinstance(known, jax.Array) and jnp.issubdtype(known.dtype, jax.dtypes.prng_key)
    return np.asarray(jax.random.key_data(known) if keys else known)


def _constants(consts: Sequence[Any]) -> list[Value]:
    try:
        return [_numbers(one) for one in consts]
    except TypeError:
        raise Unsupported("a constant that is no array of numbers") from None


def _as_shape(lanes: Held, shape: tuple[int, ...]) -> np.ndarray:
    """The lanes of an array of that shape, one after the other."""
    alike = lanes if lanes.shape == shape else np.broadcast_to(np.asarray(lanes), shape)
    return alike.ravel()


def _any_unknown(given: Sequence[Value]) -> bool:
    for one in given:
        if type(one) is Held:
            return True
    return not all(map(is_known, given))


def _number(text: Text, value: Value) -> Lane | None:
    """The lane of a number in registers, or of one that is known; None of anything else."""
    # Asked for every argument of every operation: without a call that can be spared.
    if type(value) is Held:
        return value.item() if value.shape == () else None
    if type(value) is np.ndarray and value.shape == ():
        return text.constant(value[()], name_of(value.dtype))
    return None


class _Translation:
    def __init__(self, text: Text) -> None:
        self.text = text
        # By the number of a program, which it has as long as it is kept.
        self._prepared: dict[int, tuple[Any, Prepared]] = {}

    def program(self, jaxpr: Any, consts: Sequence[Value], given: Sequence[Value]) -> list[Value]:
        """The results of a program of which the arguments are `given`."""
        steps, last = self.prepared(jaxpr)
        names: dict[Any, Value] = dict(zip([*jaxpr.constvars, *jaxpr.invars], [*consts, *given], strict=True))
        for step in steps:
            arguments = [names[one] if known is None else known for one, known in step.reads]
            try:
                result = self.equation(step, arguments)
            except Exception as error:
                note(error, step.equation)
                raise
            for variable, value in zip(step.equation.outvars, result, strict=True):
                names[variable] = value
        return [names[one] if known is None else known for one, known in last]

    def prepared(self, jaxpr: Any) -> Prepared:
        """The steps of a program and what it ends with, read once."""
        found = self._prepared.get(id(jaxpr))
        if found is None:
            found = self._prepared[id(jaxpr)] = jaxpr, (steps_of(jaxpr), [read_of(one) for one in jaxpr.outvars])
        return found[1]

    def closed(self, program: Any, given: Sequence[Value]) -> list[Value]:
        jaxpr, consts = opened(program)
        return self.program(jaxpr, _constants(consts), given)

    def equation(self, step: Step, given: list[Value]) -> list[Value]:
        equation, name, params = step.equation, step.name, step.params
        if step.operation is not None and step.out is not None and _any_unknown(given):
            step.check()
            return [self.elementwise(name, params, given, step.operation, step.out)]
        if name in SAME:
            return given
        if name in CALLS:
            return self.closed(params["program"], given)
        if name == "scan":
            return self.scan(params, given, [array_of(one.aval) for one in equation.outvars])
        if name == "while":
            return self.repeat(params, given)
        if name == "cond":
            return self.choice(params, given)
        if name in EXPANSIONS and not (name in ("threefry2x32", "erf_inv") and all(map(is_known, given))):
            return self.closed(expanded(equation), given)
        if all(map(is_known, given)):
            return [_numbers(one) for one in computed(equation, given)]
        out = array_of(equation.outvars[0].aval)
        kinds = [name_of(one.aval.dtype) for one in equation.invars]
        if name == "gather" and "FILL" in str(params["mode"]) and not at_known_places(name, given):
            raise Unsupported("a gathering that puts something in the place of what is beyond the ends")
        if name in REDUCTIONS:
            step.check()
            return [reduced(self.text, REDUCTIONS[name], given, params["axes"], out)]
        small = all(size_of(one) <= SMALL for one in given)
        small &= all(prod(one.aval.shape) <= SMALL for one in equation.outvars)
        if name in MOVES and small and at_known_places(name, given):
            keys = [name_of(one.aval.dtype).startswith("key<") for one in equation.invars]
            return moved(self.text, equation.primitive, equation.params, given, keys)
        if name in MOVES and len(set(map(only_lane, given[: 1 if MOVES[name] else None]))) == 1:
            lane = only_lane(given[0])
            if lane is not None and name not in ("dynamic_update_slice", "scatter", "split"):
                return [filled(lane, out.shape)]
        if name == "split":
            return parted(self.text, given[0], params, [array_of(one.aval) for one in equation.outvars])
        operation = OPERATIONS.get(name)
        if operation is None:
            program = expanded(equation)
            if program is None:
                raise Unsupported(f"the operation `{name}`")
            return self.closed(program, given)
        return [operation(self.text, params, given, out, kinds)]

    # Arithmetic, and the shapes of arrays.

    def elementwise(
        self, name: str, params: dict[str, Any], given: list[Value], operation: Operation, out: Array
    ) -> Value:
        scalar_type(out.dtype)
        if name == "convert_element_type" and isinstance(given[0], Stored) and given[0].dtype == out.dtype:
            return given[0]

        def put(*lanes: Lane) -> Lane:
            if name not in OF_TWO_KINDS:
                for one in lanes:
                    if one.dtype != lanes[0].dtype:
                        raise Unsupported(f"`{name}` of different kinds of numbers")
            return operation(self.text, out.dtype, *lanes, **params)

        if out.shape == ():
            # Nearly all there is: without the ways of arrays.
            numbers = []
            for one in given:
                number = _number(self.text, one)
                if number is None:
                    break
                numbers.append(number)
            else:
                return held(put(*numbers))
        size = prod(out.shape)
        if size > SMALL:
            if all(isinstance(one, Filled) or (is_known(one) and size_of(one) == 1) for one in given):
                lanes = [
                    one.lane if isinstance(one, Filled) else in_registers(self.text, one).ravel()[0] for one in given
                ]
                return Filled(put(*lanes), out.shape)
            if any(size_of(one) not in (1, size) for one in given):
                raise Unsupported(f"`{name}` of arrays of the shapes {[tuple(one.shape) for one in given]}")
            room = Stored(self.text.reserve(size, out.dtype), out.shape, out.dtype, own=True)
            mapped(self.text, room, 0, put, given)
            return room
        # A predicate, the ends of `clamp` and axes of length one may stand for all.
        flat = [_as_shape(in_registers(self.text, one), out.shape) for one in given]
        return held([put(*(one[k] for one in flat)) for k in range(size)], out.shape)

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
        kinds = [array_of(one.aval) for one in jaxpr.invars[fixed + carry :]]
        stacked = out[carry:]
        if length == 0:
            raise Unsupported("a loop of no steps")
        series = [
            one if isinstance(one, Filled) else in_memory(text, one, (length, *kind.shape), kind.dtype)
            for one, kind in zip(series, kinds, strict=True)
        ]
        rooms = [Stored(text.reserve(prod(one.shape), one.dtype), one.shape, one.dtype, True) for one in stacked]
        loop = Loop(text, start, "scan")
        index = loop.count
        if backward:
            index = text.assign(f"sub i64 {length - 1}, {index}")
        now = [row(text, one, index, kind.shape, kind.dtype) for one, kind in zip(series, kinds, strict=True)]
        result = self.program(jaxpr, known, [*given[:fixed], *loop.carry, *now])
        for room, one in zip(rooms, result[carry:], strict=True):
            write(text, room, index, one)
        loop.end_after(length, [self.carried(one) for one in result[:carry]])
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
        result = self.closed(params["body"], [*bodies, *loop.carry])
        new = [
            held(
                [
                    select(text, one.dtype, going, was, one)
                    for was, one in zip(old.ravel(), self.carried(value).ravel(), strict=True)
                ],
                old.shape,
            )
            for old, value in zip(loop.carry, result, strict=True)
        ]
        loop.again(new)
        text.label(after)
        return list(loop.carried())

    def choice(self, params: dict[str, Any], given: list[Value]) -> list[Value]:
        which, rest = given[0], given[1:]
        branches = params["branches"]
        if is_known(which):
            return self.closed(branches[min(max(whole_number(which), 0), len(branches) - 1)], rest)
        number = in_registers(self.text, which).ravel()[0]
        result = [[self.carried(one) for one in self.closed(branch, rest)] for branch in branches]
        return [
            held(
                [
                    select(self.text, each[0].dtype, number, *each)
                    for each in zip(*(o.ravel() for o in of), strict=True)
                ],
                of[0].shape,
            )
            for of in zip(*result, strict=True)
        ]


def translate(
    program: Any,
    own: Sequence[bool],
    lanes: int,
    estimates: bool = False,
    vectors: int = VECTORS,
    mask: str = "i1",
) -> Translated:
    """`program` is `jax.make_jaxpr` of one run; `own[k]` says whether argument k differs from run to run.

    Such an argument is a number. `estimates`: 1/x by AVX-512's estimate. `vectors`: of a
    group, at most. `mask`: LLVM's kind of a truth value in memory. Raises Unsupported with what cannot be translated.
    """
    text = Text(lanes, estimates, vectors, mask)
    put = _Translation(text)
    arguments = [array_of(aval) for aval in program.in_avals]
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
                raise Unsupported("a run's own argument that is an array")
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
    results = tuple(array_of(aval) for aval in program.out_avals)
    # What no result asks for may well be what has no translation.
    needed, _ = partial_eval.dce_jaxpr(program.jaxpr, [True] * len(results), instantiate=True)
    outcome = put.program(needed, _constants(program.consts), given)
    for pointer, result, answer in zip(outputs, results, outcome, strict=True):
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
    body, functions, room = laid_out(text.levels[0].items, text.names, text.uniform, lanes, vectors, text.scratch)
    lines = [*text.globals, *sorted(text.declared.values()), *functions, head, *body, "}", attributes]
    return Translated("\n".join(lines) + "\n", lanes, results, text.scratch + room, vectors)


def _leave(text: Text, pointer: str, first: str, result: Array, value: Value) -> None:
    """A result where the caller finds it: runs one after the other."""
    size = prod(result.shape)
    if size == 0:
        return
    if size == 1:
        text.store_lanes(in_registers(text, value).ravel()[0], text.address(pointer, first, result.dtype))
        return
    stored = "int8" if result.dtype == "bool" else result.dtype
    rows = in_memory(text, value, result.shape, result.dtype) if not isinstance(value, Filled) else value
    base = text.address(pointer, text.assign(f"mul i64 {first}, {size}"), result.dtype)
    loop = Loop(text, [], "leave")
    lane = in_registers(text, row(text, rows, loop.count, (), result.dtype)).ravel()[0]
    if result.dtype == "bool":
        lane = ELEMENTWISE["convert_element_type"](text, stored, lane)
    kind, where, at = scalar_type(stored), text.fresh("p"), text.fresh("p")
    lines = [
        f"{at} = mul i64 %at, {size}",
        f"{where} = getelementptr inbounds {kind}, ptr {text.address(base, loop.count, stored)}, i64 {at}",
    ]
    for k in range(text.lanes):
        one, there = text.fresh("r"), text.fresh("p")
        lines += [
            f"{one} = extractelement {text.vector(stored)} {lane.name}, i64 {k}",
            f"{there} = getelementptr inbounds {kind}, ptr {where}, i64 {k * size}",
            f"store {kind} {one}, ptr {there}",
        ]
    text.work(lines)
    loop.end_after(size)
