"""A traced program (a jaxpr) -> the statements of a C function (`statements`).

The front end is the native engine's (`engine.jax_versions`, `engine.expansions`): what a primitive is called, what it stands for. Here every
number is one C name; loops and branches stay loops and branches.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from math import prod
from typing import Any

import jax.extend as jex
import numpy as np

from smajax.engine.array_operations import MOVES, REDUCTIONS
from smajax.engine.by_numpy import computed
from smajax.engine.expansions import EXPANSIONS
from smajax.engine.jax_versions import TABLE, expanded, kind_of, opened, parameters_of, refuse_unread
from smajax.engine.text import Unsupported
from smajax.engine.values import Held, held
from smajax.export.arrays import Value, is_known, moved, numbers_of, part_at, product, reduced, settled, with_entry
from smajax.export.errors import NoTranslation, part_of
from smajax.export.loop_bounds import most_rounds
from smajax.export.operations import ELEMENTWISE
from smajax.export.statements import Branch, Cell, Loop, Number, Store, Writer, literal

CALLS = {name for name, own in TABLE.items() if "program" in own and name != "scan"}
SAME = ("optimization_barrier", "name")


class Translation:
    """Statements of programs, written one after the other into one function."""

    def __init__(self, writer: Writer) -> None:
        self.writer = writer

    def closed(self, program: Any, given: Sequence[Value]) -> list[Value]:
        """The results of a program with its constants. Raises NoTranslation, with the part of the model it is of."""
        jaxpr, consts = opened(program)
        return self.program(jaxpr, [np.asarray(one) for one in consts], given)

    def program(self, jaxpr: Any, consts: Sequence[Value], given: Sequence[Value]) -> list[Value]:
        """The results of a program of which the arguments are `given`."""
        names: dict[Any, Value] = {}

        def read(atom: Any) -> Value:
            if isinstance(atom, jex.core.Literal):
                return np.asarray(atom.val, dtype=kind_of(atom.aval)[1])
            return names[atom]

        for variable, value in zip([*jaxpr.constvars, *jaxpr.invars], [*consts, *given], strict=True):
            names[variable] = value
        for equation in jaxpr.eqns:
            try:
                result = self.equation(equation, [read(one) for one in equation.invars])
            except (NoTranslation, Unsupported) as error:
                if isinstance(error, NoTranslation) and error.part:
                    raise
                what = error.what if isinstance(error, NoTranslation) else str(error.args[0])
                raise NoTranslation(what, part_of(equation)) from None
            for variable, value in zip(equation.outvars, result, strict=True):
                names[variable] = value
        return [read(one) for one in jaxpr.outvars]

    def equation(self, equation: Any, given: list[Value]) -> list[Value]:
        """The results of one operation."""
        name, params = equation.primitive.name, parameters_of(equation)
        if name in SAME:
            return given
        if name in CALLS:
            return self.closed(params["program"], given)
        if name == "scan":
            return self.scan(params, given)
        if name == "while":
            return self.repeat(params, given)
        if name == "cond":
            return self.choice(params, given)
        if name in EXPANSIONS:
            return self.closed(expanded(equation), given)
        if all(is_known(one) for one in given):
            return self.folded(equation, given)
        shape, dtype = kind_of(equation.outvars[0].aval)
        if name in ELEMENTWISE or name in REDUCTIONS:
            refuse_unread(equation)
        if name in ELEMENTWISE:
            return [self.elementwise(name, params, given, shape, dtype)]
        if name in REDUCTIONS:
            return [reduced(self.writer, name, given[0], tuple(params["axes"]), dtype)]
        if name == "dot_general":
            return [product(self.writer, given[0], given[1], params["dimension_numbers"], dtype)]
        if name in MOVES:
            found = self.at_unknown_place(name, given, shape)
            return [found] if found is not None else moved(equation.primitive, equation.params, given)
        if name in ("cumsum", "cumprod", "cummax", "cummin"):
            return [self.cumulative(name, equation.params, given[0], dtype)]
        program = expanded(equation)
        if program is None:
            raise NoTranslation(f"the operation `{name}`")
        return self.closed(program, given)

    def folded(self, equation: Any, given: list[Value]) -> list[Value]:
        """Of known numbers, computed now."""
        return [np.asarray(one) for one in computed(equation, [np.asarray(one) for one in given])]

    def elementwise(self, name: str, params: dict[str, Any], given: list[Value], shape: Any, dtype: str) -> Value:
        """Arithmetic, entry by entry; a predicate, the ends of `clamp` and axes of length one may stand for all."""
        flat = [np.broadcast_to(np.asarray(numbers_of(one)), shape).ravel() for one in given]
        operation = ELEMENTWISE[name]
        kinds = {one.dtype for one in (values[0] for values in flat if len(values))}
        if len(kinds) > 1 and name not in ("select_n", "convert_element_type"):
            raise NoTranslation(f"`{name}` of different kinds of numbers")
        result = []
        for k in range(prod(shape)):
            numbers = [values[k] for values in flat]
            if all(one.known for one in numbers) and name not in ("select_n", "convert_element_type"):
                result.append(self._known(name, params, numbers, dtype))
            else:
                result.append(operation(self.writer, dtype, *numbers, **params))
        return settled(held(result, shape))

    def _known(self, name: str, params: dict[str, Any], numbers: list[Number], dtype: str) -> Number:
        """One entry whose numbers are known, in an array of which others are not."""
        if name in ("add", "sub", "mul", "neg", "add_any"):
            values = [np.dtype(dtype).type(one.value) for one in numbers]
            if name == "neg":
                return literal(-values[0], dtype)
            with np.errstate(all="ignore"):
                both = {"add": np.add, "add_any": np.add, "sub": np.subtract, "mul": np.multiply}[name](*values)
            return literal(both, dtype)
        return ELEMENTWISE[name](self.writer, dtype, *numbers, **params)

    def at_unknown_place(self, name: str, given: list[Value], shape: tuple[int, ...]) -> Value | None:
        """A part of an array at a place that is known when the program runs alone; None for all else."""
        if name == "dynamic_slice" and not all(map(is_known, given[1:])):
            starts = [numbers_of(one).ravel()[0] for one in given[1:]]
            return part_at(self.writer, given[0], starts, shape)
        if (
            name == "gather"
            and not is_known(given[1])
            and given[0].ndim == 1
            and given[1].size == 1
            and prod(shape) == 1
        ):
            return part_at(self.writer, given[0], [given[1].ravel()[0]], (1,)).reshape(shape)
        if name == "dynamic_update_slice" and given[0].ndim == 1 and given[1].size == 1 and not is_known(given[2]):
            new = numbers_of(given[1]).ravel()[0]
            return with_entry(self.writer, given[0], given[2].ravel()[0], new)
        return None

    def cumulative(self, name: str, params: dict[str, Any], value: Value, dtype: str) -> Value:
        """Running sums and the like along one axis."""
        operation = ELEMENTWISE[{"cumsum": "add", "cumprod": "mul", "cummax": "max", "cummin": "min"}[name]]
        axis, own = params["axis"], numbers_of(value)
        front = [axis, *(k for k in range(own.ndim) if k != axis)]
        rows = own.transpose(front).reshape(own.shape[axis], -1).copy()
        order = list(range(len(rows)))[:: -1 if params["reverse"] else 1]
        for before, k in pairwise(order):
            for column, number in enumerate(rows[k]):
                rows[k, column] = operation(self.writer, dtype, rows[before, column], number)
        return rows.reshape([own.shape[k] for k in front]).transpose(np.argsort(front))

    # Loops and branches.

    def cells(self, start: Sequence[Value]) -> tuple[list[Cell], list[list[Cell]]]:
        """A variable for each number that is carried, all of them and by value."""
        grouped = []
        for value in start:
            own = list(numbers_of(value).ravel())
            grouped.append([Cell(self.writer.fresh("c"), one.dtype, one.text) for one in own])
        return [cell for cells in grouped for cell in cells], grouped

    def present(self, grouped: Sequence[list[Cell]], start: Sequence[Value]) -> list[Value]:
        """What the variables hold in the present round, by names that stay until its end."""
        result: list[Value] = []
        for cells, value in zip(grouped, start, strict=True):
            for cell in cells:
                self.writer.depth[cell.name] = len(self.writer.scopes) - 1  # it changes from round to round
            result.append(held([self.writer.assign(cell.name, cell.dtype) for cell in cells], value.shape))
        return result

    def after(self, grouped: Sequence[list[Cell]], start: Sequence[Value]) -> list[Value]:
        """What the variables hold after a loop, or behind branches."""
        for cell in (one for cells in grouped for one in cells):
            self.writer.depth[cell.name] = len(self.writer.scopes) - 1
        return [
            held([Number(cell.name, cell.dtype) for cell in cells], value.shape)
            for cells, value in zip(grouped, start, strict=True)
        ]

    def scan(self, params: dict[str, Any], given: list[Value]) -> list[Value]:
        """A loop of known length over rows of arrays."""
        writer, fixed, carried = self.writer, params["constants"], params["carry"]
        length, start, series = params["length"], given[fixed : fixed + params["carry"]], given[fixed + carried :]
        jaxpr, consts = opened(params["program"])
        if length == 0:
            raise NoTranslation("a loop of no steps")
        arrays = [writer.array(list(numbers_of(one).ravel())) if prod(one.shape) else "" for one in series]
        stacked = [kind_of(one.aval) for one in jaxpr.outvars[carried:]]
        rooms = [writer.room(length * prod(shape), dtype) if prod(shape) else "" for shape, dtype in stacked]
        flat, grouped = self.cells(start)
        writer.open(sure=True)
        index = writer.fresh("i")
        at = f"({length - 1} - {index})" if params["backward"] else index
        now: list[Value] = []
        for one, array in zip(series, arrays, strict=True):
            size, dtype = prod(one.shape[1:]), _dtype(one)
            entries = [writer.assign(f"{array}[{_place(at, size, k)}]", dtype) for k in range(size)]
            now.append(held(entries, tuple(one.shape[1:])))
        known = [np.asarray(one) for one in consts]
        result = self.program(jaxpr, known, [*given[:fixed], *self.present(grouped, start), *now])
        for cell, new in zip(flat, _flat(result[:carried]), strict=True):
            cell.new = [new.text]
        for room, (shape, _), value in zip(rooms, stacked, result[carried:], strict=True):
            for k, number in enumerate(numbers_of(value).ravel()):
                writer.put(Store(room, _place(at, prod(shape), k), number.text))
        body = writer.close()
        writer.put(Loop(flat, index, length, body=body))
        rows = []
        for room, (shape, dtype) in zip(rooms, stacked, strict=True):
            size = length * prod(shape)
            rows.append(held([Number(f"{room}[{k}]", dtype) for k in range(size)], (length, *shape)))
        return [*self.after(grouped, start), *rows]

    def repeat(self, params: dict[str, Any], given: list[Value]) -> list[Value]:
        """A loop while a test holds."""
        writer, tests = self.writer, params["test_constants"]
        bodies, start = given[tests : tests + params["body_constants"]], given[tests + params["body_constants"] :]
        rounds = most_rounds(params["test"], params["body"], given[:tests], start)
        flat, grouped = self.cells(start)
        writer.open(sure=False)
        now = self.present(grouped, start)
        going = numbers_of(self.closed(params["test"], [*given[:tests], *now])[0]).ravel()[0]
        before = list(writer.scopes[-1].items)
        result = self.closed(params["body"], [*bodies, *now])
        body = writer.close()[len(before) :]
        for cell, new in zip(flat, _flat(result), strict=True):
            cell.new = [new.text]
        writer.put(Loop(flat, before=before, test=going.text, rounds=rounds, body=body))
        return self.after(grouped, start)

    def choice(self, params: dict[str, Any], given: list[Value]) -> list[Value]:
        """One of several programs."""
        writer, which, rest = self.writer, given[0], given[1:]
        branches = params["branches"]
        if is_known(which):
            return self.closed(branches[min(max(int(np.asarray(which)), 0), len(branches) - 1)], rest)
        number = numbers_of(which).ravel()[0]
        bodies, results = [], []
        for branch in branches:
            writer.open(sure=False)
            results.append(self.closed(branch, rest))
            bodies.append(writer.close())
        flat, grouped = self.cells(results[0])
        for k, new in enumerate(zip(*map(_flat, results), strict=True)):
            flat[k].start, flat[k].new = "", [one.text for one in new]
        writer.put(Branch(number.text, flat, bodies))
        return self.after(grouped, results[0])


def _flat(values: Sequence[Value]) -> list[Number]:
    return [number for value in values for number in numbers_of(value).ravel()]


def _dtype(value: Value) -> str:
    return value.ravel()[0].dtype if isinstance(value, Held) else str(value.dtype)


def _place(row: str, size: int, k: int) -> str:
    """Entry k of a row of `size`."""
    if size == 1:
        return row
    return f"{size} * {row} + {k}" if k else f"{size} * {row}"
