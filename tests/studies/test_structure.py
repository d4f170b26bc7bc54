"""The stored counts of the package: the README shows them, the script counts right, and today's package keeps to them."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from studies.structure.counts import counted
from studies.structure.imports import Package, best_order, circles, floors, upward

STUDY = Path(__file__).parents[2] / "studies" / "structure"
RECORD = json.loads((STUDY / "record.json").read_text(encoding="utf-8"))


def test_the_table_has_the_stored_counts() -> None:
    rows = [line.strip("| ").split(" | ") for line in (STUDY / "README.md").read_text("utf-8").splitlines()]
    cells = {row[0]: row[1:] for row in rows if len(row) == 3}
    for name, after in RECORD["after"].items():
        assert cells[name] == [str(RECORD["before"][name]), str(after)], name


def test_todays_package_keeps_to_the_record() -> None:
    """Its size may grow; what the redesign was for may not."""
    now, then = counted(STUDY.parents[1]), RECORD["after"]
    for name in ("modules at the top", "rooms", "arrows back up", "circles among modules", "modules over 400 lines"):
        assert now[name] == then[name], f"{name}: `python -m studies.structure` counts it"
    assert now["rooms"] == 12
    assert now["arrows back up"] == now["circles among modules"] == now["modules over 400 lines"] == 0
    assert int(now["methods of the largest contract"]) <= then["methods of the largest contract"]


def test_the_counts_of_a_small_package_are_those_made_by_hand(tmp_path: Path) -> None:
    """a <- b <- c, and c <-> d by an annotation: of c and d one arrow runs back up in every order."""
    files = {
        "__init__": "from smajax.c.two import y",
        "a/__init__": "",
        "a/one": "x = 1",
        "b": "def f():\n    from smajax.a import one",
        "c/__init__": "",
        "c/two": "import smajax.b\nfrom ..d import z\ny = 1",
        "d": "from typing import TYPE_CHECKING\nif TYPE_CHECKING:\n    from .c.two import y",
    }
    for name, text in files.items():
        path = tmp_path / "smajax" / f"{name}.py"
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
    package = Package(tmp_path / "smajax")
    rooms = package.rooms()
    assert rooms == {"a": set(), "b": {"a"}, "c": {"b", "d"}, "d": {"c"}}
    order = best_order(rooms)
    assert order.index("a") < order.index("b") < order.index("c")
    assert len(upward(rooms, order)) == 1
    assert floors(rooms, order) == 4
    assert circles(package.imports) == [{"smajax.c.two", "smajax.d"}]
    assert upward(rooms, ["d", "c", "b", "a"]) == {("b", "a"), ("c", "b"), ("d", "c")}


@pytest.mark.parametrize("size", [2, 5, 9])
def test_a_circle_of_rooms_has_one_arrow_back_up_in_the_order_found(size: int) -> None:
    graph = {f"r{k}": {f"r{(k + 1) % size}"} for k in range(size)}
    assert len(upward(graph, best_order(graph))) == 1
