"""Module paths of version 0.1 lead to today's modules; in processes of their own, because imports happen once."""

from __future__ import annotations

import ast
import re
import subprocess
import sys
from pathlib import Path

import pytest

from smajax.core.moved_modules import MODULES, PACKAGES, UNTIL, new_path

PACKAGE = Path(__file__).parents[2] / "smajax"
# A statement, or a line of a program in a text; whole files take ten times as long to parse.
IMPORT = re.compile(r"^[ \t]*((?:from|import) smajax\b[^\n;(]*(?:\([^)]*\))?)", re.MULTILINE)


def run(program: str, *options: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run([sys.executable, *options, "-c", program], capture_output=True, text=True, timeout=300)


def exists(path: str) -> bool:
    file = PACKAGE.joinpath(*path.split("."))
    return file.with_suffix(".py").is_file() or (file / "__init__.py").is_file()


@pytest.mark.parametrize("table", [MODULES, PACKAGES], ids=["modules", "packages"])
def test_every_old_path_leads_to_a_module_that_exists(table: dict[str, str]) -> None:
    """Who renames a module of this table writes its new path there."""
    assert [f"{old} -> {new}" for old, new in table.items() if not exists(new)] == []


def test_no_module_of_today_is_hidden_by_an_old_path() -> None:
    for file in PACKAGE.rglob("*.py"):
        name = ".".join(file.relative_to(PACKAGE.parent).with_suffix("").parts).removesuffix(".__init__")
        assert new_path(name) is None, name


def test_an_old_path_gives_the_same_objects_and_names_the_new_path() -> None:
    """As users and plug-ins wrote them."""
    ended = run(
        """
import warnings
warnings.simplefilter("always")
with warnings.catch_warnings(record=True) as warned:
    from smajax.effects.base import AbstractEffect
    from smajax.parameters import parameter
    from smajax.presets import build
    from smajax.simulate import simulate
    from smajax.wire.renewal import __name__ as moved_within_its_package
import smajax as sma
from smajax.core.parameters import parameter as todays
assert AbstractEffect is sma.AbstractEffect and build is sma.build and parameter is sma.parameter is todays
assert sma.simulate is simulate, "a function goes before the module of its name"
assert moved_within_its_package.startswith("smajax.model.wire."), moved_within_its_package
import smajax.effects.base as by_old, smajax.model.effects.base as by_new
assert by_old is by_new and by_new.__spec__.name == by_new.__name__ == "smajax.model.effects.base"
assert {one.category for one in warned} == {DeprecationWarning} and {one.filename for one in warned} == {"<string>"}
print(*(one.message for one in warned), sep="\\n")
"""
    )
    assert ended.returncode == 0, ended.stderr
    end = f"the old path is removed in version {UNTIL}"
    for line in (
        f"smajax.effects.base is smajax.model.effects.base now; {end}",
        f"smajax.parameters is smajax.core.parameters now; {end}",
        f"smajax.presets is smajax.model.presets now; {end}",
        f"smajax.simulate is smajax.simulation.simulate now; {end}",
    ):
        assert line in ended.stdout.splitlines()


@pytest.mark.slow
def test_every_module_of_the_table_is_imported_by_its_old_path() -> None:
    ended = run(
        """
import importlib, sys
from smajax.core.moved_modules import MODULES, PACKAGES
for old, new in {**PACKAGES, **MODULES}.items():
    assert importlib.import_module(f"smajax.{old}") is importlib.import_module(f"smajax.{new}"), old
import smajax as sma
for name in sma.NAMES:
    assert type(getattr(sma, name)).__name__ != "_Package" and not isinstance(getattr(sma, name), type(sys)), name
""",
        "-W",
        "ignore",
    )
    assert ended.returncode == 0, ended.stderr


def test_a_removed_module_names_its_successor_and_a_misspelt_one_is_not_found() -> None:
    assert "smajax_studies of a wheel" in run("import smajax.figures.row").stderr
    assert "No module named 'smajax.model.effects.no_such'" in run("import smajax.effects.no_such").stderr
    assert "No module named 'smajax.no_such'" in run("import smajax.no_such").stderr


def test_importing_smajax_loads_the_table_and_nothing_more() -> None:
    ended = run(
        """
import sys
before = set(sys.modules)
import smajax
print(*sorted(name for name in set(sys.modules) - before if name.startswith("smajax.")))
"""
    )
    assert ended.stdout.split() == ["smajax.core", "smajax.core.moved_modules"], ended.stderr


@pytest.mark.parametrize("folder", ["smajax", "studies", "tests", "notebooks"])
def test_no_file_of_the_repository_imports_an_old_path(folder: str) -> None:
    for file in (PACKAGE.parent / folder).rglob("*.py"):
        if file == Path(__file__):
            continue
        for statement in IMPORT.findall(file.read_text(encoding="utf-8")):
            (node,) = ast.parse(statement).body
            names = [one.name for one in node.names] if isinstance(node, ast.Import) else []
            if isinstance(node, ast.ImportFrom) and node.module:
                names = [node.module, *(f"{node.module}.{one.name}" for one in node.names if node.module != "smajax")]
            assert [one for one in names if new_path(one)] == [], file
