"""A coupon whose range moves with what transforms: where a step ends does not depend on its length."""

from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.optimize import brentq

from smajax.core.parameters import set_parameters
from smajax.model.extended import extended
from smajax.model.presets import build
from smajax.simulation.compiled import simulate_compiled
from smajax.simulation.simulate import simulate
from smajax.simulation.steppers import Integration

COUPON = build("flexinol_table_3_2", "coupon", "none")
STRESS, DT = 100e6, 0.5
TEMPERATURE = np.concatenate([np.linspace(20.0, 110.0, 91), np.linspace(110.0, 20.0, 91)[1:]])
INPUTS = {"temperature": jnp.asarray(TEMPERATURE), "stress": jnp.full(TEMPERATURE.size, STRESS)}
DRIFT = {"first_heating": -8.0, "first_cooling": 12.0, "cycles": 1.5}
HALFWAY = 66  # samples to the middle of heating
LAW = COUPON.wire.kinetics


def _drifting(**changed: float):
    return extended(
        COUPON, ("drifting_temperatures",), {f"drifting_temperatures.{k}": v for k, v in (DRIFT | changed).items()}
    )


def _fractions() -> np.ndarray:
    """One cycle by the equations as they are printed: each fraction the root of its own, by scipy."""

    def shift(rate: float, done: float) -> float:
        return rate * DRIFT["cycles"] * (1.0 - np.exp(-0.5 * done / DRIFT["cycles"]))

    def cosine(z: float) -> float:
        return 0.5 * (1.0 + np.cos(np.pi * min(max(z, 0.0), 1.0)))

    above = STRESS / float(LAW.stress_slope_austenite), STRESS / float(LAW.stress_slope_martensite)
    heats = float(LAW.austenite_start), float(LAW.austenite_finish)
    cools = float(LAW.martensite_finish), float(LAW.martensite_start)

    def miss(xi: float, temperature: float, heating: bool) -> float:
        if heating:
            at = temperature - above[0] - shift(DRIFT["first_heating"], 1.0 - xi)
            return xi - cosine((at - heats[0]) / (heats[1] - heats[0]))
        at = temperature - above[1] - shift(DRIFT["first_cooling"], 1.0 + xi)
        return xi - cosine((at - cools[0]) / (cools[1] - cools[0]))

    found = []
    for number, temperature in enumerate(TEMPERATURE):
        given = float(temperature), number <= 90
        ends = [xi for xi in (0.0, 1.0) if miss(xi, *given) == 0.0]
        found.append(ends[0] if ends else brentq(miss, 0.0, 1.0, args=given, xtol=1e-14))
    return np.asarray(found)


@pytest.mark.parametrize("substeps", [1, 16])
def test_a_cycle_of_a_drifting_wire_is_what_its_equations_say_at_any_step(substeps: int) -> None:
    run = simulate(_drifting(), INPUTS, DT, integration=Integration(substeps=substeps))
    np.testing.assert_allclose(run.martensite_fraction, _fractions(), atol=1e-9)


def test_a_pause_moves_nothing() -> None:
    """The range moves with what transforms, so a wire that is held stays; it crept on when the range was that of the step before."""
    held = {name: jnp.repeat(series[:HALFWAY], 4) for name, series in INPUTS.items()}
    run = simulate_compiled(_drifting(), held, DT)
    by_step = np.asarray(run.martensite_fraction).reshape(-1, 4)
    assert 0.0 < by_step[-1, 0] < 1.0
    np.testing.assert_allclose(by_step, by_step[:, :1] * np.ones(4), atol=1e-12)


def test_derivatives_agree_with_differences() -> None:
    def strains(value: jax.Array, name: str) -> jax.Array:
        return simulate(set_parameters(_drifting(), {f"drifting_temperatures.{name}": value}), INPUTS, DT).strain

    for name, at in DRIFT.items():
        along = jax.jvp(lambda value, name=name: strains(value, name), (jnp.asarray(at),), (jnp.asarray(1.0),))[1]
        step = 1e-4
        differences = (strains(jnp.asarray(at + step), name) - strains(jnp.asarray(at - step), name)) / (2.0 * step)
        np.testing.assert_allclose(along, differences, atol=1e-6 * float(jnp.abs(differences).max()) + 1e-12)


def test_a_range_that_runs_ahead_of_the_transformation_stays_within_it() -> None:
    """At its bounds the drift is faster than the transformation: it snaps, and nothing leaves its range."""
    for heating, cooling in ((-20.0, 20.0), (20.0, -20.0)):
        run = simulate_compiled(_drifting(first_heating=heating, first_cooling=cooling, cycles=0.5), INPUTS, DT)
        xi = np.asarray(run.martensite_fraction)
        assert np.isfinite(run.strain).all()
        assert xi.min() >= 0.0
        assert xi.max() <= 1.0
        assert xi[90] < 1e-9
