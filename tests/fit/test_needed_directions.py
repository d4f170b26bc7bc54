"""Directions that a run does not depend on, and runs that a fit leaves out, take no run of the program."""

from __future__ import annotations

import numpy as np
import pytest

from smajax.fit.needed_directions import NeededDirections
from smajax.fit.outputs_of_runs import predicted_and_derivatives, predicted_at
from tests.helpers.hot_weight import hot_weight


@pytest.mark.parametrize("each", [1, 2, 4])
def test_what_is_needed_comes_back_to_its_place_and_the_rest_is_zero(each: int) -> None:
    rng = np.random.default_rng(each)
    points, slopes = rng.normal(size=(5, 3)), rng.normal(size=(3, 7))
    tangents = rng.normal(size=(5, 6, 3)) * (rng.random((5, 6, 1)) < 0.6)
    tangents[3] = 0.0  # outputs alone
    asked = np.array([True, True, False, True, False])
    own = NeededDirections.of(points, tangents, asked, each)
    needed = tangents.any(axis=2).sum(axis=1)
    assert len(own.points) == sum(max(1, -(-int(count) // each)) for count in needed[asked])
    assert own.tangents.shape == (len(own.points), each, 3)
    predicted, derivatives = own.predicted(own.points @ slopes), own.derivatives(own.tangents @ slopes)
    np.testing.assert_allclose(predicted, np.where(asked[:, None], points @ slopes, 0.0))
    np.testing.assert_allclose(derivatives, np.where(asked[:, None, None], tangents @ slopes, 0.0))


def test_nothing_is_run_where_nobody_asks() -> None:
    own = NeededDirections.of(np.ones((2, 3)), np.ones((2, 4, 3)), np.zeros(2, bool), 4)
    assert own.points.shape == (0, 3)
    assert own.predicted(np.zeros((0, 7))).shape == (2, 7)
    np.testing.assert_array_equal(own.derivatives(np.zeros((0, 4, 7))), np.zeros((2, 4, 7)))


def test_runs_that_are_asked_for_are_as_if_all_were() -> None:
    problem = hot_weight({}).joint.restricted(())[0]
    runs, outputs = problem.batch.runs, len(problem.batch.outputs)
    start = np.asarray(problem.start_values())
    points = np.stack([start, 1.01 * start])
    tangents = np.random.default_rng(4).normal(size=(2, 3, len(start))) * np.abs(start)
    asked = np.stack([np.arange(runs) > 0, np.zeros(runs, bool)])
    some = np.repeat(asked, outputs, axis=1)[..., None]
    values, slopes = predicted_and_derivatives(problem, points, tangents)
    found, along = predicted_and_derivatives(problem, points, tangents, asked)
    np.testing.assert_allclose(found, np.where(some, values, 0.0), rtol=1e-9)
    np.testing.assert_allclose(
        along, np.where(some[:, None], slopes, 0.0), rtol=1e-9, atol=1e-12 * np.abs(slopes).max()
    )
    np.testing.assert_allclose(predicted_at(problem, points, asked=asked), found, rtol=1e-9)
