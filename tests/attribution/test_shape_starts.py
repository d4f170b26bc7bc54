"""Where fits with a new shape of the transformation begin."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from scipy.optimize import brentq

from smajax.attribution import joint_search
from smajax.attribution.fitted_sets import JointSearch
from smajax.attribution.joint_parameters import JointParameters
from smajax.attribution.laplace_evidence import fitted_model
from smajax.attribution.shape_starts import COOLING, HEATING, at_every_place, keeping_the_range
from smajax.attribution.traces import Variant, traces_at
from tests.helpers.hot_weight import UNKNOWNS, hot_weight

NEW, BESIDE = "two_step_transformation", "radiation"
TEMPERATURES = (*HEATING, *COOLING)
BOUNDS = {
    "austenite_start": (40.0, 110.0),
    "austenite_finish": (50.0, 120.0),
    "martensite_finish": (10.0, 70.0),
    "martensite_start": (30.0, 90.0),
}


@pytest.fixture(scope="module")
def search() -> JointSearch:
    own = hot_weight({}, (NEW, "smooth_transformation", BESIDE))
    joint = own.joint
    wide = JointParameters.of(
        joint.problem, (*UNKNOWNS, *TEMPERATURES), {**joint.bounds, **BOUNDS}, tuple(joint.coefficients), own.extent
    )
    return dataclasses.replace(own, joint=wide)


def cosine(z: float) -> float:
    return 0.5 * (1.0 + np.cos(np.pi * min(max(z, 0.0), 1.0)))


def reached(left: float, start: float, finish: float, weight: float, shift: float, width: float) -> float:
    """Temperature at which this share is yet to transform, written out."""

    def over(at: float) -> float:
        z = (at - start) / (finish - start)
        return (1.0 - weight) * cosine(z) + weight * cosine((z - 0.5 - shift) / width + 0.5) - left

    return float(brentq(over, start - 200.0, finish + 200.0))


def test_nine_tenths_and_one_tenth_are_reached_where_they_were_before(search: JointSearch) -> None:
    joint, slots = search.joint, search.joint.slots
    before = joint.problem.start_values()
    values = np.array(before)
    given = {"heating_weight": 0.4, "cooling_weight": 0.3, "heating_shift": 0.8, "cooling_shift": 1.1, "width": 0.8}
    for name, value in given.items():
        values[slots[f"{NEW}.{name}"]] = value
    problem, index = joint.restricted((NEW, BESIDE))
    kept = keeping_the_range(joint, problem, index, before, values)
    (a, b), (c, d) = ([kept[slots[name]] for name in names] for names in (HEATING, COOLING))
    (e, f), (g, h) = ([before[slots[name]] for name in names] for names in (HEATING, COOLING))
    assert b - a < 0.7 * (f - e)  # of a shape that is wider in ranges
    for left in (0.9, 0.1):
        assert reached(left, a, b, 0.4, 0.8, 0.8) == pytest.approx(reached(left, e, f, 0.0, 0.0, 1.0), abs=0.05)
        # On cooling z is 1 at the start, and the shift is counted towards it.
        cooled = reached(left, -d, -c, 0.3, -1.1, 0.8)
        assert cooled == pytest.approx(reached(left, -h, -g, 0.0, 0.0, 1.0), abs=0.05)
    others = [k for name, k in slots.items() if name not in TEMPERATURES]
    np.testing.assert_array_equal(kept[others], values[others])


def test_temperatures_stay_off_their_bounds_and_known_ones_where_they_are(search: JointSearch) -> None:
    joint, slots = search.joint, search.joint.slots
    before, values = joint.problem.start_values(), joint.problem.start_values()
    values[slots[f"{NEW}.heating_weight"]], values[slots[f"{NEW}.heating_shift"]] = 0.6, 3.0
    problem, index = joint.restricted((NEW, BESIDE))
    tight = {**joint.bounds, "austenite_finish": (float(before[slots["austenite_finish"]]) - 1.0, 200.0)}
    held = keeping_the_range(dataclasses.replace(joint, bounds=tight), problem, index, before, values)
    assert tight["austenite_finish"][0] < held[slots["austenite_finish"]] < before[slots["austenite_finish"]]
    some = dataclasses.replace(joint, unknowns=(*UNKNOWNS, *HEATING))
    np.testing.assert_array_equal(keeping_the_range(some, problem, index, before, values), values)


def test_a_new_shape_begins_at_each_of_its_places_at_its_usual_size(search: JointSearch) -> None:
    joint, slots = search.joint, search.joint.slots
    here = joint.problem.start_values()
    here[slots[f"{BESIDE}.emissivity"]], here[slots[UNKNOWNS[0]]] = 0.4, 150.0
    traces = traces_at(joint, fitted_model(joint, (BESIDE,), here, (NEW, BESIDE)), search.extent)
    start = np.array(here)
    start[slots[UNKNOWNS[0]]] = 170.0  # moved along what the linear model says

    def points(*effects: str) -> list[np.ndarray]:
        subset = frozenset(Variant(effect, -1) for effect in effects)
        return list(at_every_place(joint, subset, traces, start))

    shifts = [slots[f"{NEW}.{name}"] for name in ("heating_shift", "cooling_shift")]
    found = points(BESIDE, NEW)
    assert sorted(tuple(one[shifts]) for one in found) == [(-1.0, -1.0), (-1.0, 1.0), (1.0, -1.0), (1.0, 1.0)]
    for one in found:
        assert one[slots[f"{NEW}.heating_weight"]] == one[slots[f"{NEW}.cooling_weight"]] == 0.15
        assert one[slots[UNKNOWNS[0]]] == 150.0
        assert one[slots[f"{BESIDE}.emissivity"]] == 0.4
    assert points(BESIDE) == []
    assert points(BESIDE, "smooth_transformation") == []  # which has no places


def test_the_range_of_a_shape_that_goes_is_kept(search: JointSearch) -> None:
    """A program of the new set alone does not have it."""
    old, candidates = "smooth_transformation", (NEW, "smooth_transformation")
    joint, slots = search.joint, search.joint.slots
    here = joint.problem.start_values()
    here[slots[f"{old}.weight"]] = 0.6
    traces = traces_at(joint, fitted_model(joint, (old,), here, candidates), search.extent)
    several = list(at_every_place(joint, frozenset({Variant(NEW, -1)}), traces, here))
    assert len(several) == 4
    wide, narrow = joint.restricted(candidates), joint.restricted((NEW,))
    for one in several:
        own = np.array(one)
        own[[slots[name] for name in TEMPERATURES]] = here[[slots[name] for name in TEMPERATURES]]
        np.testing.assert_array_equal(one, keeping_the_range(joint, *wide, here, own))
        assert (one != keeping_the_range(joint, *narrow, here, own)).any()


def test_a_range_of_nothing_and_one_beyond_the_grid_stay(search: JointSearch) -> None:
    joint, slots = search.joint, search.joint.slots
    before, values = joint.problem.start_values(), joint.problem.start_values()
    problem, index = joint.restricted((NEW, BESIDE))
    before[slots["austenite_finish"]] = before[slots["austenite_start"]]
    values[slots[f"{NEW}.cooling_weight"]], values[slots[f"{NEW}.width"]] = 0.8, 25.0
    np.testing.assert_array_equal(keeping_the_range(joint, problem, index, before, values), values)


@pytest.mark.parametrize("far_off", [True, False])
def test_fits_of_a_set_begin_there_where_the_present_model_is_far_off_and_as_fitted_before(
    search: JointSearch, far_off: bool
) -> None:
    old, candidates = "smooth_transformation", (NEW, "smooth_transformation", BESIDE)
    joint, slots = search.joint, search.joint.slots
    here, there = joint.problem.start_values(), joint.problem.start_values()
    here[slots[f"{BESIDE}.emissivity"]] = size = 0.4 if far_off else 1e-6
    there[slots[f"{NEW}.heating_weight"]] = 0.6
    present = fitted_model(joint, (old, BESIDE), here, candidates)
    alone = fitted_model(joint, (NEW,), there, candidates)
    own = dataclasses.replace(search, fitted={present.effects: present, alone.effects: alone}, detectable=candidates)
    error = own.error(present)
    assert (error > 2.0 * own.noise) == far_off
    linear, traces = joint_search._linear(own, present, error)
    subset = frozenset({Variant(NEW, -1), Variant(BESIDE, -1)})
    begun = joint_search._begun(own, [subset], linear, traces, error)
    assert {one.effects for one in begun} == {joint.ordered((NEW, BESIDE))}
    shifts = [slots[f"{NEW}.{name}"] for name in ("heating_shift", "cooling_shift")]
    at = [tuple(one.values[shifts]) for one in begun if one.values[slots[f"{NEW}.heating_weight"]] == 0.15]
    places = {(-1.0, -1.0), (-1.0, 1.0), (1.0, -1.0), (1.0, 1.0)}
    assert (places <= set(at)) == far_off
    before = [one.values for one in begun if one.values[slots[f"{NEW}.heating_weight"]] == 0.6]
    (found,) = before
    np.testing.assert_array_equal(
        found[[slots[name] for name in TEMPERATURES]], there[[slots[name] for name in TEMPERATURES]]
    )
    assert found[slots[f"{BESIDE}.emissivity"]] == size
