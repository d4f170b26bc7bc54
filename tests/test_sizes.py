"""Sizes: a function over 80 lines or with more than 8 parameters and a module over 400 lines state a reason; no call lists more than 12 values by position."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from pathlib import Path

import pytest

from studies.structure.counts import LONG_FUNCTION, LONG_MODULE, MANY_PARAMETERS, length, parameters

ROOT = Path(__file__).parents[1]
BY_POSITION = 12
LEAST_WORDS = 3  # of a reason


def reason(function: ast.FunctionDef | ast.AsyncFunctionDef, lines: list[str]) -> str:
    """The comment on the line of `def`, or on the line above it and its decorators."""
    above = lines[min([function.lineno, *(one.lineno for one in function.decorator_list)]) - 2].strip()
    if above.startswith("#"):
        return above.lstrip("# ")
    return lines[function.lineno - 1].partition("#")[2].strip()


def module_reason(text: str) -> str:
    """What its docstring says after `More than 400 lines:`."""
    told = re.search(rf"More than {LONG_MODULE} lines: (.+)", ast.get_docstring(ast.parse(text)) or "")
    return told[1] if told else ""


def faults(text: str) -> Iterator[str]:
    """What in a module is too large and has no reason."""
    lines = text.splitlines()
    if len(lines) > LONG_MODULE and len(module_reason(text).split()) < LEAST_WORDS:
        yield f"{len(lines)} lines, more than {LONG_MODULE}: split it, or say why not in its docstring: `More than {LONG_MODULE} lines: ...`"
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
            said = reason(node, lines)
            stated = len(said.split()) >= LEAST_WORDS
            where = f"{node.lineno}: {node.name} has"
            if length(node) > LONG_FUNCTION and not (stated and "lines" in said):
                yield f"{where} {length(node)} lines, more than {LONG_FUNCTION}: divide it, or say in a comment above `def` why so many lines"
            if parameters(node) > MANY_PARAMETERS and not stated:
                yield f"{where} {parameters(node)} parameters, more than {MANY_PARAMETERS}: group them, or say why in a comment above or beside `def`"
        elif isinstance(node, ast.Call) and len(node.args) > BY_POSITION:
            yield f"{node.lineno}: {ast.unparse(node.func)} gets {len(node.args)} values by position: name them"


@pytest.mark.parametrize("folder", ["smajax", "studies", "tests"])
def test_what_is_large_states_a_reason(folder: str) -> None:
    found = [
        f"{path.relative_to(ROOT)}:{one}"
        for path in sorted((ROOT / folder).rglob("*.py"))
        for one in faults(path.read_text("utf-8"))
    ]
    assert not found, "\n".join(found)


LONG = "def f():\n" + "    x = 1\n" * LONG_FUNCTION
MANY = f"def f({', '.join(f'a{k}' for k in range(MANY_PARAMETERS + 1))}):\n    pass\n"


@pytest.mark.parametrize(
    ("text", "count"),
    [
        (LONG, 1),
        ("# So many lines: a table.\n" + LONG, 0),
        ("# A table of numbers.\n" + LONG, 1),  # says nothing of its lines
        ("# So many lines: a table.\n@decorated\n" + LONG, 0),
        (MANY, 1),
        (MANY.replace("):\n", "):  # options of the command\n"), 0),
        ("# Long.\n" + MANY, 1),
        (MANY.replace("def f(a0, a1,", "def f(self, a0,"), 0),
        ("x = 1\n" * LONG_MODULE, 0),
        ("x = 1\n" * (LONG_MODULE + 1), 1),
        ('"""Numbers.\n\nMore than 400 lines: a table of the source.\n"""\n' + "x = 1\n" * LONG_MODULE, 0),
        (f"f({', '.join('x' * (BY_POSITION + 1))})\n", 1),
    ],
)
def test_the_rule_finds_what_is_too_large(text: str, count: int) -> None:
    assert len(list(faults(text))) == count
