"""Every notebook runs from top to bottom, and its numbers are as stated."""

from __future__ import annotations

import runpy
from pathlib import Path
from typing import Any

import matplotlib
import pytest

NOTEBOOKS = Path(__file__).parents[2] / "notebooks"


@pytest.fixture
def run(monkeypatch: pytest.MonkeyPatch) -> Any:
    """Runs one by its number, in the fast setting, from the repository's root; the names that it defines."""
    monkeypatch.setenv("SMAJAX_FAST", "1")
    monkeypatch.chdir(NOTEBOOKS.parent)
    matplotlib.use("agg")
    import matplotlib.pyplot as plt

    def run(number: int) -> dict[str, Any]:
        (path,) = NOTEBOOKS.glob(f"{number:02d}_*.py")
        try:
            return runpy.run_path(str(path), run_name="__main__")
        finally:
            plt.close("all")

    return run


def test_every_notebook_is_run_here() -> None:
    names = Path(__file__).read_text(encoding="utf-8")
    assert [name for name in sorted(NOTEBOOKS.glob("*.py")) if f"run({int(name.name[:2])})" not in names] == []


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


def test_a_measured_wire_is_identified(run: Any, measured_data: Path) -> None:
    assert measured_data.is_dir()
    assert {role for role, error in run(5)["errors"].values() if error < 0.06} == {"fit", "held-out"}


def test_gains_are_tuned(run: Any) -> None:
    result = run(6)["result"]
    assert result.within_limits
    assert result.excesses["tuned on"][0] > 0.0, "the preset must not meet the limit, or this says nothing"


def test_a_measured_bench_from_log_to_conclusion(run: Any, measured_data: Path) -> None:
    assert measured_data.is_dir()
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
