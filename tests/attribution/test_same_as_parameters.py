"""An effect that says what free parameters of the base model say is not looked for."""

from __future__ import annotations

from collections.abc import Mapping

import pytest

from smajax.attribution.joint_parameters import JointParameters
from smajax.attribution.same_as_parameters import said_by_parameters
from smajax.core.parameters import parameter_values, parameters
from smajax.model.effects.library import LIBRARY
from smajax.model.effects.prior_width import CoefficientPrior
from tests.helpers.hot_weight import UNKNOWNS, hot_weight

SLOPES = ("stress_slope_austenite", "stress_slope_martensite")
CANDIDATES = ("latent_heat", "unequal_stress_slopes")


def _joint(unknowns: tuple[str, ...], presets: Mapping[str, float]) -> JointParameters:
    """`presets`: relative widths of values that are free."""
    search = hot_weight({}, CANDIDATES)
    problem = search.joint.problem
    table, values = parameters(problem.system), parameter_values(problem.system)
    bounds = {**{name: (table[name].low, table[name].high) for name in SLOPES}, **search.joint.bounds}
    priors = {name: CoefficientPrior(float(values[name]), sigma, True) for name, sigma in presets.items()}
    return JointParameters.of(problem, unknowns, bounds, CANDIDATES, search.extent, priors)


@pytest.mark.parametrize(
    ("unknowns", "presets", "said"),
    [
        pytest.param((*UNKNOWNS, *SLOPES), {}, True, id="both are unknowns"),
        pytest.param(UNKNOWNS, dict.fromkeys(SLOPES, 0.2), True, id="both are values of the preset"),
        pytest.param((*UNKNOWNS, SLOPES[0]), {SLOPES[1]: 0.2}, True, id="one of each"),
        pytest.param(UNKNOWNS, {SLOPES[1]: 0.2}, False, id="one is given"),
        pytest.param(UNKNOWNS, dict.fromkeys(SLOPES, 0.05), False, id="both were measured to 5 %"),
        pytest.param(UNKNOWNS, {}, False, id="both are given"),
    ],
)
def test_slopes_that_are_free_say_all_that_unequal_slopes_do(
    unknowns: tuple[str, ...], presets: dict[str, float], said: bool
) -> None:
    joint = _joint(unknowns, presets)
    assert said_by_parameters(joint) == (frozenset({"unequal_stress_slopes"}) if said else frozenset())


def test_what_says_the_same_names_parameters_of_a_wire() -> None:
    known = parameters(hot_weight({}, ()).joint.problem.system)
    assert all(set(effect.candidate.same_as) <= set(known) for effect in LIBRARY.values())
