"""An effect that says what free parameters of the base model say is not looked for."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping

import pytest

from smajax.attribution.joint_parameters import JointParameters
from smajax.attribution.same_as_parameters import said_by_parameters
from smajax.core.parameters import parameter_values, parameters
from smajax.fit.identifiability import Checks, Identifiability
from smajax.model.effects.library import LIBRARY
from smajax.model.effects.prior_width import CoefficientPrior
from smajax.report.identifiability_words import check_sentences
from tests.helpers.hot_weight import UNKNOWNS, hot_weight

SLOPES = ("stress_slope_austenite", "stress_slope_martensite")
AUSTENITE = "resistivity_austenite"
CANDIDATES = ("latent_heat", "phase_resistance", "unequal_stress_slopes")


def _joint(unknowns: tuple[str, ...], presets: Mapping[str, float]) -> JointParameters:
    """`presets`: relative widths of values that are free."""
    search = hot_weight({}, CANDIDATES)
    problem = search.joint.problem
    table, values = parameters(problem.system), parameter_values(problem.system)
    bounds = {**{name: (table[name].low, table[name].high) for name in (*SLOPES, AUSTENITE)}, **search.joint.bounds}
    priors = {name: CoefficientPrior(float(values[name]), sigma, True) for name, sigma in presets.items()}
    return JointParameters.of(problem, unknowns, bounds, CANDIDATES, search.extent, priors)


@pytest.mark.parametrize(
    ("unknowns", "presets", "said"),
    [
        pytest.param(SLOPES, {}, {"unequal_stress_slopes"}, id="both slopes are unknowns"),
        pytest.param((), dict.fromkeys(SLOPES, 0.2), {"unequal_stress_slopes"}, id="both are values of the preset"),
        pytest.param(SLOPES[:1], {SLOPES[1]: 0.2}, {"unequal_stress_slopes"}, id="one of each"),
        pytest.param((), {SLOPES[1]: 0.2}, set(), id="one is given"),
        pytest.param((), dict.fromkeys(SLOPES, 0.05), set(), id="both were measured to 5 %"),
        pytest.param((), {AUSTENITE: 0.1}, {"phase_resistance"}, id="austenite's resistivity is the preset's"),
        pytest.param((), {AUSTENITE: 0.03}, set(), id="it was measured"),
        pytest.param((), {}, set(), id="all are given"),
    ],
)
def test_parameters_that_are_free_say_all_that_these_effects_do(
    unknowns: tuple[str, ...], presets: dict[str, float], said: set[str]
) -> None:
    assert said_by_parameters(_joint((*UNKNOWNS, *unknowns), presets)) == said


def test_an_unknown_within_narrow_bounds_says_less_than_the_effect() -> None:
    joint = _joint((*UNKNOWNS, *SLOPES), {})
    values = parameter_values(joint.problem.system)
    narrow = {name: (0.98 * float(values[name]), 1.02 * float(values[name])) for name in SLOPES}
    assert said_by_parameters(dataclasses.replace(joint, bounds={**joint.bounds, **narrow})) == frozenset()


def test_what_says_the_same_names_parameters_of_a_wire() -> None:
    known = parameters(hot_weight({}, ()).joint.problem.system)
    assert all(set(effect.candidate.same_as) <= set(known) for effect in LIBRARY.values())


def test_the_check_says_what_is_not_looked_for_and_why() -> None:
    (*_, said) = check_sentences((), Checks(Identifiability((), 0, 0), said_by_parameters=("unequal_stress_slopes",)))
    assert said == (
        "Unequal stress slopes: not named in the end, because the search fits stress_slope_austenite and stress_slope_martensite, which say the same."
    )
