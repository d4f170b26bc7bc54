"""The equations of a traced program, translated one after the other: arithmetic, what moves numbers about, loops and branches."""

from __future__ import annotations

from collections.abc import Sequence
from math import prod
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from smajax.engine.arithmetic import Operation, select
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
from smajax.engine.directions import Dependence, Several, any_several, apart, of_direction, together
from smajax.engine.equations import Read, Step, array_of, note, read_of, steps_of
from smajax.engine.expansions import EXPANSIONS
from smajax.engine.jax_versions import CALLS, SAME, expanded, opened
from smajax.engine.loop import Loop
from smajax.engine.memory import in_memory, in_registers, mapped, row, write
from smajax.engine.text import Array, Lane, Text, Unsupported, scalar_type
from smajax.engine.values import SMALL, Filled, Held, Stored, Value, held, is_known, name_of, size_of

OF_TWO_KINDS = ("select_n", "convert_element_type", "bitcast_convert_type")
Prepared = tuple[tuple[Step, ...], list[Read]]  # the equations of a program, and what it ends with


def _numbers(known: Any) -> np.ndarray:
    """A known array; of random keys their words."""
    keys = isinstance(known, jax.Array) and jnp.issubdtype(known.dtype, jax.dtypes.prng_key)
    return np.asarray(jax.random.key_data(known) if keys else known)


def constants(consts: Sequence[Any]) -> list[Value]:
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


class Translation:
    """The equations of programs, one after the other, as lines of `text`; values of several directions as `Several`."""

    def __init__(self, text: Text, directions: int = 1) -> None:
        self.text, self.directions, self.dependence = text, directions, Dependence()
        # By the number of a program, which it has as long as it is kept.
        self._prepared: dict[int, tuple[Any, Prepared]] = {}

    def program(self, jaxpr: Any, consts: Sequence[Value], given: Sequence[Several | Value]) -> list[Several | Value]:
        """The results of a program of which the arguments are `given`."""
        steps, last = self.prepared(jaxpr)
        names: dict[Any, Several | Value] = dict(zip([*jaxpr.constvars, *jaxpr.invars], [*consts, *given], strict=True))
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

    def closed(self, program: Any, given: Sequence[Several | Value]) -> list[Several | Value]:
        jaxpr, consts = opened(program)
        return self.program(jaxpr, constants(consts), given)

    def equation(self, step: Step, given: list[Several | Value]) -> list[Several | Value]:
        name, params = step.name, step.params
        if step.operation is None:  # no arithmetic, which nearly all is
            if name in SAME:
                return given
            if name in CALLS:
                return self.closed(params["program"], given)
            if name == "scan":
                return self.scan(params, given, [array_of(one.aval) for one in step.equation.outvars])
            if name == "while":
                return self.repeat(params, given)
            if name == "cond":
                return self.choice(params, given)
        if any_several(given):
            each = [self.operation(step, of_direction(given, k)) for k in range(self.directions)]
            return [Several(one) for one in zip(*each, strict=True)]
        return list(self.operation(step, of_direction(given, 0)))

    def operation(self, step: Step, given: list[Value]) -> list[Value]:
        """The results of an equation without a program of its own, in one direction."""
        equation, name, params = step.equation, step.name, step.params
        if step.operation is not None and step.out is not None and _any_unknown(given):
            step.check()
            return [self.elementwise(name, params, given, step.operation, step.out)]
        if name in EXPANSIONS and not (name in ("threefry2x32", "erf_inv") and all(map(is_known, given))):
            return of_direction(self.closed(expanded(equation), given), 0)
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
            return of_direction(self.closed(program, given), 0)
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

    def scan(self, params: dict[str, Any], given: list[Several | Value], out: Sequence[Array]) -> list[Several | Value]:
        text, count = self.text, self.directions
        fixed, carry = params["constants"], params["carry"]
        length, backward = params["length"], params["backward"]
        jaxpr, consts = opened(params["program"])
        known = constants(consts)
        reads = [isinstance(one, Several) for one in given]
        several = self.dependence.of_scan(jaxpr, reads, fixed, carry)
        start = [self.carried(one) for one in apart(given[fixed : fixed + carry], several[:carry], count)]
        of_series = reads[fixed + carry :]
        kinds = apart([array_of(one.aval) for one in jaxpr.invars[fixed + carry :]], of_series, count)
        stacked = apart(out[carry:], several[carry:], count)
        if length == 0:
            raise Unsupported("a loop of no steps")
        series = [
            one if isinstance(one, Filled) else in_memory(text, one, (length, *kind.shape), kind.dtype)
            for one, kind in zip(apart(given[fixed + carry :], of_series, count), kinds, strict=True)
        ]
        rooms = [Stored(text.reserve(prod(one.shape), one.dtype), one.shape, one.dtype, True) for one in stacked]
        loop = Loop(text, start, "scan")
        index = loop.count
        if backward:
            index = text.assign(f"sub i64 {length - 1}, {index}")
        now = [row(text, one, index, kind.shape, kind.dtype) for one, kind in zip(series, kinds, strict=True)]
        arguments = [*given[:fixed], *together([*loop.carry, *now], [*several[:carry], *of_series], count)]
        result = self.program(jaxpr, known, arguments)
        for room, one in zip(rooms, apart(result[carry:], several[carry:], count), strict=True):
            write(text, room, index, one)
        loop.end_after(length, [self.carried(one) for one in apart(result[:carry], several[:carry], count)])
        return together([*loop.carried(), *rooms], several, count)

    def repeat(self, params: dict[str, Any], given: list[Several | Value]) -> list[Several | Value]:
        text, count = self.text, self.directions
        cond_fixed, body_fixed = params["test_constants"], params["body_constants"]
        tests, bodies = given[:cond_fixed], given[cond_fixed : cond_fixed + body_fixed]
        first = given[cond_fixed + body_fixed :]
        reads = [isinstance(one, Several) for one in given]
        several = self.dependence.of_while(opened(params["body"])[0], reads, cond_fixed, body_fixed)
        start = [self.carried(one) for one in apart(first, several, count)]
        loop = Loop(text, start, "while", sure=False)
        (test,) = self.closed(params["test"], [*tests, *together(loop.carry, several, count)])
        going = in_registers(text, _of_all(test, "a loop that ends")).ravel()[0]
        inside, after = text.new_label("body"), text.new_label("end")
        # A lane that is done keeps what it has while others go on.
        some, chosen = text.any(going)
        text.branch(some, inside, after)
        text.label(inside)
        text.only(chosen)
        result = apart(self.closed(params["body"], [*bodies, *together(loop.carry, several, count)]), several, count)
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
        return together(loop.carried(), several, count)

    def choice(self, params: dict[str, Any], given: list[Several | Value]) -> list[Several | Value]:
        which, rest = _of_all(given[0], "a branch that is taken"), given[1:]
        branches = params["branches"]
        if is_known(which):
            return self.closed(branches[min(max(whole_number(which), 0), len(branches) - 1)], rest)
        number = in_registers(self.text, which).ravel()[0]
        found = [self.closed(branch, rest) for branch in branches]
        several = [any(isinstance(one, Several) for one in of) for of in zip(*found, strict=True)]
        result = [[self.carried(one) for one in apart(one, several, self.directions)] for one in found]
        chosen = [
            held(
                [
                    select(self.text, each[0].dtype, number, *each)
                    for each in zip(*(o.ravel() for o in of), strict=True)
                ],
                of[0].shape,
            )
            for of in zip(*result, strict=True)
        ]
        return together(chosen, several, self.directions)


def _of_all(value: Several | Value, what: str) -> Value:
    """What is the same in all directions. Raises Unsupported."""
    if isinstance(value, Several):
        raise Unsupported(f"{what} otherwise in each direction")
    return value
