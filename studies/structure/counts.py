"""The counts of the package in a checkout: its rooms, the arrows between them, and the size of its modules and functions."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path

from studies.structure.imports import Function, Package, best_order, circles, floors, upward

LONG_MODULE, LONG_FUNCTION, MANY_PARAMETERS = 400, 80, 8  # CONTRIBUTING.md: more than these need a reason
Counts = dict[str, int | str]


def counted(tree: Path) -> Counts:
    """Of the package `smajax/` in the checkout `tree`."""
    package = Package(tree / "smajax")
    rooms = package.rooms()
    order = _kept_order(tree) or best_order(rooms)
    circle = circles(package.imports)
    lines = package.lines
    functions = [one for nodes in package.nodes.values() for one in nodes if isinstance(one, Function)]
    longest = max(functions, key=length)
    contracts = _contracts(package)
    return {
        "modules at the top": len(list((tree / "smajax").glob("*.py"))),
        "folders at the top": len({path.relative_to(tree / "smajax").parts[0] for path in _files(tree / "smajax")}),
        "rooms": len(rooms),
        "floors": floors(rooms, order),
        "arrows between rooms": sum(len(others) for others in rooms.values()),
        "arrows back up": len(upward(rooms, order)),
        "order": "of tests/test_layers.py" if _kept_order(tree) else "the best found",
        "circles among modules": len(circle),
        "files in the largest circle": max(map(len, circle), default=0),
        "modules": len(package.files),
        "lines": sum(lines.values()),
        "modules over 400 lines": sum(count > LONG_MODULE for count in lines.values()),
        "longest module, lines": max(lines.values()),
        "functions over 80 lines": sum(length(one) > LONG_FUNCTION for one in functions),
        "longest function, lines": length(longest),
        "longest function": longest.name,
        "functions with more than 8 parameters": sum(parameters(one) > MANY_PARAMETERS for one in functions),
        "contracts of effects": len(contracts),
        "methods of all contracts": sum(contracts.values()),
        "methods of the largest contract": max(contracts.values()),
    }


def length(function: Function) -> int:
    """Lines from `def` to the last one."""
    return (function.end_lineno or function.lineno) - function.lineno + 1


def parameters(function: Function) -> int:
    """How many it takes, without `self` and `cls`."""
    given = [*function.args.posonlyargs, *function.args.args]
    own = bool(given) and given[0].arg in ("self", "cls")
    return len(given) - own + len(function.args.kwonlyargs)


def _files(package: Path) -> Iterator[Path]:
    """Files in folders of the package, data too, without what Python compiles."""
    return (path for path in package.rglob("*") if path.is_file() and path.suffix != ".pyc" and path.parent != package)


def _kept_order(tree: Path) -> list[str]:
    """The order of the rooms that the tree's own test holds; empty where there is none."""
    path = tree / "tests" / "test_layers.py"
    for node in ast.parse(path.read_text("utf-8") if path.exists() else "").body:
        if isinstance(node, ast.Assign) and ast.unparse(node.targets[0]) == "ORDER":
            return list(ast.literal_eval(node.value))
    return []


def _contracts(package: Package) -> dict[str, int]:
    """The classes that an effect inherits from, each with how many methods: `AbstractEffect`, and those in `CONTRACTS` where there are any."""
    nodes = [node for module in package.nodes.values() for node in module]
    classes = {node.name: node for node in nodes if isinstance(node, ast.ClassDef)}
    names = ["AbstractEffect"]
    for node in package.nodes.get("smajax.model.effects.contract_check", []):
        if (
            isinstance(node, ast.AnnAssign)
            and ast.unparse(node.target) == "CONTRACTS"
            and isinstance(node.value, ast.Tuple)
        ):
            names += [ast.unparse(one) for one in node.value.elts]
    return {name: sum(isinstance(node, ast.FunctionDef) for node in classes[name].body) for name in names}
