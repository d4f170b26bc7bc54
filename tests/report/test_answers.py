"""The first sentence of a page: what the run or the tuning comes to, with the numbers that matter."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import xarray as xr

from smajax.control.figures_of_merit import Merit, SetPointMerit
from smajax.control.position_unit import PositionUnit
from smajax.control.run_result import RunResult
from smajax.control.tune.terms import TERMS
from smajax.model.presets import build
from smajax.report import simulate_words, tune_answer
from smajax.report.plain_page import headline

COLUMNS = list(TERMS)
SECONDS = 10.0


def tuned(settling: list[list[float]], limits: dict[str, float], unseen: list[float]) -> Any:
    """Loops at 5 and 10 mm, on as many plants as each has times; 2 mm/100 of overshoot a second of settling."""
    targets = np.repeat([0.005, 0.01][: len(settling)], [len(one) for one in settling])

    def check(times: np.ndarray, at: np.ndarray) -> Any:
        exact = np.zeros((2, times.size, len(COLUMNS)))
        exact[1, :, COLUMNS.index("settling_time")] = np.where(np.isfinite(times), times, 2.0 * SECONDS)
        exact[1, :, COLUMNS.index("overshoot")] = 0.02 * np.where(np.isfinite(times), times, 0.0)
        exact[1, :, COLUMNS.index("steady_error")] = 1e-9
        return SimpleNamespace(seen=SimpleNamespace(exact=exact), scenarios=SimpleNamespace(targets=at))

    settings = SimpleNamespace(
        controller="pid",
        seconds=SECONDS,
        limits=limits,
        shown=PositionUnit("mm", "m"),
        variation={"damping": 0.2},
        batch=0,
    )
    checks = {
        "tuned on": check(np.concatenate(settling), targets),
        "inside": check(np.asarray(unseen), np.full(len(unseen), 0.0075)),
    }
    return SimpleNamespace(settings=settings, checks=checks)


def test_a_tuning_that_reaches_every_set_point_says_when_and_how_far_off() -> None:
    result = tuned([[1.0, 2.0], [3.0, 2.5]], {}, [2.0])
    assert tune_answer.answer(result) == (
        "The tuned gains of pid settle in all 4 loops, at 5 mm after 2 s and at 10 mm after 3 s at the latest; the overshoot is at most "
        "0.06 mm, the steady error at most 0 mm. On plants and set points never seen they do in 1 of 1."
    )
    head, rows = tune_answer.set_point_rows(result)
    assert head[:2] == ["set point (mm)", "plants that settle"]
    assert rows == [["5", "2 of 2", "1.5", "2", "0.04", "0"], ["10", "2 of 2", "2.75", "3", "0.06", "0"]]


def test_no_plants_are_said_to_be_new_where_none_varied() -> None:
    result = tuned([[1.0], [3.0]], {}, [2.0])
    result.settings.variation = {}
    assert tune_answer.answer(result).endswith("On set points never seen they do in 1 of 1.")


def test_a_tuning_that_does_not_says_where_and_on_which_share_of_the_plants() -> None:
    result = tuned([[1.0, 2.0], [3.0, np.inf]], {}, [2.0, np.inf])
    said = tune_answer.answer(result)
    assert "settle in 3 of 4 loops, at 5 mm after 2 s and at 10 mm not on every plant;" in said
    assert said.endswith("never seen they do in 1 of 2.")
    none = tune_answer.answer(tuned([[np.inf, np.inf], [3.0, np.inf]], {}, [np.inf]))
    assert "settle in 1 of 4 loops, at 5 mm on no plant and at 10 mm not on every plant;" in none
    assert none.endswith("never seen they do in none of 1.")
    alone = tune_answer.answer(tuned([[np.inf]], {}, [2.0]))
    assert alone.startswith("The tuned gains of pid settle in none of 1 loop, at 5 mm on no plant;")
    limited = tuned([[1.0, 2.0], [3.0, 2.0]], {"settling_time": 2.5}, [2.0])
    assert "settle and keep every limit in 3 of 4 loops" in tune_answer.answer(limited)
    head, rows = tune_answer.set_point_rows(limited)
    assert head[1] == "plants that settle within the limits"
    assert [row[1] for row in rows] == ["2 of 2", "1 of 2"]
    never = tuned([[1.0], [np.inf]], {}, [2.0])
    assert tune_answer.set_point_rows(never)[1][1][2:4] == ["never", "never"]


def merit(settling_time: float, overshoot: float, steady_error: float) -> Merit:
    rest: dict[str, Any] = dict.fromkeys(
        ("reach_time", "steady_offset", "energy", "switches_per_second", "peak_temperature"), 0.0
    )
    figures = {"settling_time": settling_time, "overshoot": overshoot, "steady_error": steady_error}
    return Merit(**{**rest, **figures})


def test_a_closed_loop_says_whether_it_settles_and_an_open_run_where_it_goes() -> None:
    system = build("flexinol_table_3_2", "dead_weight", "flexinol_voltage")
    units = {"temperature": "degC", "martensite_fraction": "-", "stress": "Pa", "position": "m", "reading": "m"}
    rising = np.linspace(0.0, 0.01, 11)
    data = xr.Dataset({name: ("time", rising, {"units": unit}) for name, unit in units.items()})
    data = data.assign_coords(time=("time", np.linspace(0.0, 1.0, 11), {"units": "s"}))
    assert simulate_words.answer(RunResult(data, system, {}, ())) == (
        "The position starts at 0 mm, lies between 0 mm and 10 mm, and ends at 10 mm."
    )
    still = data.assign(martensite_fraction=("time", np.ones(11), {"units": "-"}))
    assert simulate_words.answer(RunResult(still, system, {}, ())) == (
        "The position starts at 0 mm, lies between 0 mm and 10 mm, and ends at 10 mm. "
        "The wire is at most 0.01 °C, 1 s in. It does not transform: the martensite fraction stays at 1."
    )
    data["wanted"] = ("time", np.full(11, 0.005), {"units": "m"})
    data = data.assign_attrs(controller="pid")

    def said(one: Merit) -> str:
        return simulate_words.answer(RunResult(data, system, dict(vars(one)), ()))

    assert said(merit(2.5, 1e-4, 2e-5)) == (
        "pid settles at 5 mm after 2.5 s, with an overshoot of 0.1 mm and a steady error of 0.02 mm."
    )
    assert said(merit(np.inf, 0.0, 1e-3)) == (
        "pid does not settle at 5 mm within 1 s: an overshoot of 0 mm and a steady error of 1 mm."
    )
    several = tuple(
        SetPointMerit(0.0, 1.0, point, merit(late, 1e-4, error))
        for point, late, error in ((0.005, 2.5, 1e-5), (0.01, np.inf, 1e-3))
    )
    assert simulate_words.answer(RunResult(data, system, {}, (), several)) == (
        "pid settles at 1 of 2 set points: 5 mm after 2.5 s, 10 mm not within 1 s; an overshoot of at most 0.1 mm and a steady error of at most 1 mm."
    )


def test_the_answer_is_escaped() -> None:
    assert headline("a < b") == "<p class=headline>a &lt; b</p>"
    assert headline("") == ""
