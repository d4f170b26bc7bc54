"""Traces of candidate effects: places of one effect are one effect."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from smajax.attribution import joint_search
from smajax.attribution.joint_search import REPLACED, _effects, _neighbours
from smajax.attribution.laplace_evidence import fitted_model
from smajax.attribution.subset_evidence import linear_model
from smajax.attribution.traces import traces_at
from tests.helpers.hot_weight import NOISE, hot_weight


def test_places_of_an_effect_take_no_other_effects_place_among_those_that_are_fitted() -> None:
    """A creep is looked at at three time constants beside its own: likelier than any play, it is fitted at one of them."""
    names = ("creep", "sensor_backlash", "latent_heat", "sensor_gain")
    search = hot_weight({"creep.martensite": 5e-11}, names)
    values = search.joint.problem.start_values()
    present = fitted_model(search.joint, ("latent_heat",), values, ("latent_heat",))
    linear = linear_model(search.joint, traces_at(search.joint, present, search.extent), NOISE**2, names)
    assert sum(one.effect == "creep" for one in linear.places) == 4
    near = [frozenset(_effects(search, one)) for one in _neighbours(search, linear, present, 10.0 * NOISE)]
    assert len(near) == len(set(near))
    assert len([one for one in near if len(one) == 1]) == REPLACED  # each in the place of the latent heat
    assert frozenset({"creep"}) in near
    assert {frozenset({"latent_heat", "creep"}), frozenset({"latent_heat", "sensor_backlash"})} <= set(near)


def test_beside_a_model_that_does_not_move_as_the_runs_do_every_effect_is_fitted(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """A wire that a draught kept from transforming: of nearly a hundred noises the linear model preferred what twelve others do, and the draught was in none of the fits."""
    monkeypatch.setattr(joint_search, "NEIGHBOURS", 1)
    names = ("creep", "sensor_backlash", "latent_heat", "sensor_gain", "draught")
    search = hot_weight({"creep.martensite": 5e-11}, names)
    present = fitted_model(search.joint, (), search.joint.problem.start_values(), ())
    linear = linear_model(search.joint, traces_at(search.joint, present, search.extent), (100.0 * NOISE) ** 2, names)

    def near(rms: float) -> set[tuple[str, ...]]:
        far = dataclasses.replace(present, rms=rms)
        return {_effects(search, one) for one in _neighbours(search, linear, far, 100.0 * NOISE)}

    assert len(near(0.05 * search.extent.stroke)) == 1
    assert near(0.2 * search.extent.stroke) == {(name,) for name in names}


def test_a_program_that_carries_what_is_in_the_base_model_since_is_of_the_others() -> None:
    """An input that one search called wrong is corrected for the next one, whose candidate it is no longer."""
    names = ("creep", "latent_heat")
    search = hot_weight({"creep.martensite": 5e-11}, names)
    values = search.joint.problem.start_values()
    present = fitted_model(search.joint, ("latent_heat",), values, ("latent_heat",))
    plain = traces_at(search.joint, present, search.extent)
    later = traces_at(search.joint, present, search.extent, compiled=(("input_clock", "creep", "latent_heat"),))
    assert set(later.columns) == set(plain.columns)
    np.testing.assert_allclose(later.residual, plain.residual)
