"""The imports of a package: between its modules, and between its rooms."""

from __future__ import annotations

import ast
from collections.abc import Iterator, Mapping, Sequence
from graphlib import TopologicalSorter
from pathlib import Path

Graph = Mapping[str, set[str]]  # of each node those that it imports
Function = ast.FunctionDef | ast.AsyncFunctionDef
KINDS = (ast.Import, ast.ImportFrom, ast.FunctionDef, ast.AsyncFunctionDef, ast.ClassDef, ast.AnnAssign)


def modules_in(folder: Path) -> dict[str, Path]:
    """The files of the package in a folder by the name of their module."""
    files = {
        ".".join(path.relative_to(folder.parent).with_suffix("").parts): path for path in sorted(folder.rglob("*.py"))
    }
    return {name.removesuffix(".__init__"): path for name, path in files.items()}


class Package:
    """The modules of a package by name, parsed, with what each imports."""

    def __init__(self, folder: Path):
        self.name = folder.name
        self.files = modules_in(folder)
        text = {name: path.read_text("utf-8") for name, path in self.files.items()}
        self.lines = {name: len(one.splitlines()) for name, one in text.items()}
        self.nodes = {
            name: [node for node in ast.walk(ast.parse(one)) if isinstance(node, KINDS)] for name, one in text.items()
        }
        self.imports: Graph = {name: set(self._imported(name)) for name in self.files}

    def _imported(self, module: str) -> Iterator[str]:
        """Wherever they stand in the file: within functions, `if TYPE_CHECKING` too."""
        package = module if self.files[module].name == "__init__.py" else module.rpartition(".")[0]
        for node in self.nodes[module]:
            if isinstance(node, ast.Import):
                names = [alias.name for alias in node.names]
            elif isinstance(node, ast.ImportFrom):
                levels = package.split(".")
                above = ".".join(levels[: len(levels) - node.level + 1]) if node.level else ""
                source = ".".join(part for part in (above, node.module) if part)
                names = [
                    f"{source}.{one.name}" if f"{source}.{one.name}" in self.files else source for one in node.names
                ]
            else:
                continue
            yield from (name for name in names if name in self.files and name != module)

    def room(self, module: str) -> str:
        """The entry at the top of the package that a module belongs to; nothing for the package itself and `__main__`."""
        entry = module.split(".")[1] if "." in module else ""
        return "" if entry == "__main__" else entry

    def rooms(self) -> Graph:
        """Of each room the rooms that its modules import."""
        graph: dict[str, set[str]] = {self.room(module): set() for module in self.files if self.room(module)}
        for module, others in self.imports.items():
            if self.room(module):
                graph[self.room(module)] |= {self.room(other) for other in others} - {"", self.room(module)}
        return graph


def circles(graph: Graph) -> list[set[str]]:
    """The sets of nodes of which each leads to each other one (strongly connected components of more than one node)."""
    reached = {node: _reached(graph, node) for node in graph}
    found = {frozenset(other for other in reached[node] if node in reached[other]) for node in graph}
    return sorted((set(circle) for circle in found if len(circle) > 1), key=len, reverse=True)


def _reached(graph: Graph, start: str) -> set[str]:
    seen: set[str] = set()
    ahead = list(graph[start])
    while ahead:
        node = ahead.pop()
        if node not in seen:
            seen.add(node)
            ahead += graph[node] - seen
    return seen


def upward(graph: Graph, order: Sequence[str]) -> set[tuple[str, str]]:
    """The arrows that lead from a node to a later one of the order."""
    place = {node: k for k, node in enumerate(order)}
    return {(node, other) for node in graph for other in graph[node] if place[other] > place[node]}


def best_order(graph: Graph) -> list[str]:
    """An order with few arrows up: the nodes that need no others first, then single nodes moved as long as that saves arrows.

    It starts from the greedy rule of Eades, Lin and Smyth (1993). The least number is a hard problem; what is found is an upper bound of it.
    """
    order = _greedy(graph)
    saved = True
    while saved:
        saved = False
        for node in sorted(graph):
            rest = [one for one in order if one != node]
            needs = [int(one in graph[node]) for one in rest]
            needed = [int(node in graph[one]) for one in rest]
            up = [sum(needs[k:]) + sum(needed[:k]) for k in range(len(order))]  # of this node, put before the k-th
            if min(up) < up[order.index(node)]:
                order = [*rest[: up.index(min(up))], node, *rest[up.index(min(up)) :]]
                saved = True
    return order


def _greedy(graph: Graph) -> list[str]:
    left, first, last = {node: set(others) for node, others in graph.items()}, [], []
    while left:
        user = {node: sum(node in others for others in left.values()) for node in left}
        if any(not others for others in left.values()):
            node = min(one for one, others in left.items() if not others)
            first.append(node)
        elif any(not count for count in user.values()):
            node = min(one for one, count in user.items() if not count)
            last.append(node)
        else:
            node = max(sorted(left), key=lambda one: user[one] - len(left[one]))
            first.append(node)
        del left[node]
        for others in left.values():
            others.discard(node)
    return first + last[::-1]


def floors(graph: Graph, order: Sequence[str]) -> int:
    """Nodes of the longest chain of imports, without the arrows that lead up."""
    up = upward(graph, order)
    down = {node: {other for other in others if (node, other) not in up} for node, others in graph.items()}
    floor: dict[str, int] = {}
    for node in TopologicalSorter(down).static_order():
        floor[node] = 1 + max((floor[other] for other in down[node]), default=0)
    return max(floor.values())
