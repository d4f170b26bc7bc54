"""Prior widths in the search: an effect far larger than usual is found, and costs what so wide a prior costs."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
import pytest

from smajax.attribution import fits_alone, side_by_side
from smajax.attribution.fitted_sets import JointSearch
from smajax.attribution.joint_search import search_jointly
from smajax.attribution.laplace_evidence import fitted_model
from smajax.attribution.program_fits import MOST_WIDENED, BegunFit, comparison_settings, models_by_program
from smajax.attribution.set_starts import MOST_START
from smajax.attribution.subset_evidence import likeliest_width, linear_model
from smajax.attribution.traces import Variant, traces_at
from smajax.fit.levenberg_marquardt import FitSettings
from tests.helpers.hot_weight import CANDIDATES, NOISE, hot_weight


def _with_narrow_priors(search: JointSearch, narrower: float) -> JointSearch:
    """The same search where latent heats are usually so many times smaller."""
    name = "latent_heat.enthalpy"
    prior = search.joint.priors[name]
    priors = {**search.joint.priors, name: prior._replace(sigma=prior.sigma / narrower)}
    return dataclasses.replace(search, joint=dataclasses.replace(search.joint, priors=priors))


@pytest.mark.parametrize("widened", [True, False])
def test_an_effect_far_larger_than_usual_is_fitted_where_a_sample_says_little(widened: bool) -> None:
    """It lies 40 widths of its prior off. The prior of that width would hold it next to nothing."""
    size = 1.2e4
    search = hot_weight({"latent_heat.enthalpy": size})
    joint = _with_narrow_priors(search, 40.0 * search.joint.priors["latent_heat.enthalpy"].sigma / size).joint
    base = joint.problem.start_values()
    begun = [(("latent_heat",), [BegunFit(("latent_heat",), base)])]
    settings = comparison_settings(FitSettings(), "fitting")
    error = 40.0 * NOISE
    models = list(models_by_program(joint, begun, error, settings, MOST_WIDENED if widened else 0))
    found = models[-1].values[joint.slots["latent_heat.enthalpy"]]
    if widened:
        assert found == pytest.approx(size, rel=0.1)
        assert models[-1].width_factors["latent_heat"] == pytest.approx(40.0, rel=0.1)
        evidence = [one.log_evidence(error**2) for one in models]
        assert evidence == sorted(evidence)
    else:
        assert found < 0.5 * size


def test_the_linear_model_widens_the_priors_of_an_effect_that_is_far_larger_than_usual() -> None:
    search = hot_weight({"latent_heat.enthalpy": 1.2e4})
    narrow, narrower = (_with_narrow_priors(search, times) for times in (16.0, 64.0))
    base = fitted_model(search.joint, (), search.joint.problem.start_values(), ())
    traces = traces_at(search.joint, base, search.extent)
    models = [linear_model(one.joint, traces, NOISE**2, CANDIDATES) for one in (search, narrow, narrower)]
    assert [one.width_factors["latent_heat"] for one in models] == [1.0, 4.0, 16.0]
    subset = frozenset({Variant("latent_heat", -1)})
    sizes = [one.estimate(subset).coefficients["latent_heat.enthalpy"] for one in models]
    assert sizes == pytest.approx([sizes[0]] * 3, rel=0.01)
    # What it costs is the prior of the width.
    cost = models[1].log_evidence(subset) - models[2].log_evidence(subset)
    assert cost == pytest.approx(2.0 * np.log(4.0), abs=0.1)


def test_a_search_that_goes_on_from_an_effect_far_larger_than_usual_keeps_it() -> None:
    """Its fit begins with the widths that it was found with."""
    size = 1.2e4
    search = hot_weight({"latent_heat.enthalpy": size})
    narrow = _with_narrow_priors(search, 40.0 * search.joint.priors["latent_heat.enthalpy"].sigma / size)
    narrow.noise = 40.0 * NOISE
    base, slots = narrow.joint.problem.start_values(), narrow.joint.slots
    base[slots["convection_coefficient"]] *= 1.1
    with_it = np.array(base)
    with_it[slots["latent_heat.enthalpy"]] = size
    found = search_jointly(narrow, {(): base, ("latent_heat",): with_it})
    assert found.effects == ("latent_heat",)
    assert found.values[slots["latent_heat.enthalpy"]] == pytest.approx(size, rel=0.1)


def test_fits_of_a_round_begin_with_the_widths_of_the_linear_model(monkeypatch: pytest.MonkeyPatch) -> None:
    """And as far from the base value as these allow."""
    begun: list[BegunFit] = []

    def recorded(joint: Any, groups: Any, *given: Any) -> Any:
        begun.extend(one for _, its_sets in groups for one in its_sets)
        return models_by_program(joint, groups, *given)

    monkeypatch.setattr(side_by_side, "models_by_program", recorded)
    search = _with_narrow_priors(hot_weight({"latent_heat.enthalpy": 1.2e4}), 64.0)
    search_jointly(search, {(): search.joint.problem.start_values()})
    fits = [one for one in begun if one.effects == ("latent_heat",)]
    assert fits[0].width_factors["latent_heat"] == 16.0
    name = "latent_heat.enthalpy"
    assert fits[0].values[search.joint.slots[name]] > 2.0 * MOST_START * search.joint.priors[name].sigma


def test_where_unknowns_are_not_told_apart_no_width_is_chosen(monkeypatch: pytest.MonkeyPatch) -> None:
    def not_definite(_: np.ndarray) -> None:
        raise np.linalg.LinAlgError

    search = hot_weight({"latent_heat.enthalpy": 1.2e4})
    base = fitted_model(search.joint, (), search.joint.problem.start_values(), ())
    traces = traces_at(search.joint, base, search.extent)
    monkeypatch.setattr("scipy.linalg.cho_factor", not_definite)
    assert linear_model(search.joint, traces, NOISE**2, CANDIDATES).width_factors == {}


def test_one_effect_alone_is_fitted_to_its_end_beside_many_that_leave_more() -> None:
    search = hot_weight({"latent_heat.enthalpy": 1.2e4})
    others = search.joint.ordered(("rising_convection", "phase_resistance", "sensor_gain"))
    base = search.joint.problem.start_values()
    begun = [(others, [BegunFit((), base), BegunFit(others, base)])]
    for model in models_by_program(search.joint, begun, NOISE, comparison_settings(FitSettings(), "fitting"), 0):
        search.fitted[model.effects] = model
    search.detectable = CANDIDATES
    alone = fits_alone.likeliest_alone(search, CANDIDATES, search.fitted[others])
    (heat,) = [model for model in alone if model.effects == ("latent_heat",)]
    assert heat.rms < 1.05 * NOISE < search.fitted[others].rms
    assert heat.values[search.joint.slots["latent_heat.enthalpy"]] == pytest.approx(1.2e4, rel=0.02)


@pytest.mark.parametrize(
    ("gram", "right", "one_sided", "width"),
    [
        (4.0, 4.0, False, 1.0),  # one width off
        (4.0, 80.0, False, 16.0),  # twenty widths off
        (1e-3, 0.02, False, 1.0),  # as far off, of which the runs say nothing
        (4.0, -80.0, False, 16.0),
        (4.0, -80.0, True, 1.0),  # where it cannot be
    ],
)
def test_the_likeliest_width_of_one_coefficient(gram: float, right: float, one_sided: bool, width: float) -> None:
    found, _ = likeliest_width(np.asarray([[gram]]), np.asarray([right]), np.asarray([one_sided]))
    assert found == width
