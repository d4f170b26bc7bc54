"""A staircase, and derivatives by which a fit can move."""

from __future__ import annotations

from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from smajax.fit.packed_runs import commonest
from smajax.model.effects.candidate import Extent
from smajax.model.effects.sensor_resolution import WITHIN, SensorResolution

INCREMENT, ZERO = 2e-3, 3e-4
ONE_CELL = ZERO + INCREMENT * (np.arange(-100, 100) + 0.5) / 200


def _shown(x: Any, zero: float = ZERO, share: float = 1.0) -> Any:
    return SensorResolution(share=share, increment=INCREMENT, zero=zero).sensed(x, jnp.zeros(()), x)


def test_it_shows_levels_alone() -> None:
    x = np.linspace(-0.01, 0.01, 5001)
    shown = np.asarray(_shown(x))
    np.testing.assert_allclose(shown, ZERO + INCREMENT * np.floor((x - ZERO) / INCREMENT + 0.5), rtol=0.0, atol=1e-16)
    np.testing.assert_allclose(_shown(x, share=0.25), x + 0.25 * (shown - x), rtol=0.0, atol=1e-16)


def test_its_derivatives_are_those_of_the_mean() -> None:
    """A motion by one increment goes up one level; a zero that moves by one increment gives the same levels again."""
    by_x = jax.vmap(jax.grad(_shown))(ONE_CELL)
    by_zero = jax.vmap(jax.grad(_shown, argnums=1), in_axes=(0, None))(ONE_CELL, ZERO)
    np.testing.assert_allclose(by_x, 1.0, atol=1e-12)
    np.testing.assert_allclose(by_zero, 0.0, atol=1e-12)


def _near(x: Any, measured: Any, level: float = ZERO, **changed: Any) -> Any:
    """Of a run, or of one sample in a run that otherwise rests in the middle of a level."""
    sensor = SensorResolution(**({"share": 1.0, "increment": INCREMENT, "zero": ZERO} | changed))
    if np.ndim(measured):
        return sensor.near(x, measured, jnp.asarray(level))
    rest = jnp.full(20, ZERO)
    return sensor.near(jnp.append(rest, x), jnp.append(rest, measured), jnp.asarray(level))[-1]


def test_of_a_measured_level_it_is_known_between_which_edges_the_motion_was() -> None:
    """Within the level that was read the model is right; outside it is off by how far it is outside."""
    measured = ZERO + 3 * INCREMENT + 2e-5  # with its noise
    low, high = ZERO + 2.5 * INCREMENT, ZERO + 3.5 * INCREMENT
    for x in np.linspace(low, high, 9)[1:-1]:
        assert float(_near(x, measured)) == pytest.approx(ZERO + 3 * INCREMENT, abs=1e-15)
    for outside in (1e-6, 4e-4, 7e-3):
        assert float(_near(high + outside, measured)) == pytest.approx(ZERO + 3 * INCREMENT + outside, abs=1e-15)
        assert float(_near(low - outside, measured)) == pytest.approx(ZERO + 3 * INCREMENT - outside, abs=1e-15)
    assert float(_near(high + 4e-4, measured, share=0.0)) == high + 4e-4
    assert float(_near(high + 4e-4, np.nan)) == float(_shown(high + 4e-4))


@pytest.mark.parametrize("own", [0.45, 0.55, 3.2, -8.6])
def test_a_run_may_have_a_zero_of_its_own_of_any_size(own: float) -> None:
    """In increments. By its distance from the model's levels every fifth sample was a level off from 0.45 on, and from 0.5 on all were outside."""
    random = np.random.default_rng(3)
    x = np.linspace(-0.01, 0.01, 400)
    measured = np.asarray(_shown(x)) + own * INCREMENT + 0.05 * INCREMENT * random.standard_normal(x.size)
    measured[::37] = np.nan
    near = np.asarray(_near(x, measured, commonest(measured)))
    np.testing.assert_allclose(near, _shown(x), atol=1e-12)
    # Nor does a model that is a little off take the next levels for its own.
    off = np.asarray(_near(x + 0.1 * INCREMENT, measured, commonest(measured)))
    assert np.abs(off - near)[np.isfinite(measured)].max() < 0.11 * INCREMENT


def test_the_increment_is_that_of_the_log() -> None:
    """How far a motion lies outside of levels as wide as one likes is nothing: a free increment took up whatever else was missing."""
    bounds = SensorResolution.candidate.bounds(Extent(20.0, 0.02, 1e-3, noise=1e-4))
    assert list(bounds) == ["increment"]
    assert bounds["increment"] == pytest.approx((1e-3 / 1.0125, 1.0125e-3))  # 20 levels over the stroke
    assert SensorResolution.candidate.bounds(Extent(20.0, 0.02, 0.0, noise=1e-4)) == {}


def test_the_reading_about_which_most_lie_is_found_among_levels_and_noise() -> None:
    random = np.random.default_rng(5)
    readings = np.concatenate(
        [random.normal(1.0, 0.02, 300), random.normal(2.0, 0.02, 90), random.normal(3.0, 0.02, 200)]
    )
    readings[::50] = np.nan
    assert commonest(readings) == pytest.approx(1.0, abs=0.03)
    assert commonest(np.full(3, np.nan)) == 0.0
    assert commonest(np.asarray([4.0])) == 4.0


def test_a_fit_is_pulled_by_samples_outside_of_their_level_and_evidence_counts_what_they_tell() -> None:
    """A reading of a level has the level's variance beside that of its noise: q^2/12."""
    measured = ZERO + 3 * INCREMENT
    noise = INCREMENT / 10.0

    def near(x: Any, sensor: SensorResolution) -> Any:
        rest = jnp.full(20, measured)
        return sensor.near(jnp.append(rest, x), jnp.append(rest, measured), jnp.asarray(measured))[-1]

    def slope(x: float, sensor: SensorResolution) -> float:
        return float(jax.grad(near)(x, sensor))

    sensor = SensorResolution(share=1.0, increment=INCREMENT, zero=ZERO)
    assert slope(measured + 0.4 * INCREMENT, sensor) == pytest.approx(WITHIN)
    assert slope(measured + 0.6 * INCREMENT, sensor) == pytest.approx(1.0)
    told = sensor.with_mean_slope(noise)
    assert slope(measured + 0.4 * INCREMENT, told) == pytest.approx((1.0 + 100.0 / 12.0) ** -0.5)
    assert float(jax.grad(lambda x: told.sensed(x, jnp.zeros(()), x))(0.3 * INCREMENT)) == pytest.approx(
        (1.0 + 100.0 / 12.0) ** -0.5
    )
    for x in (measured + 0.4 * INCREMENT, measured + 0.6 * INCREMENT):
        assert float(near(x, sensor)) == float(near(x, told))


def test_a_stair_within_the_noise_is_not_looked_for() -> None:
    observable = SensorResolution.candidate.observable
    assert observable(Extent(20.0, 0.02, 1e-3, noise=2e-4))
    assert not observable(Extent(20.0, 0.02, 1e-3, noise=5e-4))
    assert not observable(Extent(20.0, 0.02, 0.0, noise=0.0))


@pytest.mark.parametrize("start", [0.8, 0.93, 1.06, 1.3])
def test_a_fit_finds_the_motion_behind_the_levels(start: float) -> None:
    """The scale of a motion of ten levels, by Gauss and Newton: from 30 % off, where half of the samples are on another level."""
    motion = 0.02 * np.sin(np.linspace(0.0, 3.0, 2000))
    measured = np.asarray(_shown(jnp.asarray(1.01 * motion)))
    scale = start
    for _ in range(30):
        shown, slope = jax.jvp(lambda one: _near(one * motion, measured), (scale,), (1.0,))
        scale += float(slope @ (measured - shown) / (slope @ slope))
    assert scale == pytest.approx(1.01, abs=2e-3)
