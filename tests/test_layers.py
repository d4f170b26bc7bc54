"""Rooms: imports point to the left only, no circle among modules, twelve rooms at the top; imports for types included."""

from __future__ import annotations

import ast
import tomllib
from collections.abc import Iterator
from functools import cache
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

from studies.structure.imports import Graph, Package, modules_in

PACKAGE = Path(__file__).parents[1] / "smajax"
ORDER = [
    "core",
    "engine",
    "model",
    "simulation",
    "data",
    "fit",
    "control",
    "attribution",
    "report",
    "export",
    "app",
    "cli",
]

# Modules that a room asks for by name when it runs, and that lie to its right -> why, and until when.
EXCEPTIONS = {
    (
        "smajax.attribution.findings",
        "smajax",
    ): "findings.summary and its like are smajax.report.narrate(findings) now; until version 0.3",
    (
        "smajax.core.old_words",
        "smajax.report.old_words",
    ): "sentences that results held are the report's now; until version 0.3",
}

MODULES = modules_in(PACKAGE)


def imported_by_name(module: str) -> Iterator[str]:
    """Modules of the package that `module` gets by `import_module("...")`, of names that stand in the call."""
    for node in ast.walk(ast.parse(MODULES[module].read_text("utf-8"))):
        if isinstance(node, ast.Call) and ast.unparse(node.func).rpartition(".")[2] == "import_module":
            yield from (one.value for one in node.args if isinstance(one, ast.Constant) and one.value in MODULES)


@cache
def imports() -> Graph:
    """Of each module; every worker collects this file, and one runs it."""
    return Package(PACKAGE).imports


def place(module: str) -> float:
    """Of a module's room in the order. The top of the package gathers the public names, for users and for the command line."""
    name = module.split(".")[1] if "." in module else ""
    return ORDER.index(name) if name in ORDER else ORDER.index("cli") - 0.5


def test_imports_point_to_rooms_on_the_left():
    rooms = {module for module in MODULES if module.split(".")[1:2] and module.split(".")[1] in ORDER}
    up = {(module, other) for module in rooms for other in imports()[module] if place(other) > place(module)}
    assert not up, f"the order is {' < '.join(ORDER)}"


def test_what_a_room_imports_by_name_is_on_its_left_too():
    asking = [module for module in MODULES if "import_module" in MODULES[module].read_text("utf-8")]
    by_name = {(module, other) for module in asking for other in imported_by_name(module)}
    up = {(module, other) for module, other in by_name if place(other) > place(module)}
    assert up == set(EXCEPTIONS), "an import to the right, or an exception that is none any more"
    version = tomllib.loads((PACKAGE.parent / "pyproject.toml").read_text("utf-8"))["project"]["version"]
    ended = [why for why in EXCEPTIONS.values() if numbers(version) >= numbers(why.rpartition(" ")[2])]
    assert not ended, f"version {version} is to have these no more"


def numbers(version: str) -> list[int]:
    return [int(part) for part in version.split(".")[:2]]


def test_no_circle_among_modules():
    try:
        TopologicalSorter(imports()).prepare()
    except CycleError as circle:
        raise AssertionError(" -> ".join(reversed(circle.args[1]))) from None


# Within the model: an equation knows of effects by the contract beside it alone.
MODEL = [
    "types",
    "channels wire",
    "load drive sensor_reading",
    "contracts effects",
    "system",
    "extended presets preset_sources",
    "rigs",
]


def test_imports_within_the_model_point_to_the_left():
    level = {name: k for k, names in enumerate(MODEL) for name in names.split()}
    inside = [module for module in MODULES if module.startswith("smajax.model.")]
    at = {module: level[module.split(".")[2]] for module in inside}
    up = [(module, other) for module in inside for other in imports()[module] & at.keys() if at[other] > at[module]]
    assert not up, f"the order is {' < '.join(MODEL)}"


def test_twelve_rooms_at_the_top():
    """Beside them `__init__.py`, `__main__.py` for `python -m smajax`, and `py.typed` for type checkers."""
    entries = {p.name for p in PACKAGE.iterdir() if not p.name.startswith(("__init__", "__pycache__", "."))}
    assert entries == {*ORDER, "__main__.py", "py.typed"}
    assert len(ORDER) <= 12
