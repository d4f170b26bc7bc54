"""What a program in LLVM's language is put together of, before it is cut into phases (`phases`)."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, field

NAMES = re.compile(r"%[a-z]+\d+")
LINE = 64  # bytes of a line of the cache


@dataclass(slots=True)
class Work:
    """Instructions on one vector that stay together: `%turn` is its number within the group, `%at` that of its first run."""

    name: str | None  # of what comes out
    lines: list[str]
    names: Sequence[str]  # of what goes in
    reads: tuple[str, ...]  # those of them that differ from vector to vector


@dataclass(slots=True)
class Write:
    """Cells and what they are to hold, all at once: a value may be what another of them held."""

    pairs: list[tuple[str, str]]


@dataclass(frozen=True, slots=True)
class Late:
    """A line that waits for the works before it."""

    line: str


@dataclass(frozen=True, slots=True)
class Edge:
    """Of a loop: where it begins, and where it has ended."""

    begins: bool


@dataclass(frozen=True, slots=True)
class Chosen:
    """Vectors of a group, in memory: how many, and which. Works after it are of these alone, to the end of the loop."""

    count: str
    numbers: str


Item = str | Work | Write | Late | Edge | Chosen


@dataclass(frozen=True, slots=True)
class Layout:
    """How a vector lies in memory."""

    kind: str  # LLVM's
    size: int  # bytes
    mask: str | None = None  # of truth values that are stored as whole numbers: their kind in a register


@dataclass(frozen=True, slots=True)
class Names:
    """Of what differs from vector to vector."""

    layouts: dict[str, Layout]
    cells: dict[str, str]  # name -> the cell whose present value it is


@dataclass(slots=True)
class Uniform:
    """Values that are the same for all vectors of a group."""

    kinds: dict[str, str] = field(default_factory=dict)  # name -> LLVM's kind of number
    addresses: dict[str, str] = field(default_factory=dict)  # name -> how it is computed


@dataclass(slots=True)
class Phase:
    """Works that each vector of a group goes through in one turn."""

    works: list[Work | Write]
    chosen: Chosen | None
    loads: list[str] = field(default_factory=list)
    stores: list[tuple[str, str]] = field(default_factory=list)  # (where, what)
