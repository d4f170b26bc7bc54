"""A long run of instructions, cut into short loops over several vectors of runs.

Written out for one vector a step waits for its own results most of the time; written out for several at once it fits
neither the registers nor the cache of instructions. So it is cut into phases that each go over all vectors of a group: a
vector's turn in one is so short that the processor has several under way. What a phase leaves to later ones lies in the
thread's own memory, in the nearest cache.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from heapq import heappop, heappush

import numpy as np

from smajax.engine.parts import LINE, Chosen, Edge, Item, Late, Names, Phase, Uniform, Work, Write
from smajax.engine.phase_functions import phase_function

LEAST, MOST = 24, 60  # works a phase


@dataclass(slots=True)
class _Block:
    label: str
    chosen: Chosen | None = None
    lines: list[str] = field(default_factory=list)
    works: list[Work | Write] = field(default_factory=list)
    late: list[str] = field(default_factory=list)
    end: str = ""
    phases: list[Phase] = field(default_factory=list)


@dataclass(slots=True)
class _Left:
    """A cell's new value, and the phase that leaves it there."""

    phase: int
    cell: str
    value: str


def _needed(items: Sequence[Item], cells: Mapping[str, str]) -> list[Item]:
    """Without works of which nothing comes."""
    works = [one for one in items if isinstance(one, Work)]
    makers = {one.name: one for one in works if one.name}
    held: dict[str, list[str]] = {}
    for item in items:
        for cell, value in item.pairs if isinstance(item, Write) else ():
            held.setdefault(cell, []).append(value)
    wanted: set[str] = set()
    requested = [name for one in works if not one.name for name in one.reads]
    while requested:
        name = requested.pop()
        name = cells.get(name, name)
        if name not in wanted:
            wanted.add(name)
            requested += makers[name].reads if name in makers else held.get(name, [])
    lasting: list[Item] = []
    for item in items:
        if isinstance(item, Write):
            lasting.append(Write([pair for pair in item.pairs if pair[0] in wanted]))
        elif not isinstance(item, Work) or item.name is None or item.name in wanted:
            lasting.append(item)
    return lasting


def _reads(work: Work | Write) -> Sequence[str]:
    return work.reads if isinstance(work, Work) else [value for _, value in work.pairs]


def _cut(works: Sequence[Work | Write], most: int) -> list[list[Work | Write]]:
    """Into phases, where the fewest results go from one to the next."""
    place = {work.name: k for k, work in enumerate(works) if isinstance(work, Work) and work.name}
    last = {name: k for k, work in enumerate(works) for name in _reads(work) if name in place}
    change = np.zeros(len(works) + 2, int)
    for name, end in last.items():
        change[place[name] + 1] += 1
        change[end + 1] -= 1
    crossing = np.cumsum(change)
    result, start = [], 0
    while len(works) - start > most:
        window = crossing[start + LEAST : start + most + 1]
        cut = start + LEAST + len(window) - 1 - int(np.argmin(window[::-1]))  # the last one of the best
        result.append(list(works[start:cut]))
        start = cut
    return [*result, list(works[start:])] if start < len(works) else result


def _blocks(items: Iterable[Item], most: int) -> tuple[list[_Block], list[tuple[int, int]]]:
    """Blocks with their phases, and of every loop the first phase and the one after its last."""
    blocks, loops, count = [_Block("entry")], [], 0
    chosen: Chosen | None = None
    outside: list[tuple[int, Chosen | None]] = []
    for item in items:
        here = blocks[-1]
        if isinstance(item, Work | Write):
            here.works.append(item)
        elif isinstance(item, Late):
            here.late.append(item.line)
        elif isinstance(item, Chosen):
            here.chosen = chosen = item
        elif isinstance(item, Edge):
            if item.begins:
                outside.append((count, chosen))
            else:
                begin, chosen = outside.pop()
                loops.append((begin, count))
        elif item.endswith(":"):
            blocks.append(_Block(item[:-1], chosen))
        elif item.startswith(("  br ", "  ret ")):
            here.end = item
            here.phases = [Phase(part, here.chosen) for part in _cut(here.works, most)]
            count += len(here.phases)
        else:
            here.lines.append(item)
    return blocks, loops


def _beside(one: int, other: int, loops: Sequence[tuple[int, int]]) -> bool:
    """Whether two phases lie in the same loops."""
    return all((begin <= one < end) == (begin <= other < end) for begin, end in loops)


def _joined(
    left: Sequence[_Left], reads: Mapping[str, list[int]], loops: Sequence[tuple[int, int]], cells: Mapping[str, str]
) -> dict[str, str]:
    """Cells of inner loops -> those of the outer ones that they take over and hand back: one place does for both.

    Not across a loop in between: its next round begins the inner one with the outer cell again.
    """
    of: dict[str, list[_Left]] = {}
    for one in left:
        of.setdefault(one.cell, []).append(one)
    same: dict[str, str] = {}
    for inner, (first, *_) in of.items():
        outer = cells.get(first.value)
        if outer is None or outer in same.values() or len(of[outer]) != 2:
            continue
        back = of[outer][1].phase
        requested = [*reads.get(outer, []), *(one.phase for one in left if cells.get(one.value) == outer)]
        meanwhile = any(first.phase < number <= back for number in requested)
        if first.phase < back and _beside(first.phase, back, loops) and not meanwhile:
            same[inner] = outer
    return same


def _lay_early(
    left: Sequence[_Left],
    made: Mapping[str, int],
    reads: Mapping[str, list[int]],
    phases: Sequence[Phase],
    loops: Sequence[tuple[int, int]],
    cells: Mapping[str, str],
) -> None:
    """Leave values in their cells as soon as they are there, where nobody asks for the one before any more."""
    requested = {cell: list(numbers) for cell, numbers in reads.items()}
    for one in left:
        requested.setdefault(one.cell, []).append(one.phase)
        if one.value in cells:
            requested.setdefault(cells[one.value], []).append(one.phase)
    for one in left:
        early, late = made.get(one.value, one.phase), one.phase
        beside = _beside(early, late, loops) and phases[early].chosen == phases[late].chosen
        if beside and sum(early < at <= late for at in requested[one.cell]) == int(early < late):
            one.phase = early


def _places(spans: Mapping[str, tuple[int, int]], sizes: Mapping[str, int], vectors: int) -> tuple[dict[str, int], int]:
    """Offsets of what lives from one phase to another, and bytes altogether; what is over makes room for what comes.

    sizes: bytes a vector. Only one of the same makes room: a vector's turn must not write where another's is still to be read.
    """
    free: dict[int, list[int]] = {}
    living: list[tuple[int, int, str]] = []  # a heap: (its end, the order in which they came, what)
    result: dict[str, int] = {}
    total = 0
    for number, name in enumerate(sorted(spans, key=lambda one: spans[one][0])):
        first, last = spans[name]
        while living and living[0][0] <= first:
            *_, over = heappop(living)
            free.setdefault(sizes[over], []).append(result[over])
        if free.get(sizes[name]):
            result[name] = free[sizes[name]].pop()
        else:
            result[name], total = total, total - (-sizes[name] * vectors // LINE) * LINE
        heappush(living, (last, number, name))
    return result, total


def _settled(
    phases: Sequence[Phase], loops: Sequence[tuple[int, int]], names: Names
) -> tuple[Names, dict[str, tuple[int, int]]]:
    """What each phase loads and stores, put down in it; the names with cells joined, and from when to when each lives."""
    made: dict[str, int] = {}
    left: list[_Left] = []
    read: list[tuple[int, str]] = []
    for number, phase in enumerate(phases):
        for work in phase.works:
            if isinstance(work, Write):
                left += [_Left(number, *pair) for pair in work.pairs]
                continue
            read += [(number, name) for name in work.reads]
            if work.name:
                made[work.name] = number

    def by_cell(cells: Mapping[str, str]) -> dict[str, list[int]]:
        result: dict[str, list[int]] = {}
        for number, name in read:
            if name in cells:
                result.setdefault(cells[name], []).append(number)
        return result

    same = _joined(left, by_cell(names.cells), loops, names.cells)

    def root(cell: str) -> str:
        while cell in same:
            cell = same[cell]
        return cell

    cells = {name: root(cell) for name, cell in names.cells.items()}
    left = [_Left(one.phase, root(one.cell), one.value) for one in left]
    left = [one for one in left if cells.get(one.value) != one.cell]
    _lay_early(left, made, by_cell(cells), phases, loops, cells)

    touched: dict[str, set[int]] = {}
    for number, name in dict.fromkeys([*read, *((one.phase, one.value) for one in left if one.value in names.layouts)]):
        if name in cells or made[name] != number:
            touched.setdefault(cells.get(name, name), set()).add(number)
            phases[number].loads.append(name)
    for one in left:
        touched.setdefault(one.cell, set()).add(one.phase)
        phases[one.phase].stores.append((one.cell, one.value))
    for name, numbers in touched.items():
        if name in made:
            numbers.add(made[name])
            phases[made[name]].stores.append((name, name))
    spans = {}
    for name, numbers in touched.items():
        first, last = min(numbers), max(numbers)
        for begin, end in loops:
            if not begin <= first < end and any(begin <= one < end for one in numbers):
                last = max(last, end)  # the next round asks for it again
        spans[name] = first, last
    return Names(names.layouts, cells), spans


def laid_out(
    items: Sequence[Item], names: Names, uniform: Uniform, lanes: int, vectors: int, start: int
) -> tuple[list[str], list[str], int]:
    """The lines of the function, those of its phases' functions, and the bytes of a thread's own memory that it takes from `start` on.

    Of a single vector nothing is cut: there is no other to go on with.
    """
    blocks, loops = _blocks(_needed(items, names.cells), MOST if vectors > 1 else len(items))
    names, spans = _settled([phase for block in blocks for phase in block.phases], loops, names)
    places, total = _places(spans, {name: names.layouts[name].size for name in spans}, vectors)
    places = {name: start + at for name, at in places.items()}

    lines: list[str] = []
    functions: list[str] = []
    number = 0
    for block in blocks:
        lines += [f"{block.label}:"] if block.label != "entry" else []
        lines += block.lines
        for phase in block.phases:
            if phase.loads or phase.stores or any(isinstance(one, Work) for one in phase.works):
                call, function = phase_function(phase, number, names, uniform, lanes, places, vectors == 1)
                lines.append(call)
                functions += function
            number += 1
        lines += [*block.late, block.end]
    return lines, functions, total
