"""Every notebook runs from top to bottom, and what it tells is so."""

from __future__ import annotations

import runpy
from pathlib import Path
from typing import Any

import matplotlib
import pytest

NOTEBOOKS = Path(__file__).parents[2] / "notebooks"


@pytest.fixture
def run(monkeypatch: pytest.MonkeyPatch) -> Any:
    """Runs one by its number, in the fast setting, from the repository's root; what it has defined."""
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
    told = Path(__file__).read_text(encoding="utf-8")
    assert [name for name in sorted(NOTEBOOKS.glob("*.py")) if f"run({int(name.name[:2])})" not in told] == []


def test_the_loop_names_what_is_missing(run: Any) -> None:
    told = run(1)
    assert told["findings"].verdict == "explained"
    assert {one.name: one.added for one in told["findings"].effects} == {"latent_heat": True, "sensor_lag": False}
    assert (told["out"] / "report.html").is_file()


def test_a_first_simulation(run: Any) -> None:
    ends = run(2)["ends"]
    assert ends[7.2] < 20.0 < 85.0 < ends[7.3]


def test_the_old_conditions_stall_and_the_enhanced_ones_reach(run: Any) -> None:
    told = run(3)
    assert told["ends"]["liang"] < 60.0
    assert told["ends"]["enhanced"] == pytest.approx(85.0, abs=0.1)
    assert told["risen"] > 1.0
    assert told["left"] > 5.0


def test_a_sweep(run: Any) -> None:
    told = run(4)
    spread = told["spread"]
    assert spread[2] > 2.0 * max(spread[0], spread[-1])
    assert told["kept"].sizes == {"sample": told["members"]}


def test_a_measured_wire_is_identified(run: Any, measured_data: Path) -> None:
    assert measured_data.is_dir()
    assert {role for role, error in run(5)["errors"].values() if error < 0.06} == {"fit", "held-out"}


def test_gains_are_tuned(run: Any) -> None:
    found = run(6)["found"]
    assert found.within_limits
    assert found.excesses["tuned on"][0] > 0.0, "the preset must not meet the limit, or this says nothing"


def test_a_measured_bench_from_log_to_conclusion(run: Any, measured_data: Path) -> None:
    assert measured_data.is_dir()
    told = run(7)
    for entry in told["report"]["runs"]:
        for when in ("before", "after"):
            assert told["errors"][entry["name"], when] == pytest.approx(entry[f"rmse_{when}"], rel=1e-2)


def test_an_effect_and_a_load_of_ones_own(run: Any) -> None:
    told = run(8)
    assert told["same"]
    strokes = told["strokes"]
    assert strokes["still air"][3] == pytest.approx(strokes["still air"][1], rel=1e-3)
    assert strokes["a fan comes on"][3] < strokes["a fan comes on"][0] - 1e-3
    assert told["slope"] < -1e-5


def test_the_sources_discovery_is_made_again(run: Any) -> None:
    told = run(9)
    assert [effect.name for effect in told["added"]] == ["enhanced_conditions"]
    assert told["share"] == pytest.approx(1.0, abs=0.01)
    assert abs(told["net"]) > 0.2
    assert told["held_out"].rmse_after < 0.1 * told["held_out"].rmse_before
    assert told["content"].verdict == "adequate"
