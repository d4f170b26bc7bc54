"""Where `smajax figures` gets the figures from: the checkout, a wheel's `smajax_studies`, and never a user's `studies`."""

from __future__ import annotations

import ast
import shutil
import subprocess
import sys
import tomllib
from collections.abc import Iterator
from pathlib import Path

import pytest

from smajax.cli import source_figures

ROOT = Path(__file__).parents[2]


@pytest.fixture(autouse=True)
def _modules_as_before() -> Iterator[None]:
    def own() -> set[str]:
        return {name for name in sys.modules if name.partition(".")[0] == source_figures.NAME}

    before = {name: sys.modules.pop(name) for name in own()}
    yield
    for name in own():
        del sys.modules[name]
    sys.modules.update(before)


def test_a_checkout_has_them_in_studies() -> None:
    catalogue = source_figures.load("catalogue")
    assert catalogue.__file__ == str(ROOT / "studies" / "source" / "catalogue.py")
    assert len(catalogue.every_row()) == 41


def test_a_wheel_has_them_beside_the_package_and_a_users_studies_are_left_alone(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    source_figures.load("catalogue")  # of the checkout: what another place has must not be mixed with it
    shutil.copytree(ROOT / "studies" / "source", tmp_path / "site" / "smajax_studies")
    users = tmp_path / "work" / "studies" / "source"
    users.mkdir(parents=True)
    for name in ("catalogue", "write", "__init__"):
        (users / f"{name}.py").write_text("raise RuntimeError('a package of the user was imported')\n")
    (users.parent / "__init__.py").write_text("raise RuntimeError('a package of the user was imported')\n")
    monkeypatch.chdir(tmp_path / "work")
    monkeypatch.syspath_prepend(tmp_path / "work")
    catalogue = source_figures.load("catalogue", tmp_path / "site")
    assert Path(catalogue.__file__ or "").is_relative_to(tmp_path / "site")
    assert Path(catalogue.m01_block_loop.__file__).is_relative_to(tmp_path / "site")


def test_without_them_the_error_says_what_to_do(tmp_path: Path) -> None:
    with pytest.raises(FileNotFoundError, match=r"not installed.*pip install --force-reinstall smajax.*checkout"):
        source_figures.load("catalogue", tmp_path)


def test_the_command_in_a_users_folder_with_studies_of_its_own(tmp_path: Path) -> None:
    """`python -m` puts the working folder first on the path."""
    (tmp_path / "studies").mkdir()
    (tmp_path / "studies" / "__init__.py").write_text("raise RuntimeError('a package of the user was imported')\n")
    ended = subprocess.run(
        [sys.executable, "-m", "smajax", "figures", "M99"], cwd=tmp_path, capture_output=True, text=True, timeout=120
    )
    assert ended.returncode == 2
    assert "No figure `M99`; there are chapter3" in ended.stderr


def test_the_wheel_is_told_to_have_them() -> None:
    wheel = tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["hatch"]["build"]["targets"]["wheel"]
    assert wheel["force-include"] == {"studies/source": source_figures.NAME}


def test_nothing_of_the_package_imports_the_studies_and_the_figures_import_only_the_package() -> None:
    """The figures run under another name in a wheel, where there is no `studies`."""
    for folder in ("smajax", "studies/source"):
        for file in (ROOT / folder).rglob("*.py"):
            for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
                names = [node.module or ""] if isinstance(node, ast.ImportFrom) else []
                names += [one.name for one in node.names] if isinstance(node, ast.Import) else []
                assert not any(one.split(".")[0] in ("studies", source_figures.NAME) for one in names), file
