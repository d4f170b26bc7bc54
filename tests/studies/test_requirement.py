"""The requirement on the filter is judged on loops that nothing was tuned on, and its table is of the stored numbers."""

from __future__ import annotations

import dataclasses
import json

import numpy as np
import pytest

from smajax.control.estimators.adaptive_filter import AdaptiveFilter
from smajax.control.gains_file import read_gains
from smajax.control.least_time import least_reach_times
from smajax.control.presets import CONTROLLERS, OF_THE_SOURCE, with_printed_law
from smajax.control.signal_path import interface_of
from smajax.control.sweep.batched_loops import LoopSetup, closed_loops
from smajax.control.sweep.grid import loop_rows
from smajax.control.tune.terms import TERMS
from smajax.model.rigs import arm
from studies.requirement.run import (
    COMPARED,
    FRONTIER,
    FRONTIER_MARK,
    GAINS,
    HERE,
    MARK,
    SECONDS,
    STEP,
    frontier_table,
    gains_of,
    judged_on,
    table,
)
from studies.requirement.search import (
    ALSO,
    DELAY,
    FILTER,
    FULL,
    LIMITS,
    MARGIN,
    NOISE,
    PERIOD,
    SET_POINTS,
    box_of,
    costs,
    least_times,
    searched_on,
)


def test_loops_that_judge_are_none_of_those_that_gains_were_searched_on() -> None:
    rows = judged_on()
    nearest = np.abs(np.degrees(rows[:, 6])[:, None] - np.asarray(SET_POINTS)).min(axis=1)
    corner = (np.abs(np.abs(rows[:, :3] - 1.0) - 0.2) < 1e-9).all(axis=1)
    assert nearest[corner].min() > 0.1
    assert (np.abs(rows[:, :3] - 1.0) <= 0.2 + 1e-9).all()
    searched = searched_on().rows
    apart = np.abs(rows[:, None, [0, 1, 2, 6]] - searched[None, :, [0, 1, 2, 6]]).max(axis=2)
    assert apart.min() > 1e-3


def test_the_cost_counts_loops_beyond_the_limits_and_then_how_far() -> None:
    met = np.zeros((1, 4, len(TERMS)))
    assert costs(met)[0] == 0.0
    at = list(TERMS).index("overshoot")
    one, two, far = met.copy(), met.copy(), met.copy()
    one[0, 0, at] = 2.0 * MARGIN * LIMITS["overshoot"]
    two[0, :2, at] = 2.0 * MARGIN * LIMITS["overshoot"]
    far[0, 0, at] = 3.0 * MARGIN * LIMITS["overshoot"]
    assert 0.0 < costs(one)[0] < costs(two)[0]
    assert costs(one)[0] < costs(far)[0]


def test_a_weight_makes_the_quicker_of_two_cheaper_and_no_limit_looser() -> None:
    terms, least = np.zeros((3, 4, len(TERMS))), np.full(4, 1.2)
    at = [list(TERMS).index(name) for name in ("settling_time", "overshoot")]
    terms[:, :, at[0]] = np.asarray([1.5, 2.5, 1.5])[:, None]
    terms[2, 0, at[1]] = 2.0 * LIMITS["overshoot"]
    quick, slow, beyond = costs(terms, least, 0.5)
    assert quick < slow < beyond


def test_the_limit_of_the_command_is_searched_up_to_the_drives() -> None:
    assert box_of("sld")["largest_voltage"] == ALSO["largest_voltage"]
    assert "braking" not in box_of("pid")


def test_the_stored_results_are_of_every_controller_and_in_the_table() -> None:
    whole = json.loads((HERE / "results.json").read_text(encoding="utf-8"))
    results, page = whole["controllers"], (HERE / "README.md").read_text(encoding="utf-8")
    assert list(results) == list(COMPARED)
    assert set(OF_THE_SOURCE) < set(COMPARED) <= set(CONTROLLERS)
    assert {name for name, one in results.items() if one["gains"] != "preset"} == {
        path.stem for path in GAINS.glob("*.json")
    }
    assert all(one["filter"]["loops"] == len(judged_on()) for one in results.values())
    assert page.split(MARK)[1].strip() == table(results)
    assert page.split(FRONTIER_MARK)[1].strip() == frontier_table(whole["frontier"])
    assert set(whole["frontier"]) == {path.stem.replace("_", " ") for path in FRONTIER.glob("*.json")}
    assert all(one["gains"] == gains_of(name)[1] for name, one in results.items())


def test_the_stored_loops_are_those_that_settle_that_fail_and_that_are_out_of_reach() -> None:
    whole = json.loads((HERE / "results.json").read_text(encoding="utf-8"))
    for one in (*(one["filter"] for one in whole["controllers"].values()), *whole["frontier"].values()):
        for over in (one["over_least_time"], one["over_least_time_under_own_limit"]):
            assert over["settled"] + over["never"] + over["unreachable"] == one["loops"]
            assert over["settled"] == one["settled"]
            # No command within the limit is there earlier.
            assert over["median"] is None or 1.0 <= over["median"] <= over["worst"]
        full, own = one["over_least_time"], one["over_least_time_under_own_limit"]
        assert own["limit_V"] <= full["limit_V"] == FULL
        assert own["median"] is None or own["median"] <= full["median"]


def test_four_controllers_meet_the_requirement_in_99_per_cent_of_the_loops() -> None:
    """With noise, steps of the reading and delay, as the page says."""
    results = json.loads((HERE / "results.json").read_text(encoding="utf-8"))["controllers"]
    met = {name for name, one in results.items() if one["filter"]["met"] >= 0.99 * one["filter"]["loops"]}
    assert met == {"backstepping1_integral", "feedforward_pi", "receding_horizon", "sld"}
    assert {name for name, one in results.items() if "nominal_filter" in one} == met


def test_no_stored_loop_of_an_approach_that_the_wire_can_follow_leaves_its_set_point() -> None:
    frontier = json.loads((HERE / "results.json").read_text(encoding="utf-8"))["frontier"]
    assert all(one["worst_overshoot_deg"] < 3.0 for name, one in frontier.items() if not name.startswith("braking 40"))


def test_least_times_are_those_of_the_limit_and_the_plant_that_are_asked_for() -> None:
    angles = np.radians([-40.0, 30.0, 85.0])
    found = least_times(loop_rows({}, angles), 8.7, with_printed_law)
    np.testing.assert_allclose(found, least_reach_times(with_printed_law(arm()), angles, 8.7, 4.0, 0.01), atol=1e-9)


@pytest.mark.slow
def test_the_filter_that_keeps_the_branch_is_what_holds_the_loop_that_left_its_set_point() -> None:
    plant, rows = arm(), judged_on()
    gains = read_gains(FRONTIER / "braking_20_position_gain_400.json", plant)
    between = interface_of(plant, FILTER, NOISE, PERIOD, STEP, DELAY)
    filtered, worst = between.estimator, {}
    assert isinstance(filtered, AdaptiveFilter)
    for keeps in (True, False):
        below = dataclasses.replace(filtered.filter, keeps_branches=keeps)
        interface = dataclasses.replace(between, estimator=dataclasses.replace(filtered, filter=below))
        setup = LoopSetup(plant, gains.put(plant), "damping_gain", SECONDS, STEP, interface)
        worst[keeps] = float(np.degrees(closed_loops(setup, rows).merits.overshoot.max()))
    assert worst[True] < 3.0
    assert worst[False] > 20.0
