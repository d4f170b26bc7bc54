"""An effect is found where it was, at whatever time or scale."""

from __future__ import annotations

import dataclasses

import jax.numpy as jnp
import numpy as np
import pytest

from smajax.attribution.model_fits import Model, Search, nudged
from smajax.attribution.nuisance_grid import scanned, scores_at
from smajax.attribution.run_extent import extent_of
from smajax.core.parameters import parameters, set_parameters
from smajax.core.result_cache import ResultCache
from smajax.fit.packed_runs import RunBatch, simulate_batch
from smajax.fit.problem import Problem
from smajax.fit.sensitivity import sensitivity
from smajax.model.extended import extended
from smajax.model.presets import build

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
