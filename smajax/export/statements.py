"""A C function body while it is written: statements in scopes, each value with one name, and what nothing comes of left out.

A value is assigned once, in the outermost scope that knows all it is made of, so that what does not change in a loop stands
before it; two equal expressions are one.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field

import numpy as np

NAMES = re.compile(r"(?<![>.])\b[aciv][0-9]+\b")  # arrays, cells, indices and values; not members of a structure


@dataclass(frozen=True, slots=True)
class Number:
    """One number of a program that is written: its name or expression in C, numpy's kind of it, and its value where that is known."""

    text: str
    dtype: str
    value: float | int | bool | None = None

    @property
    def known(self) -> bool:
        return self.value is not None


@dataclass(slots=True)
class Assign:
    """A value that has one name from here on. cost: what it takes (`counts`)."""

    name: str
    dtype: str
    text: str
    cost: str


@dataclass(slots=True)
class Fill:
    """An array of known length with what is in it; `values` None: written into later, by `Store`."""

    name: str
    dtype: str
    length: int
    values: tuple[str, ...] | None = None


@dataclass(slots=True)
class Store:
    """An array's entry written."""

    array: str
    index: str
    value: str


@dataclass(slots=True)
class Cell:
    """A number that is written over: in C a variable. new: what a round of a loop, or a branch, leaves in it."""

    name: str
    dtype: str
    start: str = ""
    new: list[str] = field(default_factory=list)


@dataclass(slots=True)
class Loop:
    """Rounds: `count` of them, or while `test` holds (`rounds`: at most so many, None if that is not known)."""

    cells: list[Cell]
    index: str = ""
    count: int = 0
    before: list[Item] = field(default_factory=list)  # of a while loop, what the test needs
    test: str = ""
    rounds: int | None = None
    body: list[Item] = field(default_factory=list)


@dataclass(slots=True)
class Branch:
    """One of several ways, by the number of it; two of them are an if and an else."""

    which: str
    cells: list[Cell]
    bodies: list[list[Item]]


Item = Assign | Fill | Store | Loop | Branch


@dataclass(slots=True)
class _Scope:
    sure: bool  # it is run once at least: what does not depend on it may be done before it
    items: list[Item] = field(default_factory=list)
    known: dict[tuple[str, str], str] = field(default_factory=dict)


class Writer:
    """Statements as they are written. Names are given in order, so that the same program gives the same text."""

    def __init__(self) -> None:
        self.scopes = [_Scope(sure=True)]
        self.depth: dict[str, int] = {}
        self.count = 0

    def fresh(self, kind: str) -> str:
        """A name that depends on the present scope."""
        self.count += 1
        name = f"{kind}{self.count}"
        self.depth[name] = len(self.scopes) - 1
        return name

    def _level(self, names: Iterable[str]) -> int:
        unsure = max(k for k, scope in enumerate(self.scopes) if k == 0 or not scope.sure)
        return max([unsure, *(self.depth[one] for one in names)])

    def assign(self, text: str, dtype: str, cost: str = "") -> Number:
        """A name for what `text` says; the one it has, if it has one."""
        for scope in self.scopes:
            if (text, dtype) in scope.known:
                return Number(scope.known[text, dtype], dtype)
        level = self._level(NAMES.findall(text))
        name = self.fresh("v")
        self.depth[name] = level
        self.scopes[level].known[text, dtype] = name
        self.scopes[level].items.append(Assign(name, dtype, text, cost))
        return Number(name, dtype)

    def array(self, numbers: Sequence[Number]) -> str:
        """An array of these."""
        texts = tuple(one.text for one in numbers)
        key = "{" + ", ".join(texts) + "}", numbers[0].dtype
        for scope in self.scopes:
            if key in scope.known:
                return scope.known[key]
        level = self._level(NAMES.findall(key[0]))
        name = self.fresh("a")
        self.depth[name] = level
        self.scopes[level].known[key] = name
        self.scopes[level].items.append(Fill(name, key[1], len(texts), texts))
        return name

    def room(self, length: int, dtype: str) -> str:
        """An array to be written into."""
        name = self.fresh("a")
        self.put(Fill(name, dtype, length))
        return name

    def put(self, item: Item) -> None:
        self.scopes[-1].items.append(item)

    def open(self, sure: bool) -> None:
        self.scopes.append(_Scope(sure))

    def close(self) -> list[Item]:
        return self.scopes.pop().items


def literal(value: object, dtype: str) -> Number:
    """A constant as C writes it: R(...) of a real one, which is cast to the precision of the program."""
    kind = np.dtype(dtype)
    if kind.kind == "f":
        exact = float(kind.type(value))
        if np.isnan(exact):
            return Number("NAN", dtype, exact)
        if np.isinf(exact):
            return Number("INFINITY" if exact > 0 else "(-INFINITY)", dtype, exact)
        return Number(f"R({exact!r})", dtype, exact)
    if kind.kind == "b":
        return Number("true" if value else "false", dtype, bool(value))
    whole = int(value)  # type: ignore[call-overload]
    if kind.kind == "u" or -(2**31) < whole < 2**31:
        return Number(f"{whole}u" if kind.kind == "u" else (str(whole) if whole >= 0 else f"({whole})"), dtype, whole)
    return Number(f"INT64_C({whole})", dtype, whole)


def needed(items: list[Item], results: Iterable[str]) -> list[Item]:
    """The items of which something comes; cells that nobody reads go too."""
    wanted = {name for text in results for name in NAMES.findall(text)}
    return _needed(items, wanted)


def _needed(items: list[Item], wanted: set[str]) -> list[Item]:
    """Backwards; `wanted` grows by what the items that stay read."""
    kept: list[Item] = []
    for item in reversed(items):
        if isinstance(item, Assign):
            if item.name not in wanted:
                continue
            wanted.update(NAMES.findall(item.text))
        elif isinstance(item, Fill):
            if item.name not in wanted:
                continue
            wanted.update(name for text in item.values or () for name in NAMES.findall(text))
        elif isinstance(item, Store):
            if item.array not in wanted:
                continue
            wanted.update(NAMES.findall(item.index) + NAMES.findall(item.value))
        elif isinstance(item, Loop):
            found = _needed_loop(item, wanted)
            if found is None:
                continue
            item = found
        else:
            cells = [cell for cell in item.cells if cell.name in wanted]
            if not cells:
                continue
            bodies = []
            for number, body in enumerate(item.bodies):
                inside = wanted | {name for cell in cells for name in NAMES.findall(cell.new[number])}
                bodies.append(_needed(body, inside))
                wanted |= inside
            wanted.update(NAMES.findall(item.which))
            item = Branch(item.which, cells, bodies)
        kept.append(item)
    return kept[::-1]


def _stores(items: Iterable[Item]) -> set[str]:
    """Arrays that items write into."""
    found: set[str] = set()
    for item in items:
        if isinstance(item, Store):
            found.add(item.array)
        elif isinstance(item, Loop):
            found |= _stores(item.before) | _stores(item.body)
        elif isinstance(item, Branch):
            found |= {one for body in item.bodies for one in _stores(body)}
    return found


def _needed_loop(loop: Loop, wanted: set[str]) -> Loop | None:
    if not any(cell.name in wanted for cell in loop.cells) and not _stores(loop.body) & wanted:
        return None
    while True:
        inside = wanted | set(NAMES.findall(loop.test))
        cells = [cell for cell in loop.cells if cell.name in inside]
        inside |= {name for cell in cells for name in NAMES.findall(cell.new[0])}
        body = _needed(loop.body, inside)
        before = _needed(loop.before, inside)
        if all((cell.name in inside) == (cell in cells) for cell in loop.cells):
            break
        # What a cell that is read is made of may read other cells: once more, with those.
        wanted |= {cell.name for cell in loop.cells if cell.name in inside}
    wanted |= inside
    wanted.update(name for cell in cells for name in NAMES.findall(cell.start))
    return Loop(cells, loop.index, loop.count, before, loop.test, loop.rounds, body)
