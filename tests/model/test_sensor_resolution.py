"""A staircase, and derivatives by which a fit can move."""

from __future__ import annotations

from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from smajax.attribution.laplace_evidence import square_of_slope
from smajax.model.effects.candidate import Extent
from smajax.model.effects.sensor_resolution import SensorResolution

INCREMENT, ZERO = 2e-3, 3e-4
ONE_CELL = ZERO + INCREMENT * (np.arange(-100, 100) + 0.5) / 200


def _shown(x: Any, zero: float = ZERO, share: float = 1.0) -> Any:
    return SensorResolution(share=share, increment=INCREMENT, zero=zero).sensed(x, jnp.zeros(()), x)


def test_it_shows_levels_alone() -> None:
    x = np.linspace(-0.01, 0.01, 5001)
    shown = np.asarray(_shown(x))
    np.testing.assert_allclose(shown, ZERO + INCREMENT * np.floor((x - ZERO) / INCREMENT + 0.5), rtol=0.0, atol=1e-16)
    np.testing.assert_allclose(_shown(x, share=0.25), x + 0.25 * (shown - x), rtol=0.0, atol=1e-16)


def test_over_a_level_its_derivatives_are_those_of_the_mean() -> None:
    """A motion by one increment goes up one level; a zero that moves by one increment gives the same levels again."""
    by_x = np.asarray(jax.vmap(jax.grad(_shown))(ONE_CELL))
    by_zero = np.asarray(jax.vmap(jax.grad(_shown, argnums=1), in_axes=(0, None))(ONE_CELL, ZERO))
    assert by_x.mean() == pytest.approx(1.0, abs=1e-9)
    assert by_zero.mean() == pytest.approx(0.0, abs=1e-9)
    # In the middle of a level the reading moves with the zero, at its edge with the motion.
    assert by_zero[99:101].min() > 0.99
    assert by_x[99:101].max() < 0.01
    # Beyond a quarter of the level from an edge nothing is told: a motion within it leaves the reading as it is.
    assert by_x[0] > 5.0
    assert by_x[50:150].max() < 0.03


def test_the_mean_square_of_the_slope_is_what_evidence_and_standard_errors_are_divided_by() -> None:
    by_x = np.asarray(jax.vmap(jax.grad(_shown))(ONE_CELL))
    assert np.mean(by_x**2) == pytest.approx(SensorResolution.candidate.square_of_slope, rel=1e-6)
    assert square_of_slope(("latent_heat", "sensor_resolution")) == SensorResolution.candidate.square_of_slope
    assert square_of_slope(("latent_heat", "a term of its own")) == 1.0


def test_a_stair_within_the_noise_is_not_looked_for() -> None:
    observable = SensorResolution.candidate.observable
    assert observable(Extent(20.0, 0.02, 1e-3, noise=2e-4))
    assert not observable(Extent(20.0, 0.02, 1e-3, noise=5e-4))
    assert not observable(Extent(20.0, 0.02, 0.0, noise=0.0))


@pytest.mark.parametrize("start", [0.93, 1.06])
def test_a_fit_finds_the_motion_behind_the_levels(start: float) -> None:
    """The scale of a motion of ten levels: with the stair's own derivatives, zero, it stays where it begins."""
    motion = 0.02 * np.sin(np.linspace(0.0, 3.0, 2000))
    measured = _shown(jnp.asarray(1.01 * motion))
    scale = start
    for _ in range(20):
        shown, slope = jax.jvp(lambda one: _shown(one * motion), (scale,), (1.0,))
        scale += float(slope @ (measured - shown) / (slope @ slope))
    assert scale == pytest.approx(1.01, abs=2e-3)
