"""The curve of the transformation: monotone and smooth for any coefficients, the law's own at zero, and wide enough for the shapes that it replaces."""

from __future__ import annotations

import itertools

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import least_squares

from smajax.model.effects.asymmetric_transformation import AsymmetricTransformation
from smajax.model.effects.smooth_transformation import SmoothTransformation
from smajax.model.effects.transformation_curve import TransformationCurve, branch_shape
from smajax.model.effects.two_part_transformation import TwoPartTransformation
from smajax.model.effects.two_step_transformation import TwoStepTransformation
from smajax.model.wire.monotone_curve import KNOTS, monotone_curve
from smajax.model.wire.shape import Cosine

COEFFICIENT = st.floats(-3.0, 3.0)
SIX = st.lists(COEFFICIENT, min_size=6, max_size=6)


def _curve(s: jax.Array) -> TransformationCurve:
    names = [name for name in TransformationCurve.candidate.switches if name.startswith("heating")]
    return TransformationCurve(**dict(zip(names, s, strict=True)))


def _knots(s: list[float]) -> np.ndarray:
    """Where the curve has what the cosine has at `KNOTS`."""
    before, after = np.cumsum(s[:3]), np.cumsum(s[3:])
    wide = np.diff(KNOTS) * np.exp([*before[::-1], 0.0, *after])
    wide *= (KNOTS[5] - KNOTS[2]) / wide[2:5].sum()
    return KNOTS[2] - wide[:2].sum() + np.concatenate([[0.0], np.cumsum(wide)])


@jax.jit
def _places(s: jax.Array, z: jax.Array) -> tuple[jax.Array, jax.Array]:
    """(the map and its slope) at every z."""
    place = monotone_curve(tuple(s[:3]), tuple(s[3:]))
    return jax.vmap(place)(z), jax.vmap(jax.grad(place))(z)


def test_without_stretch_the_law_is_read_where_it_was_to_the_bit() -> None:
    z = jnp.linspace(-40.0, 40.0, 1001)
    place, slope = _places(jnp.zeros(6), z)
    assert np.array_equal(place, z)
    assert np.array_equal(slope, np.ones(1001))


@settings(deadline=None)
@given(s=SIX)
def test_the_map_rises_everywhere(s: list[float]) -> None:
    reach = float(np.exp(np.abs(s).sum() / 2.0))
    z = jnp.asarray(0.5 + np.sinh(np.linspace(-1.0, 1.0, 801) * np.arcsinh(20.0 * reach)) / 20.0)
    place, slope = _places(jnp.asarray(s), z)
    assert np.all(np.diff(place) > 0.0)
    assert np.all(np.isfinite(slope))
    assert np.all(np.asarray(slope) > 0.0)


@settings(deadline=None)
@given(s=SIX)
def test_the_map_and_its_slope_have_no_jump_at_the_knots(s: list[float]) -> None:
    knots = _knots(s)
    beside = 1e-9 * np.diff(knots).min()
    low, low_slope = _places(jnp.asarray(s), jnp.asarray(knots - beside))
    high, high_slope = _places(jnp.asarray(s), jnp.asarray(knots + beside))
    np.testing.assert_allclose(low, KNOTS, atol=1e-7)
    np.testing.assert_allclose(high, KNOTS, atol=1e-7)
    np.testing.assert_allclose(low_slope, high_slope, rtol=1e-5)


@settings(deadline=None)
@given(s=SIX)
def test_rounding_at_a_knot_makes_no_jump(s: list[float]) -> None:
    """Compiled, within some units of the last place of every knot: a choice of one part once was another for each of its numbers."""
    knots = _knots(s)
    at = np.concatenate([knots * (1.0 + k * 2.3e-16) for k in range(-8, 9)])
    place, _ = _places(jnp.asarray(s), jnp.asarray(at))
    steepest = np.exp(np.abs(s).sum())
    np.testing.assert_allclose(
        np.asarray(place).reshape(17, -1), np.tile(KNOTS, (17, 1)), atol=1e-13 * steepest * (1.0 + np.abs(knots).max())
    )


SHAPES = {
    "smooth": (SmoothTransformation(weight=jnp.asarray(1.0)), 0.1),
    "asymmetric": (AsymmetricTransformation(heating=jnp.asarray(0.8)), 0.1),
    "tails": (TwoPartTransformation(heating_weight=jnp.asarray(0.3), width=jnp.asarray(0.8)), 0.25),
    "second step": (
        TwoStepTransformation(heating_weight=jnp.asarray(0.25), heating_shift=jnp.asarray(1.0), width=jnp.asarray(1.0)),
        0.3,
    ),
}


@pytest.mark.parametrize("name", SHAPES)
def test_it_has_the_shapes_that_it_replaces(name: str) -> None:
    """Fitted with the range's place and width, it leaves at most the stated share of what the best cosine leaves."""
    shape, share = SHAPES[name]
    z = jnp.linspace(-2.0, 3.0, 401)
    cosine = Cosine().martensite_left
    wanted = np.asarray(jax.vmap(lambda at: shape.heating_shape(at, cosine(at)))(z))

    @jax.jit
    def left(x: jax.Array) -> jax.Array:
        moved = lambda at: _curve(x[2:]).heating_place(0.5 + (at - x[0]) * jnp.exp(x[1]))  # noqa: E731
        return jax.vmap(lambda at: cosine(moved(at)))(z) - wanted

    slope = jax.jit(jax.jacfwd(left))
    plain = least_squares(
        lambda x: np.asarray(left(jnp.asarray([*x, *np.zeros(6)]))),
        [0.5, 0.0],
        jac=lambda x: np.asarray(slope(jnp.asarray([*x, *np.zeros(6)])))[:, :2],
    )
    weak = lambda x: np.concatenate([np.asarray(left(jnp.asarray(x))), 1e-3 * x[2:]])  # noqa: E731  # s is not free without end
    rows = np.hstack([np.zeros((6, 2)), 1e-3 * np.eye(6)])
    tried = [
        least_squares(weak, [*plain.x, *start], jac=lambda x: np.vstack([slope(jnp.asarray(x)), rows]))
        for start in (
            np.zeros(6),
            [0.0, 0.5, 1.0, 0.0, 0.5, 1.0],
            [0.0, 0.0, 0.0, 1.0, 1.0, -1.0],
            [0.0, 0.0, 0.0, 0.0, 2.0, -2.0],
        )
    ]
    best = min(float(np.linalg.norm(np.asarray(left(jnp.asarray(one.x))))) for one in tried)
    assert best < share * float(np.linalg.norm(plain.fun)), (best, np.linalg.norm(plain.fun))


def test_the_shape_of_a_branch_in_numbers() -> None:
    like = branch_shape({}, "heating")
    np.testing.assert_allclose(like[:3], 1.0, atol=1e-4)
    assert like.first_step is None
    tail = branch_shape({"cooling_finish_outer": 3.0}, "cooling")
    assert tail.last_tenth > 2.5
    assert tail.first_tenth == pytest.approx(1.0, abs=0.2)
    assert branch_shape({"cooling_finish_outer": 3.0}, "heating") == like
    steps = branch_shape({"heating_finish_inner": 2.0, "heating_finish_middle": -2.0}, "heating")
    assert steps.first_step == pytest.approx(0.75)
    late = branch_shape({"heating_start_inner": 0.8}, "heating")
    assert late.halves > 1.25
    for values in itertools.product((-3.0, 0.0, 3.0), repeat=3):  # anywhere in the bounds: numbers
        names = ("heating_start_outer", "heating_finish_inner", "heating_finish_outer")
        shape = branch_shape(dict(zip(names, values, strict=True)), "heating")
        assert np.all(np.isfinite(shape[:3]))
        assert min(shape[:3]) > 0.0


def _places_of_branch(s: jax.Array, z: jax.Array, cooling: jax.Array, once: bool) -> jax.Array:
    """By the curve of one branch, and by `place_on`; `once`: by the effect as it is prepared for a run."""
    names = TransformationCurve.candidate.switches
    effect = TransformationCurve(**dict(zip(names, [*s, *(-0.5 * s)], strict=True)))
    effect = effect.prepared() if once else effect
    both = jnp.where(cooling, 1.0 - effect.cooling_place(1.0 - z), effect.heating_place(z))
    return jnp.stack([both, effect.place_on(cooling, z)])


# Compiled once, not for every example.
PLACES = jax.jit(_places_of_branch, static_argnums=3)
SLOPES = [jax.jit(jax.jacobian(_places_of_branch, argument), static_argnums=3) for argument in (0, 1)]


@settings(deadline=None, max_examples=25)
@given(s=SIX, z=st.floats(-1.0, 2.0), cooling=st.booleans())
def test_prepared_the_effect_has_the_same_places_and_derivatives_on_either_branch(
    s: list[float], z: float, cooling: bool
) -> None:
    """`prepared` computes once a run what is of the coefficients alone, and `place_on` looks one of the two curves up."""
    given = jnp.asarray(s), jnp.asarray(z), jnp.asarray(cooling)
    apart, once = (PLACES(*given, one) for one in (False, True))
    np.testing.assert_allclose(once, np.full(2, apart[0]), rtol=1e-12, atol=1e-12)
    for slope in SLOPES:
        slopes = [slope(*given, one) for one in (False, True)]
        np.testing.assert_allclose(slopes[1], slopes[0], rtol=1e-9, atol=1e-12)


def test_derivatives_of_the_map_agree_with_differences() -> None:
    """By its coefficients and by z, and the mixed second ones, away from the knots."""
    place = lambda s, z: monotone_curve(tuple(s[:3]), tuple(s[3:]))(z)  # noqa: E731
    slope, mixed = jax.jit(jax.grad(place, (0, 1))), jax.jit(jax.jacobian(jax.grad(place, 1), 0))
    drawn = np.random.default_rng(7)
    for s, z in zip(0.7 * drawn.standard_normal((20, 6)), drawn.uniform(-0.5, 1.5, 20), strict=True):
        if np.abs(_knots(list(s)) - z).min() < 1e-4:
            continue
        by_s, by_z = slope(jnp.asarray(s), z)
        step = 1e-6 * np.eye(6)
        differences = [(place(s + one, z) - place(s - one, z)) / 2e-6 for one in step]
        np.testing.assert_allclose(by_s, differences, rtol=1e-6, atol=1e-8)
        np.testing.assert_allclose(by_z, (place(s, z + 1e-6) - place(s, z - 1e-6)) / 2e-6, rtol=1e-6, atol=1e-8)
        second = [(slope(s + one, z)[1] - slope(s - one, z)[1]) / 2e-6 for one in step]
        np.testing.assert_allclose(mixed(jnp.asarray(s), z), second, rtol=1e-5, atol=1e-7)
