"""Prediction by the average of the likely models: its band holds nine of ten samples of runs that no fit saw."""

from __future__ import annotations

import dataclasses

import jax.numpy as jnp
import numpy as np
import pytest

from smajax.attribution import likely_models_check
from smajax.attribution.averaged_prediction import averaged, likely_models
from smajax.attribution.fitted_sets import JointSearch
from smajax.attribution.joint_search import search_jointly
from smajax.attribution.model_fits import Model, Search
from smajax.attribution.optimum import as_model
from smajax.attribution.reasons import HeldOutWorse, StepDependent
from smajax.core.result_cache import ResultCache
from smajax.fit.packed_runs import RunBatch
from smajax.fit.prediction_band import BAND
from tests.helpers.hot_weight import NOISE, UNKNOWNS, hot_weight

CANDIDATES = ("latent_heat", "sensor_gain")  # what the rival is made of
TRUTH = {"latent_heat.enthalpy": 1.2e4}


def _fitted() -> tuple[Search, JointSearch, Model]:
    search = hot_weight(TRUTH, CANDIDATES)
    problem = search.joint.problem
    found = search_jointly(search, {(): problem.start_values()})
    setting = Search(problem, UNKNOWNS, search.joint.bounds, CANDIDATES, ResultCache())
    return setting, search, as_model(search, found, search.error(found))


@pytest.fixture(scope="module")
def fitted() -> tuple[Search, JointSearch, Model]:
    return _fitted()


def _fresh_runs() -> RunBatch:
    """The same bench with another noise."""
    return hot_weight(TRUTH, CANDIDATES, seed=77).joint.problem.batch


@pytest.mark.slow
def test_nine_of_ten_samples_of_fresh_runs_lie_in_the_band(fitted: tuple[Search, JointSearch, Model]) -> None:
    setting, search, final = fitted
    found = averaged(setting, search, final, _fresh_runs())
    inside = np.mean([run.coverage for run in found.runs])
    assert inside == pytest.approx(BAND, abs=0.05)
    assert all(0 < run.moving_samples < run.samples for run in found.runs)
    assert np.mean([run.moving_coverage for run in found.runs]) == pytest.approx(BAND, abs=0.07)
    assert np.sqrt(np.mean([run.rmse**2 for run in found.runs])) == pytest.approx(NOISE, rel=0.1)
    assert sum(one.weight for one in found.models) == pytest.approx(1.0)


@pytest.mark.slow
def test_the_band_is_wider_where_the_parameters_are_less_certain(fitted: tuple[Search, JointSearch, Model]) -> None:
    setting, search, final = fitted
    narrow = averaged(setting, search, final, _fresh_runs())
    loose = dataclasses.replace(search, fitted={})
    for effects, model in search.fitted.items():
        loose.fitted[effects] = dataclasses.replace(model, gram=model.gram / 100.0)
    wide = averaged(setting, loose, final, _fresh_runs())
    for one, other in zip(wide.runs, narrow.runs, strict=True):
        assert (one.half_width >= other.half_width).all()  # equal where no parameter shows, as at rest
    mean_wide, mean_narrow = (np.mean([run.half_width for run in one.runs]) for one in (wide, narrow))
    assert mean_wide > 1.1 * mean_narrow


def test_models_are_weighed_by_their_probability_and_the_average_lies_between(
    fitted: tuple[Search, JointSearch, Model],
) -> None:
    setting, search, final = fitted
    best = search.fitted[search.joint.ordered(final.effects)]
    other = np.array(best.values)
    other[search.joint.slots["latent_heat.enthalpy"]] *= 1.5
    rival = dataclasses.replace(
        best, effects=("latent_heat", "sensor_gain"), values=other, log_prior=best.log_prior - np.log(3.0)
    )
    two = dataclasses.replace(search, fitted={best.effects: best, rival.effects: rival})
    models = likely_models(two, final)
    assert [weight for _, weight in models] == pytest.approx([0.75, 0.25])
    batch = _fresh_runs()
    mean = averaged(setting, two, final, batch)
    ends = [
        averaged(
            setting,
            dataclasses.replace(search, fitted={best.effects: one}),
            dataclasses.replace(final, values=one.values),
            batch,
        )
        for one in (best, dataclasses.replace(best, values=other))
    ]
    for run, first, second in zip(mean.runs, *(end.runs for end in ends), strict=True):
        np.testing.assert_allclose(run.reading, 0.75 * first.reading + 0.25 * second.reading, atol=1e-9)
        assert (run.half_width >= first.half_width).all()


def test_a_model_that_was_rejected_is_not_averaged_with(fitted: tuple[Search, JointSearch, Model]) -> None:
    """Held-out runs rejected all that was added: the base model alone predicts."""
    _, search, _ = fitted
    base = as_model(search, search.fitted[()], search.error_of(()))
    assert [(model.effects, weight) for model, weight in likely_models(search, base)] == [((), 1.0)]


def test_each_run_keeps_its_own_offset(fitted: tuple[Search, JointSearch, Model]) -> None:
    setting, search, final = fitted
    batch = _fresh_runs()
    shifted = dataclasses.replace(batch, output=batch.output + 1e-3 * jnp.arange(batch.runs)[:, None])
    free = dataclasses.replace(setting, problem=dataclasses.replace(setting.problem, offset=(True,)))
    plain, moved = (averaged(free, search, final, one) for one in (batch, shifted))
    for run, (one, other) in enumerate(zip(plain.runs, moved.runs, strict=True)):
        np.testing.assert_allclose(other.reading - one.reading, 1e-3 * run, atol=1e-12)
        assert other.rmse == pytest.approx(one.rmse)


def _with_rival(
    fitted: tuple[Search, JointSearch, Model], share: float, factor: float
) -> tuple[Search, JointSearch, Model, Model]:
    """(setting with fresh runs held out, search of two models, the likeliest, the base model): a rival of weight `share` with `factor` of the latent heat."""
    setting, search, final = fitted
    best = search.fitted[search.joint.ordered(final.effects)]
    values = np.array(best.values)
    values[search.joint.slots["latent_heat.enthalpy"]] *= factor
    log_prior = best.log_prior + np.log(share / (1.0 - share))
    rival = dataclasses.replace(best, effects=(*best.effects, "sensor_gain"), values=values, log_prior=log_prior)
    two = dataclasses.replace(search, fitted={best.effects: best, rival.effects: rival})
    held_out = dataclasses.replace(setting, held_out=_fresh_runs())
    return held_out, two, final, as_model(search, search.fitted[()], search.error_of(()))


def test_a_rival_that_the_held_out_runs_reject_is_not_averaged_with(fitted: tuple[Search, JointSearch, Model]) -> None:
    setting, search, final, base = _with_rival(fitted, 0.25, 1.5)
    found = averaged(setting, search, final, _fresh_runs(), base)
    assert [(one.effects, one.weight) for one in found.models] == [(final.effects, 1.0)]
    (dropped,) = found.dropped
    assert dropped.weight == pytest.approx(0.25)
    assert isinstance(dropped.reason, HeldOutWorse)
    assert dropped.reason.rmse_without == pytest.approx(NOISE, rel=0.1)
    assert dropped.reason.rmse_with > 1.02 * dropped.reason.rmse_without
    alone = averaged(
        setting, dataclasses.replace(search, fitted=dict([*search.fitted.items()][:1])), final, _fresh_runs()
    )
    for one, other in zip(found.runs, alone.runs, strict=True):
        np.testing.assert_array_equal(one.reading, other.reading)


def test_a_rival_that_predicts_as_well_stays(fitted: tuple[Search, JointSearch, Model]) -> None:
    setting, search, final, base = _with_rival(fitted, 0.25, 1.0 + 1e-6)
    found = averaged(setting, search, final, _fresh_runs(), base)
    assert [one.weight for one in found.models] == pytest.approx([0.75, 0.25])
    assert found.dropped == ()


def test_a_rival_of_little_weight_is_not_looked_at(fitted: tuple[Search, JointSearch, Model]) -> None:
    setting, search, final, base = _with_rival(fitted, 0.04, 1.5)
    found = averaged(setting, search, final, _fresh_runs(), base)
    assert len(found.models) == 2
    assert found.dropped == ()


def test_a_rival_whose_gain_is_the_integrations_is_not_averaged_with(
    fitted: tuple[Search, JointSearch, Model], monkeypatch: pytest.MonkeyPatch
) -> None:
    setting, search, final, base = _with_rival(fitted, 0.25, 1.0 + 1e-6)
    monkeypatch.setattr(likely_models_check, "gain_kept_at_half_step", lambda *_: 0.2)
    found = averaged(setting, search, final, _fresh_runs(), base)
    assert [one.effects for one in found.models] == [final.effects]
    assert isinstance(found.dropped[0].reason, StepDependent)
    assert found.dropped[0].reason.gain_kept == 0.2
