"""Packages that smajax needs: each is used, declared and explained, and one of an extra that is missing says how to get it."""

from __future__ import annotations

import ast
import re
import sys
import tomllib
from collections.abc import Callable, Iterator
from pathlib import Path

import jax.numpy as jnp
import numpy as np
import pytest

from smajax.cli.main import main
from smajax.control.tune import adam, cma_es
from smajax.core.extras import MissingExtraError, optional_package
from smajax.fit import posterior
from smajax.simulation.batch.store import Store

ROOT = Path(__file__).parents[1]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
IMPORTED_AS = {"pillow": "PIL", "python-multipart": "python_multipart"}
WITHIN = {"jaxlib": "jax", "markupsafe": "jinja2"}  # a part of another one, of the same authors


def names(requirements: list[str]) -> set[str]:
    return {re.match(r"[\w.-]+", one)[0] for one in requirements}  # type: ignore[index]


RUNTIME = names(PROJECT["dependencies"])
EXTRAS = {extra: names(lines) - {"smajax"} for extra, lines in PROJECT["optional-dependencies"].items()}
OF_EXTRAS = set().union(*(EXTRAS[extra] for extra in ("app", "bayes", "formats", "store", "tune")))


def imports(tree: ast.AST) -> Iterator[str]:
    """Packages that are imported anywhere in a file."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from (one.name.partition(".")[0] for one in node.names)
        elif isinstance(node, ast.ImportFrom) and node.module and not node.level:
            yield node.module.partition(".")[0]


def used() -> set[str]:
    found = {one for file in (ROOT / "smajax").rglob("*.py") for one in imports(ast.parse(file.read_text("utf-8")))}
    return {one for one in found if one not in sys.stdlib_module_names} - {"smajax"}


def test_what_is_imported_is_declared_and_what_is_declared_is_imported() -> None:
    as_imported = {IMPORTED_AS.get(one, one) for one in RUNTIME}
    assert {WITHIN.get(one, one) for one in used()} - OF_EXTRAS == as_imported


def test_a_package_of_an_extra_is_not_imported_before_it_is_used() -> None:
    for file in (ROOT / "smajax").rglob("*.py"):
        own = (
            EXTRAS["app"] if (ROOT / "smajax" / "app") in file.parents else set()
        )  # only `smajax app` imports that room
        for node in ast.parse(file.read_text("utf-8")).body:
            if isinstance(node, ast.Import | ast.ImportFrom):
                assert not set(imports(node)) & (OF_EXTRAS - own), file


def test_the_room_of_the_app_is_imported_by_its_command_alone() -> None:
    importers = {
        file.relative_to(ROOT / "smajax").as_posix()
        for file in (ROOT / "smajax").rglob("*.py")
        if "from smajax.app" in file.read_text("utf-8") and (ROOT / "smajax" / "app") not in file.parents
    }
    assert importers == {"cli/commands/app.py"}


def test_the_guide_lists_the_use_of_every_package() -> None:
    guide = (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8")
    section = guide.partition("\n## Dependencies\n")[2].partition("\n## ")[0]
    rows = [line for line in section.splitlines() if line.startswith("| ")]
    assert [one for one in RUNTIME | OF_EXTRAS if not any(f"`{one}`" in row.split("|")[1] for row in rows)] == []


@pytest.mark.parametrize(
    ("package", "use", "words"),
    [
        ("optax", adam.rule, r"--by adam` needs optax: pip install 'smajax\[tune\]', or .*trust-region"),
        ("zarr", lambda: Store.opened(Path("nowhere")), r"on disk needs zarr: pip install 'smajax\[store\]'"),
    ],
)
def test_a_missing_package_is_named_with_its_extra(
    monkeypatch: pytest.MonkeyPatch, package: str, use: Callable[[], object], words: str
) -> None:
    adam.rule.cache_clear()
    monkeypatch.setitem(sys.modules, package, None)
    with pytest.raises(MissingExtraError, match=words):
        use()


def test_a_posterior_without_its_package_is_an_input_error(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "blackjax", None)
    with pytest.raises(ValueError, match=r"a posterior needs blackjax: pip install 'smajax\[bayes\]'"):
        posterior.library()


def test_a_broken_package_is_not_reported_as_missing(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    (tmp_path / "half_installed.py").write_text("import no_such_package\n")
    monkeypatch.syspath_prepend(tmp_path)
    with pytest.raises(ModuleNotFoundError, match="no_such_package") as caught:
        optional_package("half_installed", "tune", "this test")
    assert not isinstance(caught.value, MissingExtraError)


def test_what_the_readme_runs_after_a_plain_install_needs_no_extra() -> None:
    """`smajax tune` with its defaults imports CMA-ES, and a plain install brings it."""
    imported = set(imports(ast.parse((ROOT / "smajax/control/tune/cma_es.py").read_text("utf-8"))))
    assert imported & (RUNTIME | OF_EXTRAS) <= RUNTIME
    assert "cmaes" in imported


def test_no_generations_of_cma_es_do_without_its_package(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "cmaes", None)
    found = cma_es.evolve(None, np.full(3, 0.5), generations=0)  # type: ignore[arg-type]
    assert found.generations == 0
    assert found.best.tolist() == [0.5, 0.5, 0.5]


def test_tune_without_its_extra_ends_before_the_work_and_leaves_no_folder(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    adam.rule.cache_clear()
    monkeypatch.setitem(sys.modules, "optax", None)
    # The oldest JAX refuses a count of devices once a test has computed something.
    monkeypatch.setattr("smajax.core.runtime.prepare", lambda cores=False: None)
    monkeypatch.setattr(
        sys, "argv", ["smajax", "tune", "pid", "--fast", "--by", "adam", "--out", str(tmp_path / "out")]
    )
    with pytest.raises(SystemExit) as ended:
        main()
    assert ended.value.code == 2
    told = capsys.readouterr().err
    assert "Error: " in told
    assert "pip install 'smajax[tune]'" in told
    assert not (tmp_path / "out").exists()


def test_a_batch_in_memory_needs_no_store(monkeypatch: pytest.MonkeyPatch) -> None:
    import smajax as sma

    monkeypatch.setitem(sys.modules, "zarr", None)
    system = sma.build("flexinol_table_3_2", "dead_weight", "voltage")
    found = sma.run_batch(system, {"voltage": jnp.full(3, 1.0)}, sma.grid(wire_diameter=[1.5e-4, 2e-4]), dt=0.01)
    assert found.sizes["wire_diameter"] == 2
