"""Directions that a run does not depend on, and runs that a fit leaves out, take no run of the program."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from smajax.fit import normal_equations as normal_equations_module
from smajax.fit.needed_directions import NeededDirections
from smajax.fit.outputs_of_runs import predicted_and_derivatives
from tests.helpers.hot_weight import hot_weight


@pytest.mark.parametrize("each", [1, 2, 4])
def test_what_is_needed_comes_back_to_its_place_and_the_rest_is_zero(each: int) -> None:
    rng = np.random.default_rng(each)
    points, slopes = rng.normal(size=(5, 3)), rng.normal(size=(3, 7))
    tangents = rng.normal(size=(5, 6, 3)) * (rng.random((5, 6, 1)) < 0.6)
    tangents[3] = 0.0  # outputs alone
    asked = np.array([True, True, False, True, False])
    own = NeededDirections.of(points, tangents, asked, each)
    needed = np.where(asked, tangents.any(axis=2).sum(axis=1), 0)
    assert len(own.points) == sum(max(1, -(-int(count) // each)) for count in needed)
    assert own.tangents.shape == (len(own.points), each, 3)
    predicted, derivatives = own.predicted(own.points @ slopes), own.derivatives(own.tangents @ slopes)
    np.testing.assert_allclose(predicted, points @ slopes)
    np.testing.assert_allclose(derivatives, np.where(asked[:, None, None], tangents @ slopes, 0.0))


def test_derivatives_that_are_asked_for_are_as_if_all_were_and_outputs_are_of_all_runs() -> None:
    problem = hot_weight({}).joint.restricted(())[0]
    runs, outputs = problem.batch.runs, len(problem.batch.outputs)
    start = np.asarray(problem.start_values())
    points = np.stack([start, 1.01 * start])
    tangents = np.random.default_rng(4).normal(size=(2, 3, len(start))) * np.abs(start)
    asked = np.stack([np.arange(runs) > 0, np.zeros(runs, bool)])
    some = np.repeat(asked, outputs, axis=1)[:, None, :, None]
    values, slopes = predicted_and_derivatives(problem, points, tangents)
    found, along = predicted_and_derivatives(problem, points, tangents, asked)
    np.testing.assert_allclose(found, values, rtol=1e-9)
    np.testing.assert_allclose(along, np.where(some, slopes, 0.0), rtol=1e-9, atol=1e-12 * np.abs(slopes).max())


def test_a_fit_goes_nowhere_where_a_run_that_it_leaves_out_has_no_numbers(monkeypatch: pytest.MonkeyPatch) -> None:
    problem = hot_weight({}).joint.restricted(())[0]
    task = problem.task(
        ["convection_coefficient"],
        {"convection_coefficient": (10.0, 500.0)},
        np.asarray(problem.start_values()),
        (np.arange(problem.batch.runs) > 0).astype(float),
    )

    def none_in_the_first(*given: Any) -> tuple[np.ndarray, np.ndarray]:
        values, slopes = predicted_and_derivatives(*given)
        values[:, 0] = np.nan
        return values, slopes

    monkeypatch.setattr(normal_equations_module, "predicted_and_derivatives", none_in_the_first)
    (((cost, *_), _),) = normal_equations_module.normal_equations(problem, [task], [np.array([0.3])], None)
    assert np.isnan(cost)
