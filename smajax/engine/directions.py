"""What a program computes for several directions of one run: once what does not depend on them, each by each what does.

A derivative along four directions at one point costs less than half of four runs with one direction each: the solution of a step and the
slopes of its equations are the same for all of them.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, overload

from smajax.engine.jax_versions import CALLS, SAME, opened, parameters_of
from smajax.engine.text import Array
from smajax.engine.values import Value


class Several(tuple[Value, ...]):
    """A value of its own for each direction."""

    __slots__ = ()


def any_several(given: Sequence[Value | Several]) -> bool:
    return Several in map(type, given)  # asked at every operation


def of_direction(given: Sequence[Value | Several], number: int) -> list[Value]:
    return [one[number] if isinstance(one, Several) else one for one in given]


@overload
def apart(values: Sequence[Value | Several], several: Sequence[bool], count: int) -> list[Value]: ...
@overload
def apart(values: Sequence[Array], several: Sequence[bool], count: int) -> list[Array]: ...
def apart(values: Sequence[Any], several: Sequence[bool], count: int) -> list[Any]:
    """One after the other what `several` says has a value for each of `count` directions; what is the same for all as often."""
    flat: list[Any] = []
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
        if name not in CALLS and name not in ("scan", "while", "cond"):
            return [True] * len(equation.outvars)
        params = parameters_of(equation)
        if name in CALLS:
            return self.results(opened(params["program"])[0], reads)
        if name == "scan":
            return self.of_scan(opened(params["program"])[0], reads, params["constants"], params["carry"])
        if name == "while":
            fixed = params["test_constants"], params["body_constants"]
            return self.of_while(opened(params["body"])[0], reads, *fixed)
        branches = [self.results(opened(one)[0], reads[1:]) for one in params["branches"]]
        return [reads[0] or any(each) for each in zip(*branches, strict=True)]

    def of_scan(self, body: Any, reads: Sequence[bool], constants: int, carry: int) -> list[bool]:
        """Which of the carry and of the stacked results of a scan depend on the arguments that `reads` marks."""
        first, series = reads[:constants], reads[constants + carry :]
        return _settled(
            reads[constants : constants + carry], lambda carried: self.results(body, [*first, *carried, *series])
        )

    def of_while(self, body: Any, reads: Sequence[bool], test_constants: int, body_constants: int) -> list[bool]:
        """Which of the carry of a loop depend on the arguments that `reads` marks."""
        first = reads[test_constants : test_constants + body_constants]
        return _settled(
            reads[test_constants + body_constants :], lambda carried: self.results(body, [*first, *carried])
        )


def _settled(start: Sequence[bool], round_of: Callable[[Sequence[bool]], list[bool]]) -> list[bool]:
    """What a round of a loop gives, its carry first, once no further round makes more of the carry depend on the direction."""
    carried = list(start)
    while True:
        results = round_of(carried)
        wider = [one or other for one, other in zip(carried, results, strict=False)]
        if wider == carried:
            return [*carried, *results[len(carried) :]]
        carried = wider
