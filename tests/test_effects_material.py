"""The effects of kinetics, constitutive law and sensor: nothing at their base value, and what they say off it."""

from __future__ import annotations

import dataclasses

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from smajax.attribution.search import NUDGE
from smajax.compiled import simulate_compiled
from smajax.effects.library import LIBRARY
from smajax.extended import extended
from smajax.lanes.evaluate import evaluator
from smajax.parameters import parameters, set_parameters
from smajax.presets import build
from smajax.simulate import simulate
from smajax.system import System
from smajax.types import Trajectory
from smajax.wire.laws import under_law

DT = 0.05
MATERIAL = sorted(name for name, effect in LIBRARY.items() if effect.equation in ("kinetics", "constitutive", "sensor"))
DEAD_WEIGHT = build("flexinol_table_3_2", "dead_weight", "voltage")
COUPON = build("flexinol_table_3_2", "coupon", "none")


def _under(system: System, law: str) -> System:
    return dataclasses.replace(system, wire=under_law(system.wire, law))


# Where an effect shows: on the dead weight, but for those that need another law or a stress that changes.
RIGS = {"two_way_memory": _under(DEAD_WEIGHT, "brinson"), "creep": build("niti_table_3_1", "arm", "amplified_voltage")}
LEVELS = 7.4 * np.concatenate([np.full(120, 1.0), np.full(60, 0.6), np.full(60, 0.95), np.full(120, 0.0)])
INPUTS = {"voltage": jnp.asarray(LEVELS)}


def _starts(name: str) -> dict[str, float]:
    return {f"{name}.{coefficient}": size for coefficient, size in LIBRARY[name].starts.items()}


def _gap(one: Trajectory, other: Trajectory, name: str) -> float:
    return float(np.abs(np.asarray(getattr(one, name)) - np.asarray(getattr(other, name))).max())


@pytest.mark.parametrize("name", MATERIAL)
def test_at_its_base_value_an_effect_is_the_base_model_and_off_it_is_not(name):
    rig = RIGS.get(name, DEAD_WEIGHT)
    plain = simulate_compiled(rig, INPUTS, DT)
    assert float(np.ptp(plain.martensite_fraction)) > 0.5
    for tolerance in (None, 1e-4):
        at_base = simulate_compiled(extended(rig, (name,)), INPUTS, DT, tolerance)
        known = plain if tolerance is None else simulate_compiled(rig, INPUTS, DT, tolerance)
        for which, scale in (("temperature", 1e2), ("stress", 1e8), ("martensite_fraction", 1.0), ("reading", 0.02)):
            assert _gap(at_base, known, which) < 1e-11 * scale, which
    on = simulate_compiled(extended(rig, (name,), _starts(name)), INPUTS, DT)
    assert _gap(on, plain, "reading") > 1e-5
    assert 0.0 <= on.martensite_fraction.min() <= on.martensite_fraction.max() <= 1.0


def _random(name: str, seed: int) -> dict[str, float]:
    """Coefficients anywhere within their bounds, and now and then on one."""
    own = [entry for key, entry in parameters(extended(DEAD_WEIGHT, (name,))).items() if key.startswith(f"{name}.")]
    shares = np.clip(np.random.default_rng(seed).uniform(-0.1, 1.1, len(own)), 0.0, 1.0)
    return {entry.name: entry.low + float(share) * (entry.high - entry.low) for entry, share in zip(own, shares)}


@pytest.mark.parametrize("name", MATERIAL)
def test_anywhere_in_its_bounds_the_fraction_is_a_fraction_and_the_strain_is_that_of_the_load(name):
    rig = RIGS.get(name, DEAD_WEIGHT)
    for seed in range(8):
        run = simulate_compiled(extended(rig, (name,), _random(name, seed)), INPUTS, DT)
        for which in ("temperature", "stress", "strain", "reading"):
            assert np.isfinite(getattr(run, which)).all(), (which, seed)
        assert 0.0 <= run.martensite_fraction.min() <= run.martensite_fraction.max() <= 1.0
        taut = np.asarray(run.stress) > 0.0
        moved = np.asarray(run.position) - float(rig.load.start())
        geometric = -float(rig.load.contraction(rig.wire)) * moved
        np.testing.assert_allclose(np.asarray(run.strain)[taut], geometric[taut], rtol=0.0, atol=1e-8)


@pytest.mark.parametrize("name", MATERIAL)
def test_derivatives_are_the_differences(name):
    """Of the mean reading over parts of a run, by every coefficient: at the start, and where the score is taken."""
    rig = RIGS.get(name, DEAD_WEIGHT)
    names = [key for key in parameters(extended(rig, (name,))) if key.startswith(f"{name}.")]
    assert {f"{name}.{key}" for key in LIBRARY[name].starts} <= set(names)

    def mean_along(asked, own):
        model, values = asked

        def mean(share):
            there = {key: values[key] + share * values[f"{key} towards"] for key in names}
            run = simulate(set_parameters(model, there), INPUTS, DT)
            return jnp.stack([run.reading.mean(), run.reading[150:].mean(), run.reading[-100:].mean()])

        return jax.jvp(mean, (own["share"],), (jnp.ones_like(own["share"]),))

    for switched in (NUDGE, 1.0):
        for key in names:
            short = key.removeprefix(f"{name}.")
            values = _starts(name)
            for switch in LIBRARY[name].switches:
                values[f"{name}.{switch}"] *= switched
            size = abs(values[key]) or 1.0
            towards = {f"{one} towards": size * (one == key) for one in names}
            given = (extended(rig, (name,)), {k: jnp.asarray(v) for k, v in {**values, **towards}.items()})
            run = evaluator(mean_along, given, ("share",))
            step = 1e-2 if switched == NUDGE and short in LIBRARY[name].switches else 1e-5
            means, slopes = run(given, {"share": np.array([-step, 0.0, step])}, 1)
            difference = (means[2] - means[0]) / (2.0 * step)
            noise = 1e-13 * np.abs(means).max() / step
            assert np.abs(slopes[1] - difference).max() <= 1e-4 * np.abs(difference).max() + noise, (key, switched)
            if short in LIBRARY[name].switches:
                assert np.abs(slopes[1]).max() > 0.0, f"the score test does not see {key}"
