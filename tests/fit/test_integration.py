"""What integration leaves in the outputs of a fit is below a tenth of their noise, whatever the clock of the log."""

from __future__ import annotations

import dataclasses
import itertools
from functools import cache
from types import SimpleNamespace

import jax.numpy as jnp
import numpy as np
import pytest

from smajax.fit import integration
from smajax.fit.integration import (
    LARGEST,
    choose_integration,
    described,
    integration_error,
    limited_near,
    with_integration,
)
from smajax.fit.levenberg_marquardt import FitSettings, levenberg_marquardt
from smajax.fit.outputs_of_runs import predicted_and_derivatives, predicted_at
from smajax.fit.problem import Problem
from smajax.model.extended import extended
from smajax.simulation.steppers import ONE_STEP, Integration
from studies import integration as study
from tests.helpers.often import often


@cache
def _problem(name: str, clock: float) -> Problem:
    """A log of a rig, by scipy."""
    return study._problem(study.RIGS[name](), clock)


def _chosen(problem: Problem) -> Problem:
    return with_integration(problem, choose_integration(problem, problem.system))


# The other rigs at 250 ms are in `test_integration_error`.
@pytest.mark.parametrize("name", often(study.RIGS, ["arm", "dead weight"]))
def test_a_log_of_100_ms_is_integrated_to_a_tenth_of_the_noise(name: str) -> None:
    """Against the event-aware integration by scipy; one step a sample leaves several times as much."""
    problem = _problem(name, 0.1)
    one, own = study._error(with_integration(problem, ONE_STEP)), study._error(_chosen(problem))
    assert own[0] < LARGEST
    assert one[0] > 5.0 * LARGEST, "the rig does not show what is controlled here"


@pytest.mark.parametrize("name", often(study.RIGS, ["arm", "dead weight"]))
def test_the_error_that_is_reported_is_that_against_the_reference(name: str) -> None:
    problem = with_integration(_problem(name, 0.1), ONE_STEP)
    reported, exact = integration_error(problem, problem.system), study._error(problem)
    assert reported.share == pytest.approx(exact[0], rel=0.15)
    assert not reported.small
    assert reported.description == "one step a sample"


@pytest.mark.parametrize("lag", ["input_delay", "input_clock"])
def test_an_input_that_is_not_late_is_integrated_as_finely_as_without_that_effect(lag: str) -> None:
    """It switches where a step begins. With the delay or the clock of another run's record the integration was one step a sample, because the reference had no numbers."""
    plain = _problem("dead weight", 0.1)
    late = plain.with_system(extended(plain.system, (lag,)))
    chosen = choose_integration(late, late.system)
    assert described(chosen) == described(choose_integration(plain, plain.system)) != described(ONE_STEP)
    error, own = (integration_error(one, one.system) for one in (with_integration(late, chosen), _chosen(plain)))
    assert error.share == pytest.approx(own.share, rel=0.01)


def test_one_step_a_sample_is_chosen_when_it_is_accurate_enough() -> None:
    problem = _problem("dead weight", 0.005)
    assert described(choose_integration(problem, problem.system)) == "one step a sample"


@pytest.mark.parametrize(
    ("errors", "chosen"),
    [
        # No step length settles a jump: seven times the time for nothing.
        ([6.065, 6.064, 6.0, 5.9, 6.1, 6.2, 5.99], 0),
        ([3.0, 1.1, 0.9, 0.7, 0.6, 0.55, 0.5], 2),
        ([3.0, 0.2, 0.09, 0.08, 0.07, 0.06, 0.06], 2),  # less than a tenth of the noise, if not by half
        ([3.0, 0.2, 0.04, 0.01, 0.01, 0.01, 0.01], 2),
        ([np.inf] * 7, 0),
        ([0.21, 0.20, 0.19, 0.18, 0.15, 0.12, 0.11], 0),
    ],
)
def test_the_cheapest_of_those_that_are_about_as_good_is_chosen(
    errors: list[float], chosen: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    problem, given = _problem("coupon", 0.1), iter(errors)
    monkeypatch.setattr(integration, "_predicted", lambda *_: np.zeros(()))
    monkeypatch.setattr(integration, "_error", lambda *_: SimpleNamespace(share=next(given)))
    found = choose_integration(problem, problem.system)
    assert described(found) == described([ONE_STEP, *(Integration(substeps=2**k) for k in range(1, 7))][chosen])


def test_one_that_is_asked_for_because_the_present_one_leaves_too_much_leaves_no_more(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    given = iter([0.21, 0.20, 0.19, 0.18, 0.15, 0.12, 0.11])
    problem = with_integration(_problem("coupon", 0.1), Integration(substeps=32))
    monkeypatch.setattr(integration, "_predicted", lambda *_: np.zeros(()))
    monkeypatch.setattr(integration, "_error", lambda *_: SimpleNamespace(share=next(given)))
    assert described(choose_integration(problem, problem.system)) == "32 steps a sample"


@pytest.mark.slow  # that the error is below a tenth of the noise is above
def test_less_noise_asks_for_a_finer_integration() -> None:
    problem = _problem("dead weight", 0.05)
    quiet = dataclasses.replace(problem, noise_sigma=problem.noise_sigma / 30.0)
    coarse, fine = (choose_integration(one, one.system) for one in (problem, quiet))
    assert fine.tolerance is not None
    assert coarse.tolerance is not None
    assert float(fine.tolerance) < float(coarse.tolerance)
    assert integration_error(with_integration(quiet, fine), quiet.system).small


@pytest.mark.parametrize("name", [pytest.param("arm", marks=pytest.mark.slow), "dead weight"])
def test_derivatives_of_error_controlled_steps_agree_with_differences(name: str) -> None:
    """Those of differences of the same integration, and of fine equal steps, through every change of branch of the run."""
    problem = with_integration(_problem(name, 0.05), Integration(jnp.asarray(1e-5)))
    fine = _problem(name, 0.001)
    point = problem.start_values()
    names = [one for one in study.FREE if one in problem.names]
    tangents = np.eye(len(point))[[problem.names.index(one) for one in names]]
    _, (slopes,) = predicted_and_derivatives(problem, point[None], tangents[None])
    _, (exact,) = predicted_and_derivatives(fine, point[None], tangents[None])
    scale = np.sqrt((exact[:, 0, ::50] ** 2).mean(axis=1))
    assert (np.sqrt(((slopes[:, 0] - exact[:, 0, ::50]) ** 2).mean(axis=1)) < 0.02 * scale).all()
    for tangent, slope, size in zip(tangents, slopes, scale, strict=True):
        step = 1e-4 * tangent * point
        above, below = predicted_at(problem, [point + step, point - step])
        difference = (above - below)[0] / (2.0 * step.sum())
        assert np.sqrt(((difference - slope[0]) ** 2).mean()) < 0.02 * size


HEATED = ("convection_coefficient", "specific_heat", "recoverable_strain")
FREE = {"coupon": ("austenite_start", "martensite_start", "recoverable_strain")}


@pytest.mark.parametrize(
    ("name", "clock"), often(itertools.product(study.RIGS, study.CLOCKS), [("dead weight", 0.1), ("coupon", 0.1)])
)
def test_a_refit_of_exact_data_leaves_a_tenth_of_the_noise(name: str, clock: float) -> None:
    """Three parameters from 5 % off; data of the scipy integration, without noise, logged every `clock` s."""
    problem = _chosen(_problem(name, clock))
    free = FREE.get(name, HEATED)
    truth = problem.start_values()
    begin = np.array(truth)
    for one in free:
        begin[problem.names.index(one)] *= 1.05
    bounds = {one: (0.5 * truth[k], 2.0 * truth[k]) for one in free for k in [problem.names.index(one)]}
    (fit,) = levenberg_marquardt(problem, [problem.task(free, bounds, begin)], FitSettings())
    assert np.sqrt(fit.cost / problem.measured.size) < LARGEST
    for one in free:
        k = problem.names.index(one)
        assert fit.values[k] == pytest.approx(truth[k], rel=1e-3)


def test_a_run_that_takes_a_thousand_steps_a_sample_ends_early_in_a_fit() -> None:
    """At 1e-12 every sample does, and there is no number any more. The tries left over by some samples are there for others: at 1e-4 nothing changes."""
    problem = _problem("dead weight", 0.1)
    fits = choose_integration(problem, problem.system)
    assert fits.most_tries is not None
    values = problem.start_values()[None]

    def predicted(tolerance: float, most: float) -> np.ndarray:
        limited = Integration(jnp.asarray(tolerance), most_tries=jnp.asarray(most))
        return predicted_at(with_integration(problem, limited), values)[0]

    unlimited = predicted(1e-4, np.inf)
    np.testing.assert_array_equal(predicted(1e-4, float(fits.most_tries)), unlimited)
    np.testing.assert_array_equal(predicted(1e-4, 40.0), unlimited)  # 4.5 a sample on average, 31 in one
    ended = predicted(1e-12, float(fits.most_tries))
    assert np.isnan(ended).any(axis=-1).all()
    assert np.isfinite(ended[:, 0]).all()


def test_the_tries_near_a_model_are_some_times_what_its_runs_need():
    problem = _problem("dead weight", 0.1)
    problem = with_integration(problem, choose_integration(problem, problem.system))
    values = problem.start_values()
    near = limited_near(problem, values)
    given = problem.batch.integration.most_tries
    assert given is not None
    assert near.most_tries is not None
    assert 4.5 * 8.0 < float(near.most_tries) <= 0.5 * float(given)  # it needs 4.5 a sample; a load that swings 100
    limited = predicted_at(with_integration(problem, near), [values])
    np.testing.assert_array_equal(limited, predicted_at(problem, [values]))
    needy = with_integration(problem, dataclasses.replace(problem.batch.integration, most_tries=jnp.asarray(10.0)))
    assert limited_near(needy, values).most_tries == 10.0  # more than an eighth of it: nothing is taken away
