"""Every notebook runs from top to bottom, its stored outputs are those of a run, and its numbers are as stated.

Its cells are run here, in the process of the tests, which share compiled programs: a Jupyter kernel for each would take a minute more.
"""

from __future__ import annotations

import ast
import contextlib
import io
import json
import re
from pathlib import Path
from typing import Any

import matplotlib
import pytest

ROOT = Path(__file__).parents[2]
NOTEBOOKS = ROOT / "notebooks"
SOURCES = sorted(NOTEBOOKS.glob("*.py"))
AGAIN = "`python -m studies.make_notebooks` writes the notebooks anew"
MOST = 3_000_000  # bytes of all notebooks together
NUMBER = re.compile(r"(?<![\w.])[-+]?\d+(?:\.\d*)?(?:e[-+]?\d+)?")
# Another processor or version of JAX rounds otherwise: a number may be off by this share, or by one in its last digit.
SAME = 1e-3
# Of a search that stops early, the rounding decides more: by this share.
SHARES = {6: 0.02}


def stored(number: int) -> list[dict[str, Any]]:
    (path,) = NOTEBOOKS.glob(f"{number:02d}_*.ipynb")
    cells: list[dict[str, Any]] = json.loads(path.read_text(encoding="utf-8"))["cells"]
    return cells


def text_of(cell: dict[str, Any]) -> str:
    return "".join("".join(output.get("text", "")) for output in cell["outputs"])


def differences(shown: str, printed: str, share: float = SAME) -> list[str]:
    """Where two texts differ in their words, or in a number by more than `share` and one in its last digit."""
    if NUMBER.sub("#", shown).split() != NUMBER.sub("#", printed).split():
        return [f"stored:\n{shown}\nprinted:\n{printed}"]
    found = []
    for one, other in zip(NUMBER.findall(shown), NUMBER.findall(printed), strict=True):
        mantissa, _, power = one.partition("e")
        last = 10.0 ** (int(power or 0) - len(mantissa.partition(".")[2]))
        if abs(float(one) - float(other)) > max(1.001 * last, share * abs(float(one))):
            found.append(f"{one} is stored and {other} printed")
    return found


@pytest.fixture
def run(monkeypatch: pytest.MonkeyPatch) -> Any:
    """Runs one by its number, from the folder of the notebooks as Jupyter does, and holds its output to what is stored; its names."""
    monkeypatch.chdir(NOTEBOOKS)
    matplotlib.use("agg")
    import matplotlib.pyplot as plt

    def run(number: int) -> dict[str, Any]:
        names: dict[str, Any] = {"__name__": "__main__"}
        shown: list[int] = []
        monkeypatch.setattr(plt, "show", lambda: shown.append(len(plt.get_fignums())))
        try:
            for cell in stored(number):
                if cell["cell_type"] != "code" or "skip-execution" in cell["metadata"].get("tags", ()):
                    continue
                shown.clear()
                printed = io.StringIO()
                with contextlib.redirect_stdout(printed):
                    exec(compile("".join(cell["source"]), cell["id"], "exec"), names)
                plt.close("all")
                differ = differences(text_of(cell), printed.getvalue(), SHARES.get(number, SAME))
                assert differ == [], f"{cell['id']}: {AGAIN}"
                pictures = sum("image/png" in output.get("data", {}) for output in cell["outputs"])
                assert pictures == sum(shown), f"{cell['id']}: {AGAIN}"
        finally:
            plt.close("all")
        return names

    return run


def test_every_notebook_is_run_here() -> None:
    names = Path(__file__).read_text(encoding="utf-8")
    assert [name for name in SOURCES if f"run({int(name.name[:2])})" not in names] == []
    assert [path.stem for path in sorted(NOTEBOOKS.glob("*.ipynb"))] == [path.stem for path in SOURCES]


@pytest.mark.parametrize("path", SOURCES, ids=lambda path: path.stem)
def test_a_notebook_has_the_cells_of_its_source(path: Path) -> None:
    """And is a notebook in which everything was run, in order, by the format's own check."""
    nbformat = pytest.importorskip("nbformat", reason="nbformat is not installed: pip install -e '.[dev]'")
    pytest.importorskip("jupytext", reason="jupytext is not installed: pip install -e '.[dev]'")
    from studies.make_notebooks import source

    notebook = nbformat.read(path.with_suffix(".ipynb"), as_version=4)
    nbformat.validate(notebook)
    made = source(path)
    assert [(one.id, one.cell_type, one.source) for one in notebook.cells] == [
        (one.id, one.cell_type, one.source) for one in made.cells
    ], AGAIN
    run = [one for one in notebook.cells if one.cell_type == "code" and "tags" not in one.metadata]
    assert [one.execution_count for one in run] == list(range(1, len(run) + 1)), AGAIN


@pytest.mark.parametrize("path", SOURCES, ids=lambda path: path.stem)
def test_a_notebook_begins_with_its_installation_and_needs_the_public_names_alone(path: Path) -> None:
    cells = stored(int(path.stem[:2]))
    code = ["".join(cell["source"]) for cell in cells if cell["cell_type"] == "code"]
    assert re.fullmatch(r"%pip install -q '?smajax(\[tune\]')?", code[0])
    imports = [
        node for text in code[1:] for node in ast.walk(ast.parse(text)) if isinstance(node, ast.Import | ast.ImportFrom)
    ]
    ours = [ast.unparse(one) for one in imports if "smajax" in ast.unparse(one) or "studies" in ast.unparse(one)]
    assert ours == ["import smajax as sma"]
    assert "noqa" not in "".join(code)
    assert "SMAJAX_FAST" not in "".join(code)


def test_the_notebooks_are_small() -> None:
    assert sum(path.stat().st_size for path in NOTEBOOKS.glob("*.ipynb")) < MOST


def test_a_stored_output_that_is_wrong_is_found() -> None:
    assert differences("7.2 V: ends at 14.8 degrees", "7.2 V: ends at 14.9 degrees") == []
    assert differences("7.2 V: ends at 14.8 degrees", "7.2 V: ends at 15.2 degrees")
    assert differences("1.234e-05 mm", "1.236e-05 mm")
    assert differences("explained", "adequate")
    assert differences("1 2", "1")


def test_the_loop_names_what_is_missing(run: Any) -> None:
    names = run(1)
    assert names["findings"].verdict == "explained"
    assert {one.name: one.added for one in names["findings"].effects} == {"latent_heat": True, "sensor_lag": False}
    assert (names["out"] / "report.html").is_file()


def test_a_first_simulation(run: Any) -> None:
    ends = run(2)["ends"]
    assert ends[7.2] < 20.0 < 85.0 < ends[7.3]


def test_the_old_conditions_stall_and_the_enhanced_ones_reach(run: Any) -> None:
    names = run(3)
    assert names["ends"]["liang"] < 60.0
    assert names["ends"]["enhanced"] == pytest.approx(85.0, abs=0.1)
    assert names["risen"] > 1.0
    assert names["left"] > 5.0


def test_a_sweep(run: Any) -> None:
    names = run(4)
    spread = names["spread"]
    assert spread[2] > 2.0 * max(spread[0], spread[-1])
    assert names["stored"].sizes == {"sample": names["runs"]}


def test_a_measured_wire_is_identified(run: Any, measured_data: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SMAJAX_DATA", str(measured_data.resolve()))
    assert {role for role, error in run(5)["errors"].values() if error < 0.06} == {"fit", "held-out"}


def test_gains_are_tuned(run: Any) -> None:
    result = run(6)["result"]
    assert result.within_limits
    assert result.excesses["tuned on"][0] > 0.0, "the preset must not meet the limit, or this says nothing"


def test_a_measured_bench_from_log_to_conclusion(
    run: Any, measured_data: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("SMAJAX_DATA", str(measured_data.resolve()))
    names = run(7)
    for entry in names["report"]["runs"]:
        for when in ("before", "after"):
            assert names["errors"][entry["name"], when] == pytest.approx(entry[f"rmse_{when}"], rel=1e-2)


def test_an_effect_and_a_load_of_ones_own(run: Any) -> None:
    names = run(8)
    assert names["same"]
    strokes = names["strokes"]
    assert strokes["still air"][3] == pytest.approx(strokes["still air"][1], rel=1e-3)
    assert strokes["a fan comes on"][3] < strokes["a fan comes on"][0] - 1e-3
    assert names["slope"] < -1e-5


def test_the_sources_discovery_is_made_again(run: Any) -> None:
    names = run(9)
    assert [effect.name for effect in names["added"]] == ["enhanced_conditions"]
    assert names["share"] == pytest.approx(1.0, abs=0.01)
    assert abs(names["net"]) > 0.2
    assert names["held_out"].rmse_after < 0.1 * names["held_out"].rmse_before
    assert names["content"].verdict == "adequate"
