"""An effect is found where it was, at whatever time or scale."""

from __future__ import annotations

import dataclasses
from typing import Any

import jax.numpy as jnp
import numpy as np
import pytest

from smajax.attribution import nuisance_grid
from smajax.attribution.model_fits import Model, Search, nudged
from smajax.attribution.nuisance_grid import scanned, scores_at
from smajax.attribution.run_extent import extent_of
from smajax.core.parameters import parameters, set_parameters
from smajax.core.result_cache import ResultCache
from smajax.fit.integration import with_integration
from smajax.fit.outputs_of_runs import misfits
from smajax.fit.packed_runs import RunBatch, simulate_batch
from smajax.fit.problem import Problem
from smajax.fit.sensitivity import sensitivity
from smajax.model.extended import extended
from smajax.model.presets import build
from smajax.simulation.steppers import Integration

DT, SAMPLES, NOISE = 0.1, 300, 1e-5
EFFECTS = ("draught", "radiation")


def _setting(time: float, lasting: float) -> Search:
    """Two runs held in the middle of the transformation, in air that moves for a while."""
    base = build("flexinol_table_3_2", "dead_weight", "voltage")
    levels = [[5.5] * 300, [6.0] * 150 + [4.5] * 150]
    inputs = {"voltage": jnp.asarray(levels)}
    blank = RunBatch(inputs, jnp.zeros((2, SAMPLES)), jnp.ones((2, SAMPLES)), jnp.zeros((2, 0)), (), DT)
    full = extended(base, EFFECTS, {})
    on = {"draught.change": 0.08, "draught.time": time, "draught.lasting": lasting, "draught.width": 0.3}
    truth = simulate_batch(set_parameters(full, on), blank).reading
    noise = NOISE * np.random.default_rng(2).normal(size=truth.shape)
    batch = dataclasses.replace(blank, output=truth + noise)
    bounds = {name: (entry.low, entry.high) for name, entry in parameters(full).items()}
    return Search(Problem.build(full, batch, NOISE, False), (), bounds, EFFECTS, ResultCache())


def _base(setting: Search) -> Model:
    return Model((), setting.problem.start_values(), 1.0, np.zeros((2, SAMPLES)), 1.0)


@pytest.mark.parametrize(("time", "lasting"), [(12.0, 7.5), (22.0, 1000.0)], ids=["for a while", "to the end"])
def test_a_draught_is_scanned_over_its_time(time: float, lasting: float) -> None:
    setting = _setting(time, lasting)
    base = _base(setting)
    best = scores_at(setting, base, EFFECTS)[0]
    assert best.effects == ("draught",)
    assert best.gain > 0.5
    place = scanned(setting, base.values, EFFECTS, ()).place["draught"]
    assert abs(place["draught.time"] - time) < 2.0
    assert (place["draught.lasting"] < 30.0) == (lasting < 30.0)
    # At the one place of before, two seconds into the run, there is next to nothing to see.
    assert best.gain > 2.0 * _gain_at_two_seconds(setting, base)


def _gain_at_two_seconds(setting: Search, base: Model) -> float:
    at = sensitivity(setting.problem, nudged(setting, base.values, ("draught",)), ["draught.change"])
    column, residual = at.columns(["draught.change"])[:, 0], at.residual()
    return float((column @ residual) ** 2 / (column @ column) / (residual @ residual))


def test_a_score_is_corrected_for_the_number_of_places_scanned() -> None:
    setting = _setting(12.0, 7.5)
    looked = scanned(setting, _base(setting).values, EFFECTS, ())
    assert looked.looks["draught"] > 5
    assert "radiation" not in looked.looks
    extent = extent_of(setting.problem)
    assert extent.seconds == pytest.approx(DT * SAMPLES)
    assert extent.stroke == pytest.approx(float(np.ptp(setting.problem.measured, axis=1).max()))


@pytest.mark.parametrize("far", [False, True])
def test_scores_are_the_models_own_where_one_step_a_sample_is_far_off(
    monkeypatch: pytest.MonkeyPatch, far: bool
) -> None:
    setting = _setting(12.0, 7.5)
    setting = dataclasses.replace(setting, problem=with_integration(setting.problem, Integration(substeps=3)))
    taken = []

    def recorded(problem: Any, *given: Any) -> Any:
        taken.append(problem.batch.integration.substeps)
        return sensitivity(problem, *given)

    monkeypatch.setattr(nuisance_grid, "sensitivity", recorded)
    monkeypatch.setattr(nuisance_grid, "far_from", lambda *_: far)
    base = _base(setting)
    looked = scanned(setting, base.values, EFFECTS, ())
    assert taken[-1] == (3 if far else 1)
    # What is left is the model's own either way.
    own, index = setting.restricted(())
    left = misfits(own, [base.values[index]])[0] / np.asarray(own.noise)
    np.testing.assert_array_equal(looked.at.misfit, left)
