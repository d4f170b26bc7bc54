"""What could be mistaken for an effect, how likely it is by the same runs, and which run separates the two."""

from __future__ import annotations

import dataclasses
from types import SimpleNamespace
from typing import cast

import jax.numpy as jnp
import numpy as np
import pytest

from smajax.attribution.config import AttributionConfig
from smajax.attribution.confounders import confounders, log_likelihood_ratio, overlap, separating_runs
from smajax.attribution.fitted_sets import JointSearch
from smajax.attribution.joint_parameters import JointParameters
from smajax.attribution.joint_search import search_jointly
from smajax.attribution.laplace_evidence import FittedModel, fitted_model
from smajax.attribution.model_fits import Model, Search
from smajax.attribution.optimum import as_model, at_optimum
from smajax.core.result_cache import ResultCache
from smajax.data.experiment.record import Run
from smajax.fit.levenberg_marquardt import FitSettings
from smajax.fit.packed_runs import RunBatch, simulate_batch
from smajax.fit.problem import Problem
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
    mixed = 0.6 * trace + 0.8 * other + 3.0 * fitted
    assert overlap(5.0 * trace + 7.0 * fitted, [fitted], [mixed]) == pytest.approx(0.6)
    assert overlap(trace, [fitted], [mixed, other]) == pytest.approx(1.0)
    assert overlap(trace, [fitted], [fitted]) == 0.0
    assert overlap(fitted, [fitted], [mixed]) == 0.0
    assert overlap(trace, [], [0.6 * trace + 0.8 * other]) == pytest.approx(0.6)


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


def at_base_of(setting: Search, model: Model) -> Model:
    values = np.array(model.values)
    values[setting.problem.names.index("latent_heat.enthalpy")] = 0.0
    return dataclasses.replace(model, effects=(), values=values)


@pytest.mark.slow  # by its prior odds below
def test_a_confounder_is_weighed_by_its_evidence() -> None:
    setting, model, runs = _setting()
    setting.config = AttributionConfig(overlap_listed=0.01)  # of two that these runs distinguish well
    joint = JointParameters.of(setting.problem, setting.unknowns, setting.bounds, setting.candidates, setting.extent)
    search = JointSearch(joint, setting.extent, FitSettings(), NOISE)
    found = search_jointly(search, {(): at_base_of(setting, model).values})
    assert found.effects == ("latent_heat",)
    model = as_model(search, found, search.error(found))
    (one,) = confounders(search, setting, model, runs)
    assert (one.effect, one.confounder) == ("latent_heat", "phase_resistance")
    assert 0.01 < one.overlap < 0.1
    # Latent heat is far stronger than the noise here: the other one does not do.
    assert one.weight < 1e-3
    assert one.rmse_fit > 2.0 * NOISE
    assert one.separating_run == ""
    ((what, apart),) = separating_runs(setting, model, [at_base_of(setting, model)], runs)
    assert what.startswith("voltage")
    assert apart > 10.0
    assert confounders(search, setting, dataclasses.replace(model, effects=()), runs) == ()


def test_two_effects_with_the_same_trace_are_weighed_by_their_prior_odds(monkeypatch: pytest.MonkeyPatch) -> None:
    """As likely as the other, by the prior odds of each, which the same evidence leaves as they are."""
    # The twin's parameters are those of the other: there is no fit of it.
    monkeypatch.setattr("smajax.attribution.confounders.at_optimum", lambda search, one, error, program: one)
    setting, model, runs = _setting()
    joint = JointParameters.of(setting.problem, setting.unknowns, setting.bounds, setting.candidates, setting.extent)
    search = JointSearch(joint, setting.extent, FitSettings(), NOISE)
    found = search_jointly(search, {(): at_base_of(setting, model).values})
    model = as_model(search, found, search.error(found))
    twin = dataclasses.replace(found, effects=("phase_resistance",), log_prior=found.log_prior - 1.0)
    search.fitted[twin.effects] = twin
    (one,) = confounders(search, setting, model, runs)
    assert one.weight == pytest.approx(1.0 / (1.0 + np.e))
    assert one.separating_run != ""
    assert one.log_likelihood_ratio == pytest.approx(0.0)
    assert not one.only_by_priors  # it is likely enough by itself

    def with_twin(ratio: float, prior: float) -> list[bool]:
        """Whether it is less likely by its priors alone: with that much in log likelihood over the other, and in priors."""
        squares = found.squares - 2.0 * search.error(found) ** 2 * ratio
        search.fitted[twin.effects] = dataclasses.replace(twin, squares=squares, log_prior=found.log_prior + prior)
        return [one.only_by_priors for one in confounders(search, setting, model, runs)]

    assert with_twin(0.0, -10.0) == [True]
    assert with_twin(-2.0, -10.0) == [True]
    assert with_twin(8.0, -14.0) == [True]  # the runs even prefer it
    # It is told by the runs, or as much by them as by its priors; or it is likely enough.
    assert not any(with_twin(-4.0, -10.0))
    assert not any(with_twin(-2.5, -2.0))
    assert with_twin(0.0, -2.0) == [False]
    # Nor is it alike where the effect does little for the runs: any other does as much.
    search.fitted[()] = dataclasses.replace(search.fitted[()], squares=found.squares + search.error(found) ** 2)
    assert not any(with_twin(0.0, -10.0))


def test_a_model_that_is_compared_is_taken_to_its_optimum_and_not_kept() -> None:
    """As the search leaves one that fell behind: a little off."""
    setting, model, _ = _setting()
    joint = JointParameters.of(setting.problem, setting.unknowns, setting.bounds, setting.candidates, setting.extent)
    search = JointSearch(joint, setting.extent, FitSettings(), NOISE)
    values = np.array(model.values)
    values[joint.slots["convection_coefficient"]] *= 1.01
    early = fitted_model(joint, ("latent_heat",), values, ("latent_heat",))
    best = at_optimum(search, early, NOISE)
    assert log_likelihood_ratio(joint, best, early, NOISE) > 1.0
    assert not search.fitted
    again = at_optimum(search, best, NOISE)
    assert abs(log_likelihood_ratio(joint, again, best, NOISE)) < 0.1


def test_what_priors_hold_back_is_no_difference_between_models() -> None:
    """Of two straight lines that fit alike, one with a slope far from usual: closed form of a linear model."""
    gram, best = 4.0, 3.0  # of one coefficient in widths of its prior: least squares alone would end at `best`

    def fitted(usual: float) -> FittedModel:
        """At the mode, with a prior about `usual`, which the coefficient counts from."""
        at = gram * (best - usual) / (gram + 1.0)
        left = 100.0 + gram * (usual + at - best) ** 2
        one = np.ones(1)
        return FittedModel(
            effects=("a",),
            values=at * one,
            names=("c",),
            scales=one,
            squares=left,
            gram=gram * np.eye(1),
            precision=one,
            width_factors={},
            log_prior=0.0,
            one_sided=(),
            residual=np.zeros(1),
            rms=1.0,
            correlation=1.0,
        )

    joint = cast(JointParameters, SimpleNamespace(slots={"c": 0}, deviation=lambda name, value: value))
    far, near = fitted(0.0), fitted(3.0)
    assert 0.5 * (near.squares - far.squares) == pytest.approx(-0.72)
    assert log_likelihood_ratio(joint, far, near, 1.0) == pytest.approx(0.0, abs=1e-3)
    assert log_likelihood_ratio(joint, near, near, 1.0) == 0.0
