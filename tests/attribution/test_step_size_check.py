"""A friction with which the load may jump: how much of its gain it keeps at half the step; and a finer integration where one is asked for."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from types import SimpleNamespace

import jax.numpy as jnp
import numpy as np
import pytest

from smajax.attribution.close_loop import prepared
from smajax.attribution.config import AttributionConfig
from smajax.attribution.job import job_of
from smajax.attribution.model_fits import Model, Search
from smajax.attribution.step_size_check import finer_integration, gain_kept_at_half_step, integration_error_of
from smajax.core.parameters import parameters
from smajax.core.progress import quiet
from smajax.core.result_cache import ResultCache
from smajax.data.open_experiment import open_experiment
from smajax.fit.integration import LARGEST, described
from smajax.fit.outputs_of_runs import misfits
from smajax.fit.packed_runs import RunBatch, halved, simulate_batch
from smajax.fit.problem import Problem
from smajax.model.extended import extended
from smajax.model.presets import build

DEMO = Path(__file__).parents[2] / "smajax" / "data" / "demo" / "latent" / "experiment.toml"
DT, SAMPLES, NOISE = 0.1, 300, 1e-5
TRUE = {"limit": 0.5, "sliding": 0.9, "speed": 1e-3, "bend": 1e-4}
HEAT, FRICTION = ("latent_heat",), ("stribeck_friction",)


@pytest.fixture(scope="module")
def setting() -> Search:
    """A weight that rubs, whatever the step; the candidates are its friction and latent heat."""
    time = np.arange(SAMPLES) * DT
    inputs = {
        "voltage": jnp.asarray([8.0 * np.abs(np.sin(np.pi * time / 15.0)), 10.0 * np.abs(np.sin(np.pi * time / 10.0))])
    }
    base = build("flexinol_table_3_2", "dead_weight", "voltage")
    rubbing = extended(base, FRICTION, {f"stribeck_friction.{name}": value for name, value in TRUE.items()})
    blank = RunBatch(inputs, jnp.zeros((2, SAMPLES)), jnp.ones((2, SAMPLES)), jnp.zeros((2, 0)), (), DT)
    shown = simulate_batch(rubbing, halved(blank)).reading[:, ::2]
    noise = NOISE * np.random.default_rng(1).normal(size=shown.shape)
    batch = RunBatch(inputs, shown + noise, blank.mask, blank.overrides, (), DT)
    problem = Problem.build(extended(base, HEAT + FRICTION, {}), batch, NOISE, False)
    bounds = {entry.name: (entry.low, entry.high) for entry in parameters(problem.system).values()}
    return Search(problem, ("convection_coefficient",), bounds, HEAT + FRICTION, ResultCache())


def _model(setting: Search, effects: tuple[str, ...], **values: float) -> Model:
    point = setting.problem.start_values()
    for name, value in values.items():
        point[setting.problem.names.index(f"{effects[0]}.{name}")] = value
    (misfit,) = misfits(setting.problem, [point])
    return Model(effects, point, float((misfit**2).sum()) / NOISE**2, misfit, setting.rmse(misfit))


def _by_chance(setting: Search, model: Model, share: float) -> Model:
    """As if at the step of the fit alone the jumps of another friction fell where the log's do."""
    lucky = np.sqrt(share) * model.left_out
    return Model(model.effects, model.values, share * model.cost, lucky, setting.rmse(lucky))


def test_a_true_friction_keeps_its_gain_at_half_the_step(setting: Search) -> None:
    base, rubbing = _model(setting, ()), _model(setting, FRICTION, **TRUE)
    assert gain_kept_at_half_step(setting, rubbing, base) == pytest.approx(1.0, abs=0.02)


def test_an_effect_without_jumps_is_not_checked_at_half_the_step(setting: Search) -> None:
    base = _model(setting, ())
    assert gain_kept_at_half_step(setting, _by_chance(setting, _model(setting, HEAT), 0.01), base) == 1.0


def test_a_friction_without_a_gain_is_not_saved_by_the_gain_of_another_effect(setting: Search) -> None:
    """Of both together more than half would be left at half the step: all of it is the partner's."""
    base = _model(setting, ())
    both = _model(setting, FRICTION + HEAT, **{**TRUE, "limit": 0.0})
    pair = _by_chance(setting, both, 0.05)
    apart = dataclasses.replace(base, cost=4.0 * base.cost)
    assert gain_kept_at_half_step(setting, pair, apart) < 0.1
    alone = _by_chance(setting, _model(setting, FRICTION, **{**TRUE, "limit": 0.0}), 0.05)
    assert gain_kept_at_half_step(setting, alone, apart) > 0.7


def test_a_gain_that_depends_on_the_step_is_lost_at_half_the_step(setting: Search) -> None:
    base = _model(setting, ())
    lucky = _by_chance(setting, _model(setting, FRICTION, **{**TRUE, "limit": 0.0}), 0.01)
    assert gain_kept_at_half_step(setting, lucky, base) < 0.1


def test_the_integration_is_that_of_the_base_fit_where_the_wire_does_not_move_at_the_start(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Else the whole search is made, and then made again. The base fit is taken to end where the demo's file begins."""
    experiment = dataclasses.replace(open_experiment(DEMO), effects_only=())
    moving = job_of(experiment).problem
    high = {"convection_coefficient", "austenite_start", "austenite_finish"}
    cold = tuple(
        dataclasses.replace(one, start=one.high if one.name in high else one.start) for one in experiment.unknowns
    )
    experiment = dataclasses.replace(experiment, unknowns=cold)
    assert described(job_of(experiment).problem.batch.integration) == "one step a sample"
    monkeypatch.setattr(Search, "base", lambda *_: SimpleNamespace(values=moving.start_values()))
    context = prepared(experiment, ResultCache(), quiet, 1, AttributionConfig())
    assert described(context.job.problem.batch.integration) == described(moving.batch.integration)
    assert finer_integration(context.setting, (), context.base.values) is None


@pytest.mark.slow  # a whole loop at two steps
def test_an_effect_that_needs_a_finer_integration_than_the_base_model_gets_it() -> None:
    """The demo logs at 100 ms; under Liang's conditions its branches end more sharply than those of the base model."""
    experiment = dataclasses.replace(open_experiment(DEMO), effects_only=("liang_conditions",))
    context = prepared(experiment, ResultCache(), quiet, 1, AttributionConfig())
    setting = context.setting
    base, liang = _model(setting, ()), _model(setting, ("liang_conditions",), share=1.0)
    assert integration_error_of(setting, base).small
    assert finer_integration(setting, (), base.values) is None
    assert integration_error_of(setting, liang).share > LARGEST
    finer = finer_integration(setting, liang.effects, liang.values)
    assert finer is not None
    again = prepared(experiment, ResultCache(), quiet, 1, AttributionConfig(), integration=finer)
    assert integration_error_of(again.setting, liang).share < LARGEST
    assert again.job.held_out is not None
    assert described(again.job.held_out.integration) == described(finer)
