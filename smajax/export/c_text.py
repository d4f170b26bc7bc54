"""Statements -> lines of C99; and the lines of both precisions as one text, where they differ in constants alone."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence

import numpy as np

from smajax.export.operations import type_of
from smajax.export.statements import NAMES, Assign, Branch, Cell, Fill, Item, Loop, Store

WIDTH = 96  # characters of an expression into which another one is put
CELL = re.compile(r"(?<![>.])\b[ac][0-9]+\b")
CALL = re.compile(r"^(F\(\w+\)|\w+)?\(")
CONSTANT = re.compile(r"\bR\(([^()]*)\)")
COUNT = re.compile(r"\bint(?:64|32)_t\b|\bwhole(?:64|32)\b")

# Small functions that operations stand for, each written where it is used.
HELPERS = {
    "larger": "static inline real larger(real a, real b) { return a > b || a != a ? a : b; }",
    "smaller": "static inline real smaller(real a, real b) { return a < b || a != a ? a : b; }",
    "sign_of": "static inline real sign_of(real a) { return a > 0 ? R(1.0) : a < 0 ? R(-1.0) : a; }",
    "whole32": "static inline int32_t whole32(real a) { return a != a ? 0 : a >= R(2147483647.0) ? INT32_MAX : "
    "a <= R(-2147483648.0) ? INT32_MIN : (int32_t)a; }",
    "whole64": "static inline int64_t whole64(real a) { return a != a ? 0 : a >= R(9223372036854775807.0) ? INT64_MAX : "
    "a <= R(-9223372036854775808.0) ? INT64_MIN : (int64_t)a; }",
    "whole": "static inline count whole(real a) { return a != a ? 0 : a >= R(2147483520.0) ? 2147483520 : "
    "a <= R(-2147483648.0) ? -2147483647 - 1 : (count)a; }",
}


def helpers_of(lines: Iterable[str]) -> list[str]:
    """The small functions that lines use."""
    text = "\n".join(lines)
    return [code for name, code in HELPERS.items() if re.search(rf"\b{name}\(", text)]


def texts_of(item: Item) -> Iterator[str]:
    """Every expression of an item and those in it."""
    if isinstance(item, Assign):
        yield item.text
    elif isinstance(item, Fill):
        yield from item.values or ()
    elif isinstance(item, Store):
        yield from (item.index, item.value)
    else:
        yield from (text for cell in item.cells for text in (cell.start, *cell.new))
        bodies = [item.before, item.body] if isinstance(item, Loop) else item.bodies
        yield item.test if isinstance(item, Loop) else item.which
        yield from (text for body in bodies for one in body for text in texts_of(one))


def _one_call(text: str) -> bool:
    """Whether it is a name, a constant or a single call or bracket, which needs no brackets around it."""
    if re.fullmatch(r"[\w.>-]+|\w+\[[^\]]*\]", text) and "-" not in text.replace("->", ""):
        return True
    found = CALL.match(text)
    if found is None or not text.endswith(")"):
        return False
    depth = 0
    for k, sign in enumerate(text[found.end() - 1 :], start=found.end() - 1):
        depth += {"(": 1, ")": -1}.get(sign, 0)
        if depth == 0:
            return k == len(text) - 1
    return False


class _Printer:
    def __init__(self, items: Sequence[Item], results: Sequence[str]) -> None:
        texts = [text for item in items for text in texts_of(item)] + list(results)
        self.uses = Counter(name for text in texts for name in NAMES.findall(text))
        self.put_in: dict[str, str] = {}

    def expression(self, text: str) -> str:
        """With the expressions in it that are used here alone."""
        return NAMES.sub(lambda at: self.put_in.get(at[0], at[0]), text)

    def lines(self, items: Sequence[Item], depth: int) -> Iterator[str]:
        indent = "    " * depth
        # An expression moves to the one place that asks for it within the same block, for a variable of a loop may change behind it.
        here = Counter(name for item in items if isinstance(item, Assign) for name in NAMES.findall(item.text))
        for item in items:
            if isinstance(item, Assign):
                text = self.expression(item.text)
                once = self.uses[item.name] == 1 == here[item.name]
                if once and len(CONSTANT.sub("R()", text)) < WIDTH and not CELL.search(text):
                    self.put_in[item.name] = text if _one_call(text) else f"({text})"
                    continue
                yield f"{indent}const {type_of(item.dtype)} {item.name} = {text};"
            elif isinstance(item, Fill):
                if item.values is None:
                    yield f"{indent}{type_of(item.dtype)} {item.name}[{item.length}];"
                else:
                    yield f"{indent}const {type_of(item.dtype)} {item.name}[{item.length}] = {{{', '.join(item.values)}}};"
            elif isinstance(item, Store):
                yield f"{indent}{item.array}[{item.index}] = {item.value};"
            elif isinstance(item, Loop):
                yield from self.loop(item, depth)
            else:
                yield from self.branch(item, depth)

    def loop(self, loop: Loop, depth: int) -> Iterator[str]:
        indent = "    " * depth
        for cell in loop.cells:
            yield f"{indent}{type_of(cell.dtype)} {cell.name} = {cell.start};"
        if loop.index:
            yield f"{indent}for (int {loop.index} = 0; {loop.index} < {loop.count}; {loop.index}++) {{"
        else:
            yield f"{indent}for (;;) {{" + (f" /* {loop.rounds} rounds at most */" if loop.rounds is not None else "")
            yield from self.lines(loop.before, depth + 1)
            yield f"{indent}    if (!{loop.test}) {{ break; }}"
        yield from self.lines(loop.body, depth + 1)
        yield from self.cells(loop.cells, 0, depth + 1)
        yield f"{indent}}}"

    def branch(self, branch: Branch, depth: int) -> Iterator[str]:
        indent = "    " * depth
        for cell in branch.cells:
            yield f"{indent}{type_of(cell.dtype)} {cell.name};"
        last = len(branch.bodies) - 1
        for number, body in enumerate(branch.bodies):
            head = "} else" if number else ""
            if number < last:
                head += f"{' ' if number else ''}if ({branch.which} {'<=' if number == 0 else '=='} {number})"
            yield f"{indent}{head} {{"
            yield from self.lines(body, depth + 1)
            yield from self.cells(branch.cells, number, depth + 1)
        yield f"{indent}}}"

    @staticmethod
    def cells(cells: Sequence[Cell], number: int, depth: int) -> Iterator[str]:
        for cell in cells:
            if cell.new[number] != cell.name:
                yield f"{'    ' * depth}{cell.name} = {cell.new[number]};"


def printed(items: Sequence[Item], results: Sequence[str], depth: int = 1) -> list[str]:
    """Lines of a body. results: the expressions that are read behind it."""
    return list(_Printer(items, results).lines(items, depth))


def merged(double: Sequence[str], single: Sequence[str]) -> list[str]:
    """One text for both precisions: constants that differ become `R2(double, single)`; where more differs, both behind `#if`.

    JAX counts by int64 in double precision and by int32 in single: `count`, and `whole` of a real number.
    """
    if len(double) == len(single):
        lines = [_both(ours, theirs) for ours, theirs in zip(double, single, strict=True)]
        if all(one is not None for one in lines):
            return [one for one in lines if one is not None]
    return ["#if SINGLE", *single, "#else", *double, "#endif"]


def _both(ours: str, theirs: str) -> str | None:
    """A line that says both; None where there is none."""
    if CONSTANT.sub("", ours) != CONSTANT.sub("", theirs):
        ours, theirs = COUNT.sub(_counted, ours), COUNT.sub(_counted, theirs)
        if CONSTANT.sub("", ours) != CONSTANT.sub("", theirs):
            return None
    values = iter(CONSTANT.findall(theirs))

    def put(found: re.Match[str]) -> str:
        value = next(values)
        same = np.float32(float(found[1])) == np.float32(float(value))
        return f"R({found[1]})" if same else f"R2({found[1]}, {value})"

    return CONSTANT.sub(put, ours)


def _counted(found: re.Match[str]) -> str:
    return "count" if found[0].startswith("int") else "whole"
