"""Effects that describe the same in other ways: no model has two, each is tried in the place of another, and a shape keeps its priors."""

from __future__ import annotations

import numpy as np
import pytest

from smajax.attribution import joint_search, traces
from smajax.attribution.exclusive_effects import exclude_each_other, in_another_way, replaceable
from smajax.attribution.fitted_sets import JointSearch
from smajax.attribution.laplace_evidence import FittedModel, fitted_model
from smajax.attribution.model_fits import Search
from smajax.attribution.subset_evidence import LinearModel, linear_model
from smajax.attribution.traces import Traces, Variant, traces_at
from smajax.core.result_cache import ResultCache
from smajax.data.model_catalogue import candidates
from smajax.model.effects.library import LIBRARY
from smajax.model.extended import extended
from smajax.model.presets import build
from tests.helpers.hot_weight import NOISE, UNKNOWNS, hot_weight

SHAPES = ("transformation_curve", "smooth_transformation", "asymmetric_transformation", "two_part_transformation")
AMONG = ("latent_heat", *SHAPES)


@pytest.fixture(scope="module")
def search() -> JointSearch:
    return hot_weight({"asymmetric_transformation.heating": 0.6, "asymmetric_transformation.cooling": 0.4}, AMONG)


def _linear(search: JointSearch, effects: tuple[str, ...]) -> tuple[FittedModel, LinearModel, Traces]:
    model = fitted_model(search.joint, effects, search.joint.problem.start_values(), effects)
    found = traces_at(search.joint, model, search.extent)
    return model, linear_model(search.joint, found, (2.0 * NOISE) ** 2, AMONG), found


def test_two_of_a_group_are_impossible_together(search: JointSearch) -> None:
    _, linear, _ = _linear(search, ())
    curve, smooth, latent = (
        Variant(name, -1) for name in ("transformation_curve", "smooth_transformation", "latent_heat")
    )
    assert exclude_each_other({"transformation_curve", "smooth_transformation"})
    assert not exclude_each_other({"transformation_curve", "latent_heat"})
    assert linear.log_evidence(frozenset({curve, smooth})) == -np.inf
    assert np.isfinite(linear.log_evidence(frozenset({curve, latent})))
    found = linear.climb(frozenset())
    assert found
    assert not exclude_each_other({one.effect for one in found})


def test_every_other_of_the_group_is_tried_in_the_place_of_one_whatever_the_linear_model_says(
    search: JointSearch, monkeypatch: pytest.MonkeyPatch
) -> None:
    present, linear, _ = _linear(search, ("smooth_transformation",))
    monkeypatch.setattr(joint_search, "CERTAIN", -np.inf)  # it offers none
    near = {joint_search._effects(search, one) for one in joint_search._neighbours(search, linear, present, NOISE)}
    assert near == {(name,) for name in SHAPES if name != "smooth_transformation"}
    beside, linear, _ = _linear(search, ("latent_heat", "smooth_transformation"))
    sets = joint_search._neighbours(search, linear, beside, NOISE)
    assert sets
    assert not any(exclude_each_other([each.effect for each in one]) for one in sets)


def test_what_looks_much_the_same_in_a_log_is_tried_in_its_place_and_does_not_exclude_it(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    assert replaceable("input_delay", "sensor_lag")
    assert replaceable("smooth_transformation", "transformation_curve")
    assert not replaceable("latent_heat", "sensor_lag")
    assert not replaceable("latent_heat", "creep")  # neither is of a group
    assert not exclude_each_other({"input_delay", "sensor_lag"})
    among = ("latent_heat", "sensor_lag", "input_delay")
    search = hot_weight({"sensor_lag.time_constant": 0.3}, among)
    values = search.joint.problem.start_values()
    values[search.joint.slots["sensor_lag.time_constant"]] = 0.3
    present = fitted_model(search.joint, ("sensor_lag",), values, ("sensor_lag",))
    linear = linear_model(search.joint, traces_at(search.joint, present, search.extent), NOISE**2, among)
    monkeypatch.setattr(joint_search, "CERTAIN", -np.inf)  # the linear model offers none
    near = {joint_search._effects(search, one) for one in joint_search._neighbours(search, linear, present, NOISE)}
    assert near == {("input_delay",)}


def test_traces_are_the_same_in_one_program_and_in_several(
    search: JointSearch, monkeypatch: pytest.MonkeyPatch
) -> None:
    _, _, several = _linear(search, ("latent_heat",))
    assert len(traces.by_program((*SHAPES, "sensor_gain"))) == 2
    monkeypatch.setattr(traces, "by_program", lambda effects, *_: [list(effects)])
    _, _, one = _linear(search, ("latent_heat",))
    assert several.columns.keys() == one.columns.keys()
    for name, column in one.columns.items():
        # In one program all others are switched on by next to nothing.
        np.testing.assert_allclose(several.columns[name], column, atol=2e-3 * np.abs(column).max())


def test_programs_of_what_is_not_looked_for_leave_those_of_the_search_alone() -> None:
    effects = ("latent_heat", "smooth_transformation", "radiation", "asymmetric_transformation")
    looked_for = ("latent_heat", "smooth_transformation")
    assert traces.by_program(effects, looked_for) == [
        ["latent_heat"],
        ["smooth_transformation"],
        ["radiation", "asymmetric_transformation"],
    ]
    assert traces.by_program(()) == [[]]


def test_what_shifts_an_input_has_a_program_of_its_own_where_runs_are_long() -> None:
    effects = ("input_delay", "input_clock", "latent_heat", "smooth_transformation")
    assert traces.by_program(effects) == [list(effects[:3]), ["smooth_transformation"]]
    several = [["latent_heat"], ["smooth_transformation"], ["input_delay", "input_clock"]]
    assert traces.by_program(effects, None, 10_000) == several


def test_none_of_a_group_that_the_base_model_has_one_of_is_a_candidate() -> None:
    base = build("flexinol_table_3_2", "dead_weight", "voltage")
    assert set(SHAPES) <= set(candidates(base, None, ()))
    knowing = extended(base, ("smooth_transformation",), {})
    left = candidates(knowing, None, ("smooth_transformation",))
    assert "latent_heat" in left
    assert not any(LIBRARY[name].candidate.exclusive_group for name in left)


def test_a_shape_keeps_its_priors_in_the_fit_that_is_reported_and_others_do_not(search: JointSearch) -> None:
    joint = search.joint
    setting = Search(joint.problem, UNKNOWNS, joint.bounds, AMONG, ResultCache())
    records = setting.prior_records(
        presets=False, level=2.0, effects=AMONG, width_factors={"transformation_curve": 1.5}
    )
    assert set(records) == set(joint.coefficients["transformation_curve"])
    own = joint.priors["transformation_curve.heating_start_outer"]
    record = records["transformation_curve.heating_start_outer"]
    assert record.sigma == pytest.approx(own.sigma * 1.5 / 2.0)
    assert record.mean == own.base


def test_a_model_as_likely_with_another_shape_is_searched_around_as_well(search: JointSearch) -> None:
    values = search.joint.problem.start_values()
    one, other = (fitted_model(search.joint, (name,), values, (name,)) for name in ("smooth_transformation", SHAPES[2]))
    latent = fitted_model(search.joint, ("latent_heat",), values, ("latent_heat",))
    ahead = one.log_evidence(NOISE**2) - other.log_evidence(NOISE**2)
    known = {one.effects}
    assert in_another_way([one, other, latent], one, known, NOISE, ahead + 0.1) is other
    assert in_another_way([one, other, latent], one, known, NOISE, ahead - 0.1) is None
    assert in_another_way([one, other, latent], one, {one.effects, other.effects}, NOISE, 1e9) is None
    assert in_another_way([one, other, latent], latent, {()}, NOISE, 1e9) is None


def test_each_shape_is_searched_around_once(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(joint_search, "SETTLED_ODDS", 1e9)  # all are as likely
    search = hot_weight({"asymmetric_transformation.heating": 0.6, "asymmetric_transformation.cooling": 0.4}, AMONG[:4])
    model = joint_search.search_jointly(search, {(): search.joint.problem.start_values()})
    assert len(search.rounds) < joint_search.MOST_ROUNDS
    best = max(search.fitted.values(), key=lambda one: one.log_evidence(search.error(model) ** 2))
    assert model.effects == best.effects
    assert search.joint.width_factors == model.width_factors
