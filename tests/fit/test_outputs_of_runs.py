"""Outputs of runs and their derivatives: the same however many directions a run of the program computes."""

from __future__ import annotations

import numpy as np
import pytest

from smajax.fit import outputs_of_runs
from smajax.fit.outputs_of_runs import (
    predicted_and_derivatives,
    predicted_at,
    runs_of_derivatives,
    slopes_at,
)
from tests.helpers.hot_weight import hot_weight


@pytest.mark.parametrize("directions", [1, 3, 5])
def test_derivatives_are_the_same_however_many_a_run_computes(directions: int, monkeypatch: pytest.MonkeyPatch) -> None:
    problem = hot_weight({}).joint.restricted(("latent_heat",))[0]
    rng = np.random.default_rng(4)
    start = np.asarray(problem.start_values())
    points = start * (1.0 + 0.01 * rng.normal(size=(2, len(start))))
    tangents = rng.normal(size=(2, directions, len(start))) * np.abs(start)
    found = []
    for each in (1, 2, 4):
        monkeypatch.setattr(outputs_of_runs, "directions_of", lambda problem, each=each: each)
        found.append(predicted_and_derivatives(problem, points, tangents))
        np.testing.assert_allclose(predicted_at(problem, points), found[0][0], rtol=1e-9)
    assert found[0][1].shape == (2, directions, *problem.measured.shape)
    for values, slopes in found[1:]:
        np.testing.assert_allclose(values, found[0][0], rtol=1e-9)
        np.testing.assert_allclose(slopes, found[0][1], rtol=1e-9, atol=1e-12 * np.abs(slopes).max())


def test_slopes_at_one_point_and_at_others_are_those_of_their_own_points() -> None:
    problem = hot_weight({}).joint.restricted(("latent_heat",))[0]
    start = np.asarray(problem.start_values())
    other = 1.02 * start
    points = [start, start, start, other, start, other, other]
    some = ("convection_coefficient", "specific_heat", "latent_heat.enthalpy")
    names = [some[k] for k in (0, 1, 2, 1, 0, 0, 2)]
    found = slopes_at(problem, points, names)
    for slope, point, name in zip(found, points, names, strict=True):
        (alone,) = slopes_at(problem, [point], [name])
        np.testing.assert_allclose(slope, alone, rtol=1e-9, atol=1e-12 * np.abs(alone).max())
    assert slopes_at(problem, [], []).shape == (0, *problem.measured.shape)


def test_a_slope_is_the_difference_of_outputs() -> None:
    problem = hot_weight({}).joint.restricted(())[0]
    start = np.asarray(problem.start_values())
    name = "convection_coefficient"
    place, step = problem.names.index(name), 1e-4 * float(start[problem.names.index(name)])
    either = np.stack([start, start])
    either[:, place] += [step, -step]
    ahead, behind = predicted_at(problem, either)
    (slope,) = slopes_at(problem, [start], [name])
    np.testing.assert_allclose(
        slope, problem.centred((ahead - behind) / (2.0 * step)), rtol=1e-3, atol=1e-4 * np.abs(slope).max()
    )


def test_runs_of_derivatives_are_those_of_the_program(monkeypatch: pytest.MonkeyPatch) -> None:
    problem = hot_weight({}).joint.restricted(())[0]
    samples = problem.batch.output.shape[-1]
    for least, each in ((samples, outputs_of_runs.ALONG_MANY), (samples + 1, outputs_of_runs.ALONG_FEW)):
        monkeypatch.setattr(outputs_of_runs, "MANY_SAMPLES", least)
        assert runs_of_derivatives(problem, 3, each) == 3
        assert runs_of_derivatives(problem, 3, each + 1) == 6
