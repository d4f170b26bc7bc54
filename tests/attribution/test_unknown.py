"""Unknown terms: nothing where they are zero, the right equation first where something hidden is, none where nothing is."""

from __future__ import annotations

import dataclasses
import math
from functools import cache, partial
from importlib import import_module
from types import SimpleNamespace
from typing import Any, ClassVar

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.interpolate import BSpline

from smajax.attribution.config import AttributionConfig
from smajax.attribution.context import Outcome
from smajax.attribution.findings import UnknownTerm
from smajax.attribution.formulas import formulas
from smajax.attribution.model_fits import Search
from smajax.attribution.reasons import UnknownTermLikelier
from smajax.attribution.score_test import Score
from smajax.attribution.unknown.ranges import Sought
from smajax.attribution.unknown.search import Lacking, _explains, in_place_of, unknown_terms
from smajax.attribution.unknown.spline import COUNT, WAVES, design, powers_of, spline
from smajax.attribution.unknown.term_fits import _best_of_each, programs_of_terms, with_terms
from smajax.attribution.unknown.terms import UNKNOWN
from smajax.fit.outputs_of_runs import misfits, predicted_at
from smajax.fit.packed_runs import simulate_batch
from smajax.fit.sensitivity import sensitivity
from smajax.model.effects.base import AbstractEffect
from smajax.model.effects.library import LIBRARY
from smajax.model.sensor_reading import SensorTerm
from smajax.model.types import Scalar, WireState
from smajax.model.wire.constitutive import ConstitutiveTerm
from smajax.model.wire.heat import HeatState, HeatTerm
from smajax.model.wire.wire import Wire
from tests.attribution.test_unknown_alike import TiredSupply
from tests.helpers.often import often
from tests.helpers.stepped_weight import LEVELS, NOISE, SAMPLES, fitted, hidden_in_runs

close_loop = import_module("smajax.attribution.close_loop")

DRAWS = 20  # of noise on a function's coefficients


class _JumpingLoss(AbstractEffect, HeatTerm):
    """Convection that sets in above a temperature."""

    effect_name: ClassVar[str] = "jumping_loss"

    def heat_loss(self, wire: Wire, at: HeatState) -> Scalar | float:
        surface = jnp.pi * wire.wire_diameter
        return 60.0 * surface * (at.temperature - at.ambient) * jax.nn.sigmoid((at.temperature - 75.0) / 4.0)


class _WavyStrain(AbstractEffect, ConstitutiveTerm):
    """A strain that no line in the fraction describes."""

    effect_name: ClassVar[str] = "wavy_strain"

    def strain(self, wire: Wire, at: WireState) -> Scalar | float:
        return 2e-3 * jnp.sin(2.0 * jnp.pi * at.martensite_fraction)


class _BentScale(AbstractEffect, SensorTerm):
    """A sensor whose scale is bent."""

    effect_name: ClassVar[str] = "bent_scale"

    def sensed(self, reading: Scalar, time: Scalar, last: Scalar) -> Scalar:
        return reading + 8e-4 * jnp.sin(reading / 4e-3)


@cache
def _screened() -> tuple[Search, np.ndarray, Sought]:
    return with_terms(*hidden_in_runs())


def test_the_spline_equals_de_boors() -> None:
    step = 1.0 / (COUNT - 3)
    knots = step * np.arange(-3, COUNT + 1)
    coefficients = np.random.default_rng(1).normal(size=COUNT)
    share = np.linspace(0.0, 1.0, 101)
    expected = BSpline(knots, WAVES @ coefficients, 3)(share)
    np.testing.assert_allclose(design(share) @ coefficients, expected, atol=1e-12)
    found = jax.vmap(partial(spline, powers_of([jnp.asarray(one) for one in coefficients])))(
        jnp.asarray([-0.5, *share, 2.0])
    )
    np.testing.assert_allclose(found, [expected[0], *expected, expected[-1]], atol=1e-12)


def test_unknown_terms_at_zero_are_the_base_model() -> None:
    search, values, found = _screened()
    assert {term.effect_name for term in found.terms} == set(UNKNOWN)
    alone, fitted = hidden_in_runs()
    (with_all,) = predicted_at(search.problem, [values])
    (without,) = predicted_at(alone.problem, [fitted.values])
    np.testing.assert_allclose(with_all, without, rtol=0.0, atol=1e-11)


def test_derivatives_by_every_coefficient_agree_with_differences() -> None:
    """Away from zero, where every term bends the runs."""
    search, values, _ = _screened()
    names = [name for name in search.problem.names if name.split(".")[0] in UNKNOWN]
    slots = [search.problem.names.index(name) for name in names]
    here = np.array(values)
    here[slots] = 0.05 * np.random.default_rng(2).normal(size=len(slots))
    at = sensitivity(search.problem, here, names)
    step = 1e-6
    shift = step * np.eye(len(here))[slots]
    ahead, behind = misfits(search.problem, here + shift), misfits(search.problem, here - shift)
    differences = (ahead - behind) / (2.0 * step * NOISE)
    for k, name in enumerate(names):
        exact = at.jacobian[..., k]
        missed = float(np.linalg.norm(differences[k] - exact))
        assert missed < 1e-3 * float(np.linalg.norm(exact)) + 1e-3, name


def test_a_sensors_error_is_added_once_to_every_sample() -> None:
    search, values, found = _screened()
    term = next(one for one in found.terms if one.effect_name == "unknown_reading_of_value")
    here = np.array(values)
    coefficients = np.linspace(-0.2, 0.3, COUNT)
    here[[search.problem.names.index(name) for name in search.coefficients(term.effect_name)]] = coefficients
    ideal, shown = predicted_at(search.problem, [values, here])
    share = (ideal - float(term.low)) / float(term.width)
    expected = ideal + float(term.scale) * (design(share.ravel()) @ coefficients).reshape(ideal.shape)
    np.testing.assert_allclose(shown, expected, rtol=0.0, atol=1e-11)


HIDDEN: dict[str, type[AbstractEffect]] = {
    "heat": _JumpingLoss,
    "electrical": TiredSupply,
    "constitutive": _WavyStrain,
    "sensor": _BentScale,
}


@cache
def _found(equation: str) -> tuple[UnknownTerm, ...]:
    return unknown_terms(*hidden_in_runs(HIDDEN[equation].base())).terms


@pytest.mark.parametrize(
    ("equation", "level"),
    often([("heat", 2.0), ("electrical", 1.1), ("constitutive", 1.1), ("sensor", 1.1)], [("sensor", 1.1)]),
)
def test_the_equation_of_a_hidden_term_is_ranked_first(equation: str, level: float) -> None:
    """Down to so many times the noise on runs left out, from at least 1.2 times it, and no other equation as well."""
    terms = _found(equation)
    best = terms[0]
    assert best.named, best.log_odds
    assert best.equation == equation
    assert {term.equation for term in terms if term.name in best.indistinguishable} <= {equation}
    assert best.left_out_after is not None
    assert best.left_out_after < level * NOISE
    assert best.left_out_before > 1.2 * NOISE
    assert best.log_odds > 10.0
    assert best.samples.sum() == len(LEVELS) * SAMPLES


@pytest.mark.parametrize(
    ("with_it", "without", "named"),
    [(1.5, 3.0, True), (2.9, 3.0, False), (3.1, 3.0, False), (1.02, 1.1, True), (1.09, 1.1, False), (0.98, 1.01, True)],
)
def test_a_function_is_named_where_it_explains_half_of_what_is_beyond_the_noise(
    with_it: float, without: float, named: bool
) -> None:
    """Root mean squares on runs left out, in noises."""
    assert _explains(with_it * NOISE, without * NOISE, NOISE) == named


def test_the_learnt_function_is_the_hidden_one() -> None:
    """The bent scale of a sensor, but for what a stroke that is a little longer takes over: the line in it."""
    best = _found("sensor")[0]
    truth = 8e-4 * np.sin(best.at / 4e-3)
    seen = np.interp(best.at, 0.5 * (best.cells[1:] + best.cells[:-1]), best.samples) > 4

    def bent(values: np.ndarray) -> np.ndarray:
        line = np.polynomial.Polynomial.fit(best.at[seen], values[seen], 1)
        return values[seen] - line(best.at[seen])

    assert np.sqrt(np.mean((bent(best.values) - bent(truth)) ** 2)) < 0.15 * np.std(bent(truth))


@pytest.mark.slow
@pytest.mark.parametrize("hidden", ["sensor", "latent_heat"])
def test_an_unknown_function_replaces_effects_that_are_less_likely(hidden: str) -> None:
    """A latent heat, fitted to runs in which the sensor's scale is bent, and to runs in which there is one."""
    there = LIBRARY["latent_heat"](enthalpy=20e3) if hidden == "latent_heat" else HIDDEN[hidden].base()
    setting, first = hidden_in_runs(there, library=("latent_heat",))
    start = np.array(first.values)
    start[setting.problem.names.index("latent_heat.enthalpy")] = 5e3
    effects = fitted(setting, ("latent_heat",), start)
    found = in_place_of(setting, first, effects)
    assert (found is not None) == (hidden == "sensor")
    if found is not None:
        assert found.terms[0].equation == "sensor"
        left_out = found.terms[0].left_out_after
        assert left_out is not None
        assert left_out < 1.1 * NOISE
        assert found.likeliest is not None
        assert found.likeliest.rms < 1.1 * NOISE
        assert isinstance(setting.rounds[-1].reason, UnknownTermLikelier)
        assert setting.rounds[-1].reason.log_odds > 10.0


@pytest.mark.slow
@pytest.mark.parametrize("there", [True, False], ids=["there too", "another bench"])
def test_held_out_runs_validate_a_term_or_reject_it(there: bool) -> None:
    """Of a bent scale: a held-out run that was read on it, and one that was not."""
    setting, first = hidden_in_runs(_BentScale.base())
    batch = setting.problem.batch
    plain = simulate_batch(setting.problem.system_at(jnp.asarray(first.values)), batch).reading
    setting.held_out = dataclasses.replace(batch, output=batch.output if there else plain)
    terms = unknown_terms(setting, first).terms
    best = terms[0]
    assert best.equation == "sensor"
    assert best.named == there
    assert best.held_out_before is not None
    assert best.held_out_after is not None
    assert (best.held_out_after < best.held_out_before) == there


def test_terms_that_gain_less_than_of_noise_are_notfitted() -> None:
    # Of eleven coefficients noise gives 11 squares of an independent sample on average, and less than 5.6 in one of ten.
    gains = {"unknown_heating_curve": 0.3, "unknown_force_of_speed": 0.06, "unknown_loss_of_temperature": 0.05}
    scores = [Score((name,), gain, 0.5, dict.fromkeys(map(str, range(11)), 0.0)) for name, gain in gains.items()]
    chosen = [one.effects[0] for one in _best_of_each(scores, 6, 100.0)]
    assert chosen == ["unknown_heating_curve", "unknown_force_of_speed"]
    assert len(_best_of_each(scores, 6, math.inf)) == 3
    # Where all are like that the best is fitted all the same: it is the nearest that there is.
    assert [one.effects[0] for one in _best_of_each(scores, 6, 1.0)] == ["unknown_heating_curve"]
    assert _best_of_each([Score(("unknown_heating_curve",), 0.0, 1.0, {})], 6, 100.0) == []


def test_every_term_is_in_one_program_and_one_of_the_speed_in_its_own() -> None:
    terms = list(UNKNOWN)
    joint = SimpleNamespace(
        free=lambda effects: range(100),
        problem=SimpleNamespace(batch=SimpleNamespace(mask=np.ones((3, 700)))),
        coefficients=dict.fromkeys(terms),
    )
    programs = programs_of_terms(joint, ("latent_heat",), terms)  # type: ignore[arg-type]
    assert sorted(term for _, own in programs for term in own) == sorted(terms)
    assert all(program == ("latent_heat", *own) for program, own in programs)
    assert ["unknown_force_of_speed"] in [own for _, own in programs]
    short = SimpleNamespace(**{**vars(joint), "problem": SimpleNamespace(batch=SimpleNamespace(mask=np.ones((1, 9))))})
    assert programs_of_terms(short, ("latent_heat",), terms) == [(tuple(terms), terms)]  # type: ignore[arg-type]


def test_without_a_missing_effect_no_unknown_term_is_named() -> None:
    terms = unknown_terms(*hidden_in_runs()).terms
    assert terms
    assert not any(term.named for term in terms)
    assert all(term.log_odds < 0.0 for term in terms)


def test_a_formula_of_the_dictionary_is_found_and_a_longer_one_is_not() -> None:
    low, width = 0.0, 80.0
    share = np.linspace(0.0, 1.0, 201)
    x = low + width * share
    for truth, text in ((3e-4 * x**2, "^2"), (0.9 / (1.0 + np.exp(-(x - 44.0) / 2.0)), "tanh((T - 44)")):
        coefficients = np.linalg.lstsq(design(share), truth, rcond=None)[0]
        sigma, longer = 5e-3, 0
        for seed in range(DRAWS):
            noisy = coefficients + sigma * np.random.default_rng(seed).normal(size=COUNT)
            best = formulas(low, width, noisy, sigma**2 * np.eye(COUNT), 200.0, "T")[0]
            assert text in best.text
            longer += best.numbers > 2
            np.testing.assert_allclose(best.curve, truth, atol=0.1 * np.max(truth))
        assert longer <= 0.2 * DRAWS  # ln 200 a number lets chance add one of a dozen words in about a twentieth


def test_a_formula_describes_the_function_even_where_the_parameters_could_absorb_it() -> None:
    """A resistance scaled as a whole is a convection scaled: that way lies R = 0, which is no formula for its bend."""
    share = np.linspace(0.0, 1.0, 201)
    truth = 0.1 * np.cos(4.0 * share)
    coefficients = np.linalg.lstsq(design(share), truth, rcond=None)[0]
    scaled = np.linalg.lstsq(design(share), 1.0 + truth, rcond=None)[0]
    covariance = 1e-4 * np.eye(COUNT) + 10.0 * np.outer(scaled, scaled)
    best = formulas(0.0, 1.0, coefficients, covariance, 500.0, "s")[0]
    # As high a shift as the function is large, but not on to -1.
    np.testing.assert_allclose(best.curve, truth, atol=0.12)
    assert np.corrcoef(best.curve, truth)[0, 1] > 0.95


@pytest.mark.parametrize("size", [0.0, 1e-12, 1e12, np.nan])
@pytest.mark.parametrize("width", [0.0, 1e-9, 1e9])
def test_formulas_are_found_for_small_and_narrow_functions(size: float, width: float) -> None:
    """One that stayed at zero, over a state that did not move: there is no formula, and no end of the loop."""
    coefficients = size * np.random.default_rng(0).normal(size=COUNT)
    found = formulas(0.3 * width, width, coefficients, 1e-4 * np.eye(COUNT), 100.0, "T")
    assert all(np.isfinite(one.curve).all() for one in found)
    assert bool(found) == (width > 0.0 and size > 0.0)


@pytest.mark.parametrize(("noise", "effects", "asked"), [(True, "a", False), (True, "ab", True), (False, "a", True)])
def test_one_function_is_asked_for_in_the_place_of_many_effects_or_where_more_than_noise_is_left(
    monkeypatch: pytest.MonkeyPatch, noise: bool, effects: str, asked: bool
) -> None:
    found = Lacking()
    monkeypatch.setattr(close_loop, "in_place_of", lambda *_: found)
    setting = SimpleNamespace(config=AttributionConfig(), is_noise=lambda _: noise)
    base, final = (SimpleNamespace(effects=tuple(names)) for names in ("", effects))
    outcome = Outcome(SimpleNamespace(lacking=None), base, final)  # type: ignore[arg-type]
    ended = close_loop.against_an_unknown_term(SimpleNamespace(setting=setting), outcome)
    assert (ended.lacking is found) is asked
    assert ended.superseded == (tuple(effects) if asked else ())
    assert ended.final is (base if asked else final)


@pytest.mark.parametrize("noise", [True, False])
def test_effects_that_leave_noise_stay_where_runs_left_out_are_predicted_badly(
    monkeypatch: pytest.MonkeyPatch, noise: bool
) -> None:
    """A spring that friction holds hardly moved but in one run: friction and convection left noise, were in truth what was missing, and went."""
    monkeypatch.setattr(close_loop, "in_place_of", lambda *_: None)
    reasons: list[Any] = []
    setting: Any = SimpleNamespace(
        config=AttributionConfig(),
        is_noise=lambda _: noise,
        predicts=lambda _: False,
        explained_variance=lambda _: 0.47,
        set_aside=lambda _, reason: reasons.append(reason),
    )
    base, final = (SimpleNamespace(effects=tuple(names), left_out_rmse=1.0) for names in ("", "ab"))
    outcome = Outcome(SimpleNamespace(lacking=None), base, final)  # type: ignore[arg-type]
    ended = close_loop.against_an_unknown_term(SimpleNamespace(setting=setting), outcome)
    assert ended.final is (final if noise else base)
    assert len(reasons) == (0 if noise else 1)
