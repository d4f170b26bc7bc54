"""When values of presets, which the experiment file does not give, are free in the search, and which way a fit of an effect begins."""

from __future__ import annotations

import dataclasses

import numpy as np

from smajax.attribution.fitted_sets import JointSearch
from smajax.attribution.freed_presets import freed_at_the_base, nearer_base, needs_presets
from smajax.attribution.joint_parameters import JointParameters
from smajax.attribution.joint_search import search_jointly
from smajax.attribution.laplace_evidence import FittedModel, fitted_model
from smajax.attribution.set_starts import at_usual_size
from smajax.attribution.side_by_side import fitted_from
from smajax.attribution.traces import Variant, traces_at
from smajax.model.effects.prior_width import CoefficientPrior
from tests.helpers.hot_weight import NOISE, UNKNOWNS, hot_weight

LATENT, EXPANSION = ("latent_heat",), "thermal_modulus"


def _searches(factor: float) -> tuple[JointSearch, JointSearch]:
    """(with the thermal modulus held, with it free) in runs of a wire with a latent heat whose thermal modulus is so many times the preset's."""
    held = hot_weight({"latent_heat.enthalpy": 1.2e4}, LATENT, factors={EXPANSION: factor})
    joint = held.joint
    own = float(joint.problem.start_values()[joint.slots[EXPANSION]])
    presets = {EXPANSION: CoefficientPrior(own, 1.1 * abs(own), False)}
    wide = {**joint.bounds, EXPANSION: (-4.0 * abs(own), 4.0 * abs(own))}
    free = JointParameters.of(joint.problem, UNKNOWNS, wide, LATENT, held.extent, presets)
    return held, dataclasses.replace(held, joint=free, fitted={}, trials={})


def _fitted(search: JointSearch, effects: tuple[str, ...]) -> FittedModel:
    start = search.joint.problem.start_values()
    if effects:
        start[search.joint.slots["latent_heat.enthalpy"]] = 1e4
    return fitted_from(search, fitted_model(search.joint, effects, start, effects))


def test_a_search_with_values_of_presets_held_ends_where_these_are_most_of_what_is_missing_beside_an_effect() -> None:
    held, free = _searches(-1.0)
    base, latent = _fitted(held, ()), _fitted(held, LATENT)
    assert not freed_at_the_base(_fitted(free, ()), base)  # without the latent heat it says little
    assert needs_presets(held, free, latent)
    assert held.free_beside == LATENT
    assert latent.rms > 5.0 * NOISE
    assert free.fitted[LATENT].rms < 2.0 * NOISE
    assert not needs_presets(held, free, latent)  # asked once


def test_it_goes_on_where_they_change_little_or_noise_is_left() -> None:
    held, free = _searches(1.0)
    latent = _fitted(held, LATENT)
    assert not needs_presets(held, free, latent)
    assert not free.fitted  # noise is left: it takes no fit to know
    far = dataclasses.replace(latent, rms=2.5 * NOISE, effects=(), values=_fitted(held, ()).values)
    assert not needs_presets(held, free, far)
    assert free.fitted.keys() == {()}
    assert held.free_beside is None


def test_the_search_asks_of_every_model_that_it_goes_on_from() -> None:
    held, _ = _searches(1.0)
    asked: list[tuple[str, ...]] = []

    def needs(found: FittedModel) -> bool:
        asked.append(found.effects)
        return bool(found.effects)

    held.needs_presets = needs
    found = search_jointly(held, {(): held.joint.problem.start_values()})
    assert (asked, found.effects) == ([(), LATENT], LATENT)
    assert len(held.rounds) == 1


def test_a_fit_begins_on_the_usual_side_as_well_where_the_derivative_points_to_the_other() -> None:
    """Other parameters make up for an effect that is not in a fit, and then a small one of the wrong sign may be better than none."""
    search = hot_weight({}, ("elastic_mismatch", "sensor_gain"))
    joint = search.joint
    base = joint.problem.start_values()
    traces = traces_at(joint, fitted_model(joint, (), base, ()), search.extent)
    here = joint.slots["elastic_mismatch.contrast"]
    start = np.array(base)
    for side, sizes in ((-0.1, [-0.5, 0.5]), (0.1, [0.5])):
        start[here] = side
        found = at_usual_size(joint, frozenset({Variant("elastic_mismatch", -1)}), traces, start)
        assert [one[here] for one in found] == sizes
        for one in found:
            np.testing.assert_array_equal(np.delete(one, here), np.delete(base, here))
    # There the unknowns begin where they were.
    strain = joint.slots["recoverable_strain"]
    start[[here, strain]] = -0.1, 1.1 * base[strain]
    found = at_usual_size(joint, frozenset({Variant("elastic_mismatch", -1)}), traces, start)
    assert [one[strain] / base[strain] for one in found] == [1.1, 1.0]
    # An effect that may as well be of either sign has no usual side.
    gain = joint.slots["sensor_gain.error"]
    start[gain] = -0.01
    (one,) = at_usual_size(joint, frozenset({Variant("sensor_gain", -1)}), traces, start)
    assert one[gain] < 0.0


def test_the_base_model_goes_on_from_where_less_is_left() -> None:
    held, _ = _searches(1.0)
    fitted, start = _fitted(held, ()).values, held.joint.problem.start_values()
    assert nearer_base(held.joint, fitted, start) is fitted
    assert nearer_base(held.joint, start, fitted) is fitted
