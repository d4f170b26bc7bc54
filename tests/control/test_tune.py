"""Tuning: its slopes are those of the cost, it improves a bad start, and what its objectives and settings are."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from smajax.control.figures_of_merit import Merit
from smajax.control.gain_search import regulation_cost
from smajax.control.measured_state import Sensor
from smajax.control.presets import CONTROLLERS
from smajax.control.signal_path import Interface
from smajax.control.sweep.batched_loops import LoopSetup, closed_loops
from smajax.control.tune import trust
from smajax.control.tune.evaluate import STEP, TuningProblem
from smajax.control.tune.multistart import Effort, begin, next_round
from smajax.control.tune.objective import Goal, rank, value_and_gradient
from smajax.control.tune.scenarios import between, held_out, tuned_on
from smajax.control.tune.terms import TERMS
from smajax.model.rigs import arm
from smajax.report.tune_words import held_out_sentence
from tests.helpers.tuning_rig import ROWS, SECONDS, SETTINGS

SCENARIOS = tuned_on([0.0, 30.0], {"damping": 0.2}, 0)
# The preset's loops swing on for a while, and a swing multiplies differences.
CALM = {"high_voltage": 9.0, "low_voltage": 3.0, "surface_slope": 3.0, "boundary": 1.0}


@pytest.fixture(scope="module")
def surface() -> TuningProblem:
    return TuningProblem(CONTROLLERS["vsc3"], arm(), seconds=SECONDS, loops=16)


def slopes_are_those_of_differences(rig: TuningProblem, point: np.ndarray) -> None:
    step = 1e-6
    exact = rig.evaluate_gradients(point[None], SCENARIOS, 0.2)
    moved = np.concatenate([point + step * np.eye(len(point)), point - step * np.eye(len(point))])
    terms = rig.evaluate_gradients(moved, SCENARIOS, 0.2).terms
    ahead, behind = np.split(terms, 2)
    differences = np.moveaxis((ahead - behind) / (2.0 * step), 0, -1)
    scale = np.abs(differences).max(axis=(0, 2), keepdims=True) + 1e-3
    assert np.abs(differences).max() > 1.0
    np.testing.assert_allclose(exact.gradients[0] / scale, differences / scale, atol=2e-3)


def test_derivatives_of_every_term_agree_with_differences(surface: TuningProblem) -> None:
    slopes_are_those_of_differences(surface, surface.point(CALM))


@pytest.mark.slow
def test_derivatives_of_a_controller_with_an_integral_agree_with_differences() -> None:
    rig = TuningProblem(CONTROLLERS["pid"], arm(), seconds=SECONDS, loops=8 * 6)
    slopes_are_those_of_differences(rig, rig.before - 0.03)


def test_the_terms_of_the_objective_are_the_figures_of_merit(surface: TuningProblem) -> None:
    """The cost that is judged is the one of the searches in studies/gains, on the loops that a sweep runs."""
    seen = surface.evaluate(surface.before[None], SCENARIOS, STEP)
    rows = np.column_stack([SCENARIOS.rows, np.ones(SCENARIOS.size)])
    rows = rows[np.minimum(np.arange(ROWS), SCENARIOS.size - 1)]
    swept = closed_loops(LoopSetup(surface.system, surface.controller, surface.preset.main_gain, SECONDS), rows).merits
    for field in dataclasses.fields(swept):
        np.testing.assert_allclose(
            np.asarray(getattr(seen.merits, field.name))[0],
            getattr(swept, field.name)[: SCENARIOS.size],
            rtol=1e-6,
            atol=1e-7,
        )
    expected = np.asarray([float(regulation_cost(_one(swept, k), SECONDS)) for k in range(SCENARIOS.size)])
    assert Goal("worst").cost(seen.exact, SCENARIOS)[0] == pytest.approx(expected.max(), rel=1e-6)
    believed = expected[SCENARIOS.nominal].mean()
    assert Goal("nominal").cost(seen.exact, SCENARIOS)[0] == pytest.approx(believed, rel=1e-6)


def _one(merits: Merit, k: int) -> Merit:
    return dataclasses.replace(
        merits,
        **{field.name: np.asarray(getattr(merits, field.name))[k] for field in dataclasses.fields(merits)},
    )


@pytest.mark.parametrize("objective", ["nominal", "worst", "mean-variance"])
def test_the_gradient_of_the_objective_agrees_with_differences(surface: TuningProblem, objective: str) -> None:
    """Through the augmented Lagrangian too: a limit with a multiplier."""
    goal = Goal(objective, limits={"overshoot": 0.5})
    seen = surface.evaluate_gradients(surface.point(CALM)[None], SCENARIOS, 0.2)
    given = (np.asarray([0.3]), np.full((1, SCENARIOS.size, 1), 0.7), np.asarray([4.0]))
    _, slope = value_and_gradient(goal, seen, SCENARIOS, *given)
    step = 1e-6
    for k in range(len(surface.names)):
        ends = [
            value_and_gradient(
                goal, seen._replace(terms=seen.terms + sign * step * seen.gradients[..., k]), SCENARIOS, *given
            )
            for sign in (1.0, -1.0)
        ]
        assert slope[0, k] == pytest.approx(float(ends[0][0][0] - ends[1][0][0]) / (2 * step), rel=1e-4, abs=1e-6)


def test_a_counter_s_steps_are_in_the_loops_that_are_judged_and_noise_where_slopes_are_taken(
    surface: TuningProblem,
) -> None:
    """Of a counted reading every derivative is zero."""
    point = surface.point(CALM)[None]

    def rig(**of_sensor: float) -> TuningProblem:
        interface = Interface(sensor=Sensor(**of_sensor))
        return TuningProblem(CONTROLLERS["vsc3"], arm(), seconds=SECONDS, loops=16, interface=interface)

    counted, noisy, exact = rig(quantum=0.2), rig(noise_sigma=0.2 / 12.0**0.5), rig(noise_sigma=0.0)
    one, other = (each.evaluate_gradients(point, SCENARIOS, 0.2) for each in (counted, noisy))
    np.testing.assert_allclose(one.gradients, other.gradients, rtol=1e-9)
    assert np.abs(one.gradients).max() > 1.0
    coarse, fine = (each.evaluate(point, SCENARIOS, STEP).exact for each in (counted, exact))
    assert np.abs(coarse - fine).max() > 0.1


@pytest.mark.parametrize("by", ["trust-region", "adam"])
def test_a_bad_start_is_improved(surface: TuningProblem, by: str) -> None:
    goal, effort = Goal("worst"), Effort(0, 1, 6, by=by)
    bad = surface.point({"high_voltage": 9.0, "low_voltage": 1.0, "surface_slope": 1.5, "boundary": 1.0})
    now = begin(surface, goal, SCENARIOS, effort, bad)
    while not now.ended:
        now = next_round(surface, goal, SCENARIOS, effort, now)
    first = now.costs[0, 0]
    assert now.best_rank[0] < 0.8 * first
    # What is kept is what is judged.
    again = surface.evaluate(now.best, SCENARIOS, STEP).exact
    assert rank(goal.cost(again, SCENARIOS), goal.excess(again))[0] == pytest.approx(now.best_rank[0], rel=1e-6)


def test_the_linear_program_finds_the_minimum_of_the_maximum() -> None:
    """Two loops whose costs cross: max(1 + 2 d, 1.2 - d) is least at d = 0.2/3; a limit on the second moves it on."""
    scenarios = tuned_on([0.0, 1.0], {}, 0)
    terms, slopes = np.zeros((2, len(TERMS))), np.zeros((2, len(TERMS), 1))
    at = list(TERMS).index("settling_time")
    terms[:, at], slopes[:, at, 0] = (1.0, 1.2), (2.0, -1.0)
    centre = np.asarray([0.5])
    point, predicted = trust.step(Goal("worst"), terms, slopes, scenarios, centre, 0.3)
    assert point[0] - 0.5 == pytest.approx(0.2 / 3.0)
    assert predicted == pytest.approx(1.0 + 0.4 / 3.0)
    point, _ = trust.step(Goal("worst", limits={"settling_time": 1.1}), terms, slopes, scenarios, centre, 0.3)
    assert 0.05 - 1e-9 <= point[0] - 0.5 <= 0.1 + 1e-9
    point, _ = trust.step(Goal("worst"), terms, slopes, scenarios, centre, 0.01)
    assert point[0] - 0.5 == pytest.approx(0.01)


def test_a_tuning_at_one_set_point_is_checked_at_another() -> None:
    for angle, other in ((20.0, 15.0), (-40.0, -35.0), (85.0, 80.0)):
        checks = held_out([angle], {}, 4, 0)
        assert np.degrees(checks["inside"].targets) == pytest.approx([other])
        told = held_out_sentence(dataclasses.replace(SETTINGS, set_points=(angle,), variation={}))
        assert told == "a set point 5° beside, the plant as believed"


@pytest.mark.parametrize(
    ("change", "told"),
    [
        ({"controller": "pdi"}, "did you mean 'pid'"),
        ({"set_points": (0.0, 200.0)}, "stops"),
        ({"set_points": (0.0, 0.0)}, "once"),
        ({"variation": {"inertai": 0.2}}, "did you mean 'inertia'"),
        ({"variation": {"inertia": 20.0}}, "share between 0 and 1"),
        ({"objective": "worts"}, "did you mean 'worst'"),
        ({"weights": {"overshot": 1.0}}, "did you mean 'overshoot'"),
        ({"weights": {"overshoot": 0.0}}, "one at least is more"),
        ({"limits": {"overshoot": -1.0}}, "more than 0"),
        ({"by": "adma"}, "did you mean 'adam'"),
        ({"finish": -1}, "none or more"),
        ({"period": 0.015}, "whole number"),
        ({"estimator": "kalman"}, "printed"),
        ({"start": {"boundary": 1.0}}, "surface_slope"),
        ({"seconds": 4.005}, "whole number of control periods"),
    ],
)
def test_wrong_settings_are_errors(change: dict[str, object], told: str) -> None:
    with pytest.raises(ValueError, match=r".") as error:
        dataclasses.replace(SETTINGS, **change).check(arm())  # type: ignore[arg-type]
    assert told in str(error.value)


def test_held_out_loops_are_not_used_for_tuning() -> None:
    varied = {"inertia": 0.2, "damping": 0.2}
    tuned = tuned_on([0.0, 30.0, 50.0], varied, 0)
    assert tuned.size == 3 * (1 + 4)
    assert int(tuned.nominal.sum()) == 3
    checks = held_out([0.0, 30.0, 50.0], varied, 8, 0)
    seen = {tuple(row) for row in tuned.rows}
    for check in checks.values():
        assert not seen & {tuple(row) for row in check.rows}
    assert np.abs(checks["inside"].rows[:, :2] - 1.0).max() <= 0.2
    assert between([30.0, 0.0, 50.0]) == [15.0, 40.0]
    assert tuned_on([0.0], dict.fromkeys(("inertia", "damping", "convection", "payload"), 0.1), 0).size == 17
