"""What a function costs at worst: operations by kind, the longest way through its branches and all rounds of its loops."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass, field

from smajax.export.statements import Assign, Branch, Item, Loop

KINDS = ("add", "mul", "div", "compare", "call")  # call: of math.h


@dataclass(frozen=True)
class Cost:
    """Operations at worst by kind. bounded: whether every loop is known to end; else a loop counts once."""

    operations: Counter[str] = field(default_factory=Counter)
    bounded: bool = True

    @property
    def total(self) -> int:
        return sum(self.operations.values())

    def words(self) -> str:
        """`12 additions, 3 products, ...` for a header."""
        names = {
            "add": "additions",
            "mul": "products",
            "div": "divisions",
            "compare": "comparisons",
            "call": "calls of math.h",
        }
        parts = [f"{self.operations[kind]} {names[kind]}" for kind in KINDS if self.operations[kind]]
        return ", ".join(parts) or "none"


def cost_of(items: Iterable[Item]) -> Cost:
    """Of a body that is written."""
    found, bounded = Counter[str](), True
    for item in items:
        if isinstance(item, Assign) and item.cost:
            found[item.cost] += 1
        elif isinstance(item, Loop):
            test, body = cost_of(item.before), cost_of(item.body)
            rounds = item.count if item.index else item.rounds
            bounded &= test.bounded and body.bounded and rounds is not None
            rounds = 1 if rounds is None else rounds
            for kind in {*test.operations, *body.operations}:
                again = rounds + (0 if item.index else 1)
                found[kind] += again * test.operations[kind] + rounds * body.operations[kind]
        elif isinstance(item, Branch):
            ways = [cost_of(body) for body in item.bodies]
            bounded &= all(way.bounded for way in ways)
            found.update(max(ways, key=lambda way: way.total).operations)
    return Cost(found, bounded)
