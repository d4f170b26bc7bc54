"""Models drawn from the posterior of a model file."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from smajax.core.parameters import get_parameters
from smajax.data.model_file.record import LikelyModel
from tests.helpers.model_files import COVARIANCE, FITTED, LATENT, fitted_model


def test_draws_have_the_covariance_and_the_probabilities_of_the_file() -> None:
    model = fitted_model()
    drawn = np.asarray(get_parameters(model.plants(4000, seed=3), list(LATENT))).T
    values = drawn[drawn[:, 2] > 0.0]
    assert len(values) / len(drawn) == pytest.approx(0.9, abs=0.02)
    np.testing.assert_allclose(values.mean(axis=0), list(LATENT.values()), rtol=2e-3)
    scale = np.sqrt(np.outer(np.diag(COVARIANCE), np.diag(COVARIANCE)))
    np.testing.assert_allclose(np.cov(values.T) / scale, COVARIANCE / scale, atol=0.06)
    plants = model.plants(5, seed=1)
    assert plants.wire.heat.convection_coefficient.shape == (5,)
    assert [one.effect_name for one in plants.effects] == ["latent_heat"]


def test_draws_lie_within_the_bounds() -> None:
    model = fitted_model()
    # Correlated, and with half of it beyond a bound: cut off there, and not heaped up on it.
    near = {**LATENT, "convection_coefficient": 31.0}
    covariance = np.array([[4.0, 3.6, 0.0], [3.6, 4.0, 0.0], [0.0, 0.0, 1.0]])
    wide = dataclasses.replace(model.likely[0], values=near, covariance=covariance)
    plants = dataclasses.replace(model, likely=(wide,)).plants(2000, seed=2)
    convection, heat = np.asarray(get_parameters(plants, ["convection_coefficient", "specific_heat"]))
    assert convection.min() > 30.0
    assert np.mean(convection < 30.01) < 0.02
    # Given the one the other is as before: E = mean + 0.9 (x - mean), and its deviation 2 sqrt(1 - 0.81).
    rest = heat - FITTED["specific_heat"] - 0.9 * (convection - 31.0)
    assert abs(rest.mean()) < 0.08
    assert rest.std() == pytest.approx(2.0 * np.sqrt(1.0 - 0.81), rel=0.06)


def test_drawn_transformation_temperatures_are_in_their_order() -> None:
    model = fitted_model()
    values = {"austenite_start": 77.0, "austenite_finish": 78.0}
    likely = LikelyModel(("latent_heat",), 1.0, values, tuple(values), np.diag([4.0, 4.0]))
    start, finish = np.asarray(
        get_parameters(dataclasses.replace(model, likely=(likely,)).plants(500, seed=1), list(values))
    )
    assert (start < finish).all()
    assert finish.std() > 1.0
