"""What a program computes for several directions of one run: once what does not depend on them, each by each what does.

A derivative along four directions at one point costs less than half of four runs with one direction each: the solution of a step and the
slopes of its equations are the same for all of them.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from smajax.engine.jax_versions import SAME, TABLE, opened, parameters_of
from smajax.engine.values import Value

# Primitives with programs of their own.
PROGRAMS = {name for name, own in TABLE.items() if own.keys() & {"program", "body", "branches"}}


class Several(tuple[Value, ...]):
    """A value of its own for each direction."""

    __slots__ = ()


def any_several(given: Sequence[Value | Several]) -> bool:
    return Several in map(type, given)  # asked at every operation


def of_direction(given: Sequence[Value | Several], number: int) -> list[Value]:
    return [one[number] if isinstance(one, Several) else one for one in given]


def apart(values: Sequence[Value | Several], several: Sequence[bool], count: int) -> list[Value]:
    """One after the other what `several` says has a value for each of `count` directions; what is the same for all as often."""
    flat: list[Value] = []
    for value, each in zip(values, several, strict=True):
        if not each:
            assert not isinstance(value, Several)
            flat.append(value)
        else:
            flat += value if isinstance(value, Several) else [value] * count
    return flat


def together(flat: Sequence[Value], several: Sequence[bool], count: int) -> list[Value | Several]:
    """The reverse of `apart`."""
    rest = iter(flat)
    return [Several(next(rest) for _ in range(count)) if each else next(rest) for each in several]


class Dependence:
    """What depends on the direction in the programs of one translation: each is looked through once for the same arguments."""

    def __init__(self) -> None:
        # By the number of a program, which it has as long as it is kept.
        self._found: dict[tuple[int, tuple[bool, ...]], tuple[Any, list[bool]]] = {}

    def results(self, jaxpr: Any, given: Sequence[bool]) -> list[bool]:
        """Which results of a program depend on the arguments that `given` marks, or may."""
        if not any(given):
            return [False] * len(jaxpr.outvars)
        key = id(jaxpr), tuple(given)
        if key not in self._found:
            self._found[key] = jaxpr, self._looked_through(jaxpr, given)
        return self._found[key][1]

    def _looked_through(self, jaxpr: Any, given: Sequence[bool]) -> list[bool]:
        marked = {id(one) for one, each in zip(jaxpr.invars, given, strict=True) if each}
        for equation in jaxpr.eqns:
            reads = [id(one) in marked for one in equation.invars]
            if True in reads:
                for one, each in zip(equation.outvars, self._of_equation(equation, reads), strict=True):
                    if each:
                        marked.add(id(one))
        return [id(one) in marked for one in jaxpr.outvars]

    def _of_equation(self, equation: Any, reads: list[bool]) -> Sequence[bool]:
        name = equation.primitive.name
        if name in SAME:
            return reads
        if name not in PROGRAMS:
            return [True] * len(equation.outvars)
        params = parameters_of(equation)
        if name == "scan":
            return self.of_scan(opened(params["program"])[0], reads, params["constants"], params["carry"])
        if name == "while":
            fixed = params["test_constants"], params["body_constants"]
            return self.of_while(opened(params["body"])[0], reads, *fixed)
        if name == "cond":
            branches = [self.results(opened(one)[0], reads[1:]) for one in params["branches"]]
            return [reads[0] or any(each) for each in zip(*branches, strict=True)]
        return self.results(opened(params["program"])[0], reads)

    def of_scan(self, body: Any, reads: Sequence[bool], constants: int, carry: int) -> list[bool]:
        """Which of the carry and of the stacked results of a scan depend on the arguments that `reads` marks."""
        carried = list(reads[constants : constants + carry])
        while True:
            results = self.results(body, [*reads[:constants], *carried, *reads[constants + carry :]])
            wider = [one or other for one, other in zip(carried, results[:carry], strict=True)]
            if wider == carried:
                return [*carried, *results[carry:]]
            carried = wider

    def of_while(self, body: Any, reads: Sequence[bool], test_constants: int, body_constants: int) -> list[bool]:
        """Which of the carry of a loop depend on the arguments that `reads` marks."""
        first = test_constants + body_constants
        carried = list(reads[first:])
        while True:
            results = self.results(body, [*reads[test_constants:first], *carried])
            wider = [one or other for one, other in zip(carried, results, strict=True)]
            if wider == carried:
                return carried
            carried = wider
