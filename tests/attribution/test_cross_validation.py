"""Judging on runs left out: what only the run left out could have told is credited with nothing."""

from __future__ import annotations

import dataclasses

import jax.numpy as jnp
import numpy as np
import pytest

from smajax.attribution.cross_validation import Fitted, Model, Search
from smajax.core.result_cache import ResultCache
from smajax.fit.levenberg_marquardt import Fit
from smajax.fit.packed_runs import RunBatch, simulate_batch
from smajax.fit.predicted import misfits
from smajax.fit.problem import Problem
from smajax.model.extended import extended
from smajax.model.presets import build

DT, SAMPLES, NOISE = 0.1, 200, 1e-4
CHANCE = 2.0  # standard errors
BOUNDS = {"convection_coefficient": (50.0, 400.0), "latent_heat.enthalpy": (0.0, 6e4)}


def _setting() -> Search:
    """A run that transforms and one that stays at rest, by a wire with latent heat."""
    heated = jnp.concatenate([jnp.full(100, 9.0), jnp.zeros(100)])
    inputs = {"voltage": jnp.stack([heated, jnp.zeros(SAMPLES)])}
    base = build("flexinol_table_3_2", "dead_weight", "voltage")
    blank = RunBatch(inputs, jnp.zeros((2, SAMPLES)), jnp.ones((2, SAMPLES)), jnp.zeros((2, 0)), (), DT)
    truth = simulate_batch(extended(base, ("latent_heat",), {"latent_heat.enthalpy": 2e4}), blank).reading
    noise = NOISE * np.random.default_rng(7).normal(size=truth.shape)
    batch = RunBatch(inputs, truth + noise, blank.mask, blank.overrides, (), DT)
    problem = Problem.build(extended(base, ("latent_heat",), {}), batch, NOISE, False)
    return Search(problem, ("convection_coefficient",), BOUNDS, ("latent_heat",), ResultCache())


def _at(setting: Search, enthalpy: float) -> Fit:
    values = setting.problem.start_values()
    values[setting.problem.names.index("latent_heat.enthalpy")] = enthalpy
    return Fit(values, 1.0, True, "", 1)


def test_an_effect_that_one_run_alone_shows_is_not_told_without_it() -> None:
    setting = _setting()
    nothing = np.full((2, SAMPLES), 5e-3)
    present = Model((), _at(setting, 0.0).values, 2.0, nothing, setting.rmse(nothing))
    entry = Fitted(("latent_heat",), _at(setting, 2e4))
    assert setting.determined_without(entry, present).tolist() == [False, True]
    scored = setting.cross_validated([entry], present)[0]
    np.testing.assert_array_equal(scored.left_out[0], present.left_out[0])
    assert np.sqrt(np.mean(scored.left_out[1] ** 2)) < 1.2 * NOISE


def test_a_fit_that_a_fold_has_passed_goes_on_from_there() -> None:
    """The fit to all runs ended far off; without the run at rest it comes to the truth, which is better for both."""
    setting = _setting()
    off = _at(setting, 5e3)
    (misfit,) = misfits(setting.problem, [off.values])
    short = dataclasses.replace(off, cost=float((misfit**2).sum()) / NOISE**2)
    (model,) = setting.cross_validated([Fitted(("latent_heat",), short)])
    assert short.cost > 4.0 * 2 * SAMPLES
    assert model.cost < 1.2 * 2 * SAMPLES
    assert model.values[setting.problem.names.index("latent_heat.enthalpy")] == pytest.approx(2e4, rel=0.02)


def test_a_model_that_predicts_left_out_runs_worse_is_not_better() -> None:
    setting = _setting()
    rng = np.random.default_rng(3)
    small, large = (size * rng.normal(size=(2, SAMPLES)) for size in (1e-4, 3e-4))
    old = Model((), setting.problem.start_values(), 2.0, small, setting.rmse(small))
    new = Model(("latent_heat",), setting.problem.start_values(), 1.0, large, setting.rmse(large))
    assert not setting.better(new, old, CHANCE)[0]
    assert setting.better(
        Model(("latent_heat",), old.values, 0.1, small, setting.rmse(small)),
        Model((), old.values, 1.0, large, setting.rmse(large)),
        CHANCE,
    )[0]


@pytest.mark.parametrize("runs", [1, 5, 12, 500])
def test_every_run_is_left_out_once_and_never_in_more_than_so_many_parts(runs: int) -> None:
    setting = _setting()
    blank = setting.problem.batch
    many = RunBatch(
        {"voltage": jnp.zeros((runs, 3))}, jnp.zeros((runs, 3)), jnp.ones((runs, 3)), jnp.zeros((runs, 0)), (), blank.dt
    )
    setting.problem = Problem.build(setting.problem.system, many, NOISE, False)
    parts = setting.parts()
    assert parts.shape == (min(runs, setting.config.most_folds), runs)
    np.testing.assert_array_equal(parts.sum(axis=0), 1.0)
