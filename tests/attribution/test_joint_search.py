"""The joint search: it names what a bench lacks, alone and beside another, and nothing where nothing is missing."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
import pytest

from smajax.attribution import fits_alone, fitted_sets, joint_search, side_by_side, subset_evidence, traces
from smajax.attribution.detectable_effects import detectable
from smajax.attribution.fitted_sets import JointSearch
from smajax.attribution.joint_parameters import JointParameters, residual_and_columns
from smajax.attribution.joint_search import search_jointly
from smajax.attribution.laplace_evidence import FittedModel, fitted_model
from smajax.attribution.leave_one_run_out import left_out
from smajax.attribution.optimum import refined, with_no_effect_too_many
from smajax.attribution.program_fits import models_by_program
from smajax.attribution.set_starts import PLACES, starts
from smajax.attribution.subset_evidence import linear_model
from smajax.attribution.traces import Variant, traces_at
from smajax.core.parameters import parameter_values, parameters
from smajax.fit.integration import with_integration
from smajax.fit.levenberg_marquardt import FitSettings, levenberg_marquardt
from smajax.fit.outputs_of_runs import misfits
from smajax.fit.preset_priors import preset_priors
from smajax.fit.starts import logarithmic_points
from smajax.model.effects.library import LIBRARY
from smajax.simulation.steppers import Integration
from tests.helpers.hot_weight import CANDIDATES, NOISE, UNKNOWNS, hot_weight
from tests.helpers.often import often

LIMITED = (*CANDIDATES, "sensor_limit")


def _found(
    truth: dict[str, float], candidates: tuple[str, ...] = CANDIDATES
) -> tuple[JointSearch, dict[str, float], dict[str, float]]:
    search = hot_weight(truth, candidates)
    model = search_jointly(search, {(): search.joint.problem.start_values()})
    slots = search.joint.slots
    values = {
        name: float(model.values[slots[name]]) for effect in model.effects for name in search.joint.coefficients[effect]
    }
    return search, values, model.standard_errors(search.error(model) ** 2)


def test_an_effect_that_is_there_is_found_with_its_size() -> None:
    search, values, errors = _found({"latent_heat.enthalpy": 1.2e4})
    assert set(values) == {"latent_heat.enthalpy"}
    assert values["latent_heat.enthalpy"] == pytest.approx(1.2e4, abs=4.0 * errors["latent_heat.enthalpy"])
    probabilities = search.probabilities(search.error(search.fitted[("latent_heat",)]))
    assert sum(value for effects, value in probabilities.items() if "latent_heat" in effects) > 0.99


def test_beside_the_base_model_the_likeliest_effects_of_sets_are_fitted_alone() -> None:
    """Far off the base model a linear model needs several effects for what one does when it is fitted."""
    truth = {"rising_convection.slope": 0.02}
    search, values, _ = _found(truth)
    sets = [effects for effects, *_ in search.rounds[0].gains]
    several = {effect for effects in sets if len(effects) > 1 for effect in effects}
    alone = [effects[0] for effects in sets if len(effects) == 1]
    assert several
    assert len(alone) >= joint_search.ALONE
    assert search.rounds[0].best == ("rising_convection",)
    assert set(values) == {*truth}


def test_while_much_is_left_each_likely_effect_is_fitted_before_the_search_ends(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """The linear model may rank an effect that is far from linear behind others; here it offers none at all until the end."""
    promising = joint_search._promising
    monkeypatch.setattr(
        joint_search, "_promising", lambda *given: promising(*given) if given[2].effects else [], raising=True
    )
    search, values, _ = _found({"latent_heat.enthalpy": 1.2e4})
    assert set(values) == {"latent_heat.enthalpy"}
    assert len(search.rounds[1].gains) > joint_search.FITTED


def test_several_effects_are_added_at_once_where_none_by_itself_makes_the_model_likelier(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Here the search offers no set of effects at all, one at a time; what several at once have too much goes again."""
    promising = joint_search._promising
    monkeypatch.setattr(joint_search, "_promising", lambda *given: promising(*given) if given[2].effects else [])
    monkeypatch.setattr(joint_search, "_neighbours", lambda *_: [])
    search, values, errors = _found({"latent_heat.enthalpy": 600.0, "phase_resistance.contrast": -0.01})
    assert set(values) == {"latent_heat.enthalpy", "phase_resistance.contrast"}
    assert values["latent_heat.enthalpy"] == pytest.approx(600.0, abs=4.0 * errors["latent_heat.enthalpy"])
    assert search.rounds[-1].present == search.winner


def test_where_noise_would_remain_in_no_linear_model_several_effects_are_not_fitted(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(joint_search, "_promising", lambda *_: [])
    monkeypatch.setattr(joint_search, "_neighbours", lambda *_: [])
    monkeypatch.setattr(joint_search, "LEAVES_IN_LINEAR", 0.5)
    search, values, _ = _found({"latent_heat.enthalpy": 1.2e4})
    assert values == {}
    assert set(search.fitted) == {()}


def test_a_search_ends_where_nothing_is_to_be_sought_beside_a_model(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(joint_search, "MANY", 0)  # each model has many effects
    search = hot_weight({"latent_heat.enthalpy": 1.2e4})
    search.in_place_of_many = lambda model: model if model.effects else None
    found = search_jointly(search, {(): search.joint.problem.start_values()})
    assert found.effects
    assert len(search.rounds) == 1


def test_a_search_goes_on_from_what_is_named_before_its_end(monkeypatch: pytest.MonkeyPatch) -> None:
    """Here it offers no set of effects by itself, and is given one effect of those that were fitted alone."""
    for name in ("_promising", "_neighbours"):
        monkeypatch.setattr(joint_search, name, lambda *_: [])
    monkeypatch.setattr(joint_search, "LEAVES_IN_LINEAR", 0.0)
    search = hot_weight({"latent_heat.enthalpy": 1.2e4})

    def named(found: FittedModel) -> FittedModel | None:
        alone = fits_alone.fitted_alone(search, ["latent_heat", "sensor_gain"], search.error(found))
        assert [one.effects for one in alone] == [("latent_heat",), ("sensor_gain",)]
        return None if found.effects else alone[0]

    search.before_the_end = named
    found = search_jointly(search, {(): search.joint.problem.start_values()})
    assert found.effects == ("latent_heat",)
    assert set(search.fitted) == {(), ("latent_heat",), ("sensor_gain",)}
    # The step is a round of its own, as it is shown.
    assert [(done.present, done.best) for done in search.rounds if done.best != done.present] == [
        ((), ("latent_heat",))
    ]


def test_an_effect_that_is_not_needed_at_the_optimum_without_it_is_not_kept() -> None:
    """The fit without it had ended early."""
    search = hot_weight({"latent_heat.enthalpy": 1.2e4})
    joint, both = search.joint, search.joint.ordered(("latent_heat", "phase_resistance"))
    base = joint.problem.start_values()
    early = np.array(base)
    early[joint.slots["latent_heat.enthalpy"]] = 1.0e4
    search.fitted = {effects: fitted_model(joint, effects, early, both) for effects in ((), ("latent_heat",), both)}
    search.fitted[both] = refined(search, search.fitted[both], NOISE)
    assert search.best(NOISE).effects == both
    assert with_no_effect_too_many(search, search.fitted[both]).effects == ("latent_heat",)
    assert search.winner == ("latent_heat",)
    assert search.rounds[-1].best == ("latent_heat",)


def test_a_set_whose_fits_have_no_number_is_none(monkeypatch: pytest.MonkeyPatch) -> None:
    """The search goes on among the others; it ended in a KeyError."""
    monkeypatch.setattr(
        side_by_side,
        "models_by_program",
        lambda *given: (model for model in models_by_program(*given) if "phase_resistance" not in model.effects),
    )
    search, values, _ = _found({"latent_heat.enthalpy": 1.2e4})
    assert set(values) == {"latent_heat.enthalpy"}
    assert any("phase_resistance" in effects for effects in search.trials)
    assert not any("phase_resistance" in effects for done in search.rounds for effects, _, _ in done.gains)


def test_no_set_has_more_effects_than_a_search_among_them_ends_with(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(subset_evidence, "MOST_EFFECTS", 1)
    search, _, _ = _found({"latent_heat.enthalpy": 1.2e4, "phase_resistance.contrast": -0.2})
    assert {len(effects) for effects in search.fitted} == {0, 1}


@pytest.mark.parametrize(("most_off", "steps"), [(1e3, [1]), (1e-6, [1, 4])])
def test_derivatives_are_the_models_own_where_one_step_a_sample_is_far_off(
    monkeypatch: pytest.MonkeyPatch, most_off: float, steps: list[int]
) -> None:
    search = hot_weight({"latent_heat.enthalpy": 1.2e4})
    problem = with_integration(search.joint.problem, Integration(substeps=4))
    joint = dataclasses.replace(search.joint, problem=problem)
    base = fitted_model(joint, (), problem.start_values(), ())
    taken: dict[int, Any] = {}

    def recorded(problem: Any, *given: Any, **named: Any) -> Any:
        residual, columns = residual_and_columns(problem, *given, **named)
        taken.setdefault(problem.batch.integration.substeps, columns)
        return residual, columns

    monkeypatch.setattr(traces, "residual_and_columns", recorded)
    monkeypatch.setattr(traces, "MOST_OFF", most_off)
    found = traces_at(joint, base, search.extent)
    assert list(taken) == steps
    assert found.columns["recoverable_strain"] is taken[steps[-1]]["recoverable_strain"]


def test_what_has_no_number_is_far_off() -> None:
    assert traces.far_from(np.asarray([np.nan, 1.0]), np.asarray([1.0, 1.0]))
    assert traces.far_from(np.asarray([3.0, 1.0]), np.asarray([1.0, 1.0]))
    assert not traces.far_from(np.asarray([1.5, 1.0]), np.asarray([1.0, 1.0]))


def test_what_a_linear_model_leaves_is_the_residual_of_its_estimate() -> None:
    search = hot_weight({"latent_heat.enthalpy": 1.2e4})
    base = fitted_model(search.joint, (), search.joint.problem.start_values(), ())
    traces = traces_at(search.joint, base, search.extent)
    linear = linear_model(search.joint, traces, NOISE**2, CANDIDATES)
    subset = frozenset({Variant("latent_heat", -1), Variant("phase_resistance", -1)})
    estimate = linear.estimate(subset)
    steps = {**estimate.unknowns, **estimate.coefficients}
    left = traces.residual - sum(traces.columns[name] * step for name, step in steps.items())
    assert linear.rms(subset) == pytest.approx(float(np.sqrt(np.mean(left**2))), rel=1e-6)
    assert linear.rms(subset) < linear.rms(frozenset())


@pytest.mark.slow
def test_two_effects_are_found_together() -> None:
    _, values, errors = _found(
        {"latent_heat.enthalpy": 1.2e4, "sensor_gain.error": 0.05, "phase_resistance.contrast": -0.2}
    )
    assert {"latent_heat.enthalpy", "phase_resistance.contrast"} <= set(values)
    assert values["phase_resistance.contrast"] == pytest.approx(-0.2, abs=5.0 * errors["phase_resistance.contrast"])
    # The gain of the sensor and the recoverable strain, which is unknown, are nearly one.
    assert "rising_convection.slope" not in values


@pytest.mark.parametrize(
    ("side", "limit"),
    [pytest.param("upper", 0.016, marks=pytest.mark.slow), pytest.param("lower", 0.003, marks=pytest.mark.slow)],
)
def test_a_sensor_that_ends_before_the_motion_is_found_with_its_limit(side: str, limit: float) -> None:
    """Of a stroke of 25 mm; the other end, which no reading comes near, stays unused."""
    truth = {f"sensor_limit.{side}_cut": 1.0, f"sensor_limit.{side}": limit}
    search, values, errors = _found(truth, LIMITED)
    assert {name.split(".")[0] for name in values} == {"sensor_limit"}
    assert values[f"sensor_limit.{side}_cut"] == pytest.approx(1.0, abs=0.02)
    assert values[f"sensor_limit.{side}"] == pytest.approx(limit, abs=4.0 * errors[f"sensor_limit.{side}"])
    other = {"upper": "lower", "lower": "upper"}[side]
    assert values[f"sensor_limit.{other}_cut"] < 0.01
    assert search.rounds[-1].present == ("sensor_limit",)


@pytest.mark.slow
def test_a_sensor_that_shows_the_whole_motion_is_given_no_limit() -> None:
    """The wire rests at both ends of its transformation, where readings pile up as at a limit."""
    search, values, _ = _found({}, LIMITED)
    assert values == {}
    reading = search.joint.problem.measured
    assert np.mean(reading > search.extent.highest - 0.1 * search.extent.stroke) > 0.1


@pytest.mark.parametrize("seed", often([1, 2, 3], [1]))
def test_without_a_missing_effect_none_is_named(seed: int) -> None:
    search = hot_weight({}, seed=seed)
    model = search_jointly(search, {(): search.joint.problem.start_values()})
    assert model.effects == ()
    assert search.probabilities(search.error(model))[()] > 0.5


def test_an_effect_that_these_runs_cannot_show_is_not_looked_for() -> None:
    """Where the noise is a million times larger nothing can be shown."""
    search = hot_weight({})
    base = fitted_model(search.joint, (), search.joint.problem.start_values(), ())
    traces = traces_at(search.joint, base, search.extent)
    assert "latent_heat" in detectable(search.joint, traces, NOISE)
    assert detectable(search.joint, traces, 1e6 * NOISE) == ()


def test_free_values_of_presets_hide_no_effect() -> None:
    """Some combinations of them change next to nothing; along these they absorb no more than their priors allow."""
    search = hot_weight({})
    table, values = parameters(search.joint.problem.system), parameter_values(search.joint.problem.system)
    presets = preset_priors(table, values, frozenset())
    joint = JointParameters.of(search.joint.problem, UNKNOWNS, search.joint.bounds, CANDIDATES, search.extent, presets)
    base = fitted_model(joint, (), joint.problem.start_values(), ())
    found = detectable(joint, traces_at(joint, base, search.extent), NOISE)
    assert {"latent_heat", "rising_convection", "asymmetric_transformation"} <= set(found)


@pytest.mark.slow
def test_errors_on_runs_left_out_agree_with_refits() -> None:
    search, _, _ = _found({"latent_heat.enthalpy": 1.2e4})
    joint, model = search.joint, search.fitted[("latent_heat",)]
    approximate = left_out(joint, model, NOISE).misfit
    problem, index = joint.restricted(model.effects)
    keep = 1.0 - np.eye(problem.batch.runs)
    tasks = [problem.task(model.names, joint.bounds, model.values[index], weights) for weights in keep]
    fits = levenberg_marquardt(problem, tasks, FitSettings(max_steps=30, tolerance=1e-10))
    exact = np.stack([one[run] for run, one in enumerate(misfits(problem, [fit.values for fit in fits]))])
    np.testing.assert_allclose(approximate, exact, atol=0.1 * NOISE)


@pytest.mark.parametrize("effect", often(["stribeck_friction", "sensor_backlash"], ["sensor_backlash"]))
def test_fits_of_an_effect_with_several_minima_start_all_over_its_ranges(effect: str) -> None:
    search = hot_weight({}, (effect,))
    base = fitted_model(search.joint, (), search.joint.problem.start_values(), ())
    traces = traces_at(search.joint, base, search.extent)
    linear = linear_model(search.joint, traces, NOISE**2, (effect,))
    subset = frozenset({Variant(effect, -1)})
    points = np.asarray(starts(search.joint, subset, linear, traces))
    assert len(points) > 10
    for name in search.joint.coefficients[effect]:
        values = points[:, search.joint.slots[name]]
        low, high = search.joint.bounds[name]
        assert low <= values.min()
        assert values.max() <= high
    name = search.joint.switches(effect)[0]
    assert np.ptp(points[:, search.joint.slots[name]]) > 0.0


def test_starts_of_a_stribeck_friction_cover_its_sizes_and_speeds() -> None:
    """Jumps make local minima; where nothing is known of the size no start is likelier than another."""
    candidate = LIBRARY["stribeck_friction"].candidate
    ranges = candidate.start_ranges({"limit": 0.05})
    places = logarithmic_points(ranges, PLACES)
    assert set(ranges) == {"limit", "sliding", "speed", "bend"}
    for name, (low, high) in ranges.items():
        share = np.log(np.asarray([place[name] for place in places]) / low) / np.log(high / low)
        # Each quarter of the range, by logarithm, has its part of them.
        np.testing.assert_array_equal(np.histogram(share, bins=4, range=(0.0, 1.0))[0], PLACES // 4)
    assert candidate.start_ranges({"limit": 0.0}) == {}
    assert LIBRARY["latent_heat"].candidate.start_ranges({"enthalpy": 6e3}) == {}


def test_a_friction_in_the_place_of_another_begins_where_that_one_was() -> None:
    frictions = ("coulomb_friction", "stribeck_friction")
    search = hot_weight({}, frictions)
    joint, slots = search.joint, search.joint.slots
    values = joint.problem.start_values()
    values[slots["stribeck_friction.limit"]], values[slots["stribeck_friction.bend"]] = 0.7, 3e-6
    traces = traces_at(joint, fitted_model(joint, frictions[1:], values, frictions[1:]), search.extent)
    linear = linear_model(joint, traces, NOISE**2, frictions)
    coulomb = Variant(frictions[0], -1)
    point = starts(joint, frozenset({coulomb}), linear, traces)[-1]
    assert [point[slots[f"coulomb_friction.{name}"]] for name in ("limit", "bend")] == [0.7, 3e-6]
    assert point[slots["stribeck_friction.limit"]] == 0.0
    # Beside the other it replaces none.
    both = frozenset({coulomb, Variant(frictions[1], -1)})
    assert all(point[slots["coulomb_friction.bend"]] != 3e-6 for point in starts(joint, both, linear, traces))


def test_starts_of_a_backlash_lie_beyond_its_linear_estimate() -> None:
    """The estimate is that of a play taken up at once."""
    ranges = LIBRARY["sensor_backlash"].candidate.start_ranges({"half_width": 0.01})
    sizes = [place["half_width"] for place in logarithmic_points(ranges, 32)]
    assert 0.01 <= min(sizes) < 0.012 < 0.12 < max(sizes) <= 0.16
    assert LIBRARY["sensor_backlash"].candidate.start_ranges({"half_width": 0.0}) == {}


def test_unknowns_of_which_the_runs_show_the_product_alone_end_no_search() -> None:
    """Density and specific heat have one column to rounding."""
    search = hot_weight({"latent_heat.enthalpy": 1.2e4})
    problem, table = search.joint.problem, parameters(search.joint.problem.system)
    both = ("density", "specific_heat")
    bounds = {**search.joint.bounds, **{name: (table[name].low, table[name].high) for name in both}}
    joint = JointParameters.of(problem, both, bounds, CANDIDATES, search.extent)
    base = fitted_model(joint, (), problem.start_values(), ())
    traces = traces_at(joint, base, search.extent)
    found = detectable(joint, traces, NOISE)
    assert "latent_heat" in found
    linear = linear_model(joint, traces, NOISE**2, found)
    assert "latent_heat" in {variant.effect for variant in linear.climb(frozenset())}
    assert all(error > 0.0 for error in base.standard_errors(NOISE**2).values())


@dataclasses.dataclass(frozen=True)
class _Alike:
    """A model that is likelier than its like by `odds` where a sample may be off by what the other leaves."""

    effects: tuple[str, ...]
    rms: float
    odds: float
    width_factors: dict[str, float] = dataclasses.field(default_factory=dict)

    def log_evidence(self, variance: float) -> float:
        return self.odds if abs(variance - self.rms**2) > 1e-9 else 0.0


@dataclasses.dataclass(frozen=True)
class _Nothing:
    width_factors: dict[str, float] = dataclasses.field(default_factory=dict)


def test_two_models_that_are_as_likely_do_not_take_turns(monkeypatch: pytest.MonkeyPatch) -> None:
    """Seen from each the other is the likelier one, by less than a unit: the search ends instead of going from one to the other."""
    one, other = _Alike(("creep",), 1.0, 0.2), _Alike(("slack",), 1.02, 0.2)
    search: Any = JointSearch(*([_Nothing()] * 4))  # type: ignore[arg-type]
    search.settings = FitSettings()
    search.fitted = {one.effects: one, other.effects: other}
    monkeypatch.setattr(fitted_sets, "independent_error", lambda model, *_: model.rms)
    monkeypatch.setattr(joint_search, "grouped_sets", lambda *_: [])
    monkeypatch.setattr(joint_search, "fit_side_by_side", lambda *_, **__: None)
    monkeypatch.setattr(joint_search, "_linear", lambda *_: (None, None))
    monkeypatch.setattr(joint_search, "_several_at_once", lambda *_: None)
    for name in ("_neighbours", "_promising"):
        monkeypatch.setattr(joint_search, name, lambda *_: [])
    joint_search.search_jointly(search, {})
    assert len({done.best for done in search.rounds}) == 1
    assert len(search.rounds) <= 4
