"""What could be mistaken for an effect, and how far an estimate depends on which runs there happened to be."""

from __future__ import annotations

import dataclasses

import jax.numpy as jnp
import numpy as np
import pytest

from smajax.attribution.bootstrap import bootstrap_intervals
from smajax.attribution.config import AttributionConfig
from smajax.attribution.confounders import confounders, overlap, separating_run, switched_on
from smajax.attribution.cross_validation import Model, Search, Start
from smajax.core.result_cache import ResultCache
from smajax.data.experiment.record import Run
from smajax.fit.packed_runs import RunBatch, simulate_batch
from smajax.fit.problem import Problem
from smajax.fit.sensitivity import Sensitivity
from smajax.model.effects.library import LIBRARY
from smajax.model.extended import extended
from smajax.model.presets import build

DT, SAMPLES, NOISE = 0.1, 160, 1e-4
TRUE = 2e4
BOUNDS = {
    "convection_coefficient": (50.0, 400.0),
    "latent_heat.enthalpy": (0.0, 6e4),
    "phase_resistance.contrast": (-0.9, 1.0),
    "wrong_load.share": (-0.9, 2.0),
}


def test_overlap_is_the_share_of_a_trace_that_another_could_leave() -> None:
    rng = np.random.default_rng(0)
    fitted, trace, other = np.linalg.qr(rng.standard_normal((200, 3)))[0].T
    columns = np.stack([fitted, 0.6 * trace + 0.8 * other + 3.0 * fitted, other, fitted], axis=1)
    at = Sensitivity(("fitted", "mixed", "other", "same"), np.zeros((1, 200)), columns[None], np.ones((1, 200)))
    assert overlap(at, 5.0 * trace + 7.0 * fitted, ["fitted"], ["mixed"]) == pytest.approx(0.6)
    assert overlap(at, trace, ["fitted"], ["mixed", "other"]) == pytest.approx(1.0)
    assert overlap(at, trace, ["fitted"], ["same"]) == 0.0
    assert overlap(at, fitted, ["fitted"], ["mixed"]) == 0.0


def _setting() -> tuple[Search, Model, list[Run]]:
    """Three runs of a wire with latent heat, and the model that has it, at the truth."""
    levels = [(9.0, 0.0), (6.0, 0.0), (9.0, 5.0)]
    volts = jnp.stack([jnp.repeat(jnp.asarray(pair), SAMPLES // 2) for pair in levels])
    base = build("flexinol_table_3_2", "dead_weight", "voltage")
    blank = RunBatch({"voltage": volts}, jnp.zeros((3, SAMPLES)), jnp.ones((3, SAMPLES)), jnp.zeros((3, 0)), (), DT)
    exact = simulate_batch(extended(base, ("latent_heat",), {"latent_heat.enthalpy": TRUE}), blank).reading
    noise = NOISE * np.random.default_rng(5).standard_normal(exact.shape)
    batch = dataclasses.replace(blank, output=jnp.asarray(exact + noise))
    candidates = ("latent_heat", "phase_resistance")
    problem = Problem.build(extended(base, candidates), batch, NOISE, False)
    setting = Search(problem, ("convection_coefficient",), BOUNDS, candidates, ResultCache())
    values = problem.start_values()
    values[problem.names.index("latent_heat.enthalpy")] = TRUE
    ones = np.ones((3, SAMPLES))
    model = Model(("latent_heat",), values, 480.0, NOISE * ones, NOISE)
    time = DT * np.arange(SAMPLES, dtype=np.float64)
    runs = [
        Run(
            f"run {k}",
            "fit",
            time,
            {"voltage": np.asarray(volts[k])},
            {"position": np.asarray(batch.output[k])},
            {},
            (),
            "",
        )
        for k in range(3)
    ]
    return setting, model, runs


def test_a_refit_begins_at_an_effects_usual_size_and_never_out_of_bounds() -> None:
    """Runs of a small stroke have small bounds."""
    name, usual = "sensor_backlash.half_width", LIBRARY["sensor_backlash"].candidate.initial_guess["half_width"]
    begun = np.asarray([7.0, 0.0])
    large, small = (switched_on(begun, ("other", name), "sensor_backlash", {name: (0.0, top)}) for top in (1.0, 5e-5))
    assert large.tolist() == [7.0, usual]
    assert small.tolist() == [7.0, 2.5e-5]
    assert begun.tolist() == [7.0, 0.0]


def at_base_of(setting: Search, model: Model) -> Model:
    values = np.array(model.values)
    values[setting.problem.names.index("latent_heat.enthalpy")] = 0.0
    return dataclasses.replace(model, effects=(), values=values)


def test_a_confounder_is_refitted_and_weighed() -> None:
    setting, model, runs = _setting()
    setting.config = AttributionConfig(overlap_refitted=0.01)  # of two that these runs distinguish well
    model = dataclasses.replace(model, values=setting.fit([Start(model.effects, model.values)], "fit")[0][0].values)
    low, high = bootstrap_intervals(setting, model, seed=1)["latent_heat.enthalpy"]
    assert 0.95 * TRUE < low <= high < 1.05 * TRUE
    assert low < high
    (found,) = confounders(setting, model, runs)
    assert (found.effect, found.confounder) == ("latent_heat", "phase_resistance")
    assert 0.01 < found.overlap < 0.1
    # Latent heat is far stronger than the noise here: the other one does not do.
    assert found.weight < 1e-3
    assert found.left_out_rmse > 2.0 * NOISE
    assert found.separating_run == ""
    what, apart = separating_run(setting, model, at_base_of(setting, model), runs)
    assert what.startswith("voltage")
    assert apart > 10.0
