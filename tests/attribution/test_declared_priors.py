"""Priors of the experiment file stand in the place of the library's: in the evidence, in fits and their cache, in the findings."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pytest

from smajax.attribution.declared_priors import overridden
from smajax.attribution.fitted_sets import JointSearch
from smajax.attribution.joint_parameters import JointParameters
from smajax.attribution.joint_search import search_jointly
from smajax.core.parameters import parameter_values, parameters
from smajax.core.result_cache import ResultCache
from smajax.data.experiment.record import DeclaredPriors, PriorSpread
from smajax.fit.preset_priors import RELATIVE, preset_bounds, preset_priors
from smajax.model.effects.prior_width import CoefficientPrior
from smajax.model.presets import build
from tests.helpers.hot_weight import CANDIDATES, UNKNOWNS, hot_weight
from tests.helpers.small_bench import bench, smajax

NARROW = DeclaredPriors({"latent_heat": 0.5}, {"latent_heat.enthalpy": PriorSpread(None, 5e3, False)})


def _joint(search: JointSearch, declared: DeclaredPriors) -> JointParameters:
    own = search.joint
    return JointParameters.of(own.problem, UNKNOWNS, own.bounds, CANDIDATES, search.extent, declared=declared)


def test_odds_and_widths_of_the_file_go_before_those_of_the_effects() -> None:
    search = hot_weight({})
    ours, library = _joint(search, NARROW), search.joint
    assert ours.log_odds["latent_heat"] == pytest.approx(math.log(0.5))
    assert ours.priors["latent_heat.enthalpy"] == CoefficientPrior(0.0, 5e3, False)
    assert library.priors["latent_heat.enthalpy"].sigma != 5e3
    rest = [name for name in library.priors if not name.startswith("latent_heat.")]
    assert [ours.priors[name] for name in rest] == [library.priors[name] for name in rest]
    assert [ours.log_odds[name] for name in CANDIDATES[1:]] == [library.log_odds[name] for name in CANDIDATES[1:]]


@pytest.mark.slow  # two searches; that the odds are the file's is tested above
def test_odds_decide_what_the_runs_do_not() -> None:
    """A latent heat so small that the runs hardly show it is named by large odds and not by small ones."""
    named = {}
    for odds in (1e-6, 1.0):
        search = hot_weight({"latent_heat.enthalpy": 100.0})
        search.joint = _joint(search, DeclaredPriors({"latent_heat": odds}))
        named[odds] = search_jointly(search, {(): search.joint.problem.start_values()}).effects
    assert "latent_heat" not in named[1e-6]
    assert "latent_heat" in named[1.0]


def test_a_cached_fit_is_one_of_the_same_priors(tmp_path: Path) -> None:
    search, cache = hot_weight({}), ResultCache(tmp_path)

    def key(declared: DeclaredPriors) -> str:
        joint = _joint(search, declared)
        problem, index = joint.restricted(("latent_heat",))
        values = joint.problem.start_values()[index]
        return cache.key((problem, [problem.task(joint.free(("latent_heat",)), joint.bounds, values)]), "a fit")

    assert key(DeclaredPriors()) == key(DeclaredPriors())
    assert key(DeclaredPriors()) != key(NARROW)
    assert key(DeclaredPriors({"latent_heat": 0.5})) == key(DeclaredPriors())  # odds are no part of a fit


def test_a_base_alone_keeps_the_librarys_width_and_no_width_goes_beyond_half_of_the_bounds() -> None:
    own, bounds = CoefficientPrior(4.5, 1.5, True), (1.0, 100.0)
    assert overridden(own, None, bounds) == own
    assert overridden(own, PriorSpread(9.0, None, True), bounds) == (9.0, 1.5, True)
    assert overridden(own, PriorSpread(500.0, 80.0, False), bounds) == (100.0, 49.5, False)
    assert overridden(own, PriorSpread(None, 9.0, True), bounds).sigma == pytest.approx(0.5 * math.log(100.0))


def test_values_of_presets_are_as_uncertain_as_the_file_says() -> None:
    system = build("flexinol_table_3_2", "dead_weight", "voltage")
    table, values = parameters(system), parameter_values(system)
    declared = {
        "young_modulus_austenite": PriorSpread(None, 0.05, True),
        "young_modulus_martensite": PriorSpread(None, 1e9, False),
        "austenite_start": PriorSpread(None, 2.0, False),  # which the library holds
    }
    library = preset_priors(table, values, frozenset())
    ours = preset_priors(table, values, frozenset(), declared)
    assert "austenite_start" not in library
    assert "austenite_start" not in RELATIVE
    assert ours["young_modulus_austenite"] == (values["young_modulus_austenite"], 0.05, True)
    boxes = preset_bounds(ours, {name: (table[name].low, table[name].high) for name in ours})
    for name in ("young_modulus_martensite", "austenite_start"):
        half = 3.0 * ours[name].sigma
        np.testing.assert_allclose(boxes[name], (values[name] - half, values[name] + half))
    assert {name: ours[name] for name in library if name not in declared} == {
        name: library[name] for name in library if name not in declared
    }


@pytest.mark.usefixtures("blank_pictures")
@pytest.mark.slow  # a whole loop, for words of the page
def test_the_record_and_the_page_say_which_priors_the_file_gives(tmp_path: Path) -> None:
    priors = """[effects]
only = ["latent_heat", "rising_convection"]
[priors.latent_heat]
odds = 0.25
enthalpy = { width = "10 J/g" }
[priors.presets]
young_modulus_austenite = { relative = 0.1 }
austenite_start = { width = "5 K" }
[sampling]"""
    path = bench(tmp_path / "bench", ("[sampling]", priors))
    ended = smajax("close-loop", path, "--out", tmp_path / "out")
    assert ended.code == 0, ended
    record = json.loads((tmp_path / "out" / "report.json").read_text())
    said = {one["name"]: one for one in record["priors"]}
    assert set(said) == {"latent_heat", "latent_heat.enthalpy", "young_modulus_austenite", "austenite_start"}
    assert (said["latent_heat"]["odds"], said["latent_heat"]["library_odds"]) == (0.25, pytest.approx(0.1))
    assert said["latent_heat.enthalpy"]["width"] == 1e4 != said["latent_heat.enthalpy"]["library_width"]
    assert said["young_modulus_austenite"]["library_width"] == RELATIVE["young_modulus_austenite"][0]
    assert said["austenite_start"]["library_width"] is None
    page = (tmp_path / "out" / "report.html").read_text()
    assert "The prior odds of latent_heat are 0.25 by the experiment file, and 0.1 by the library." in page
    assert "± 5 K by the experiment file, and held without it." in page


@pytest.mark.slow  # an identification, for a sentence
@pytest.mark.usefixtures("blank_pictures")
def test_identify_says_that_it_uses_none_of_them(tmp_path: Path) -> None:
    path = bench(tmp_path / "bench", ("[sampling]", "[priors.latent_heat]\nodds = 0.25\n[sampling]"))
    ended = smajax("identify", path, "--out", tmp_path / "out", "--starts", "1")
    assert ended.code == 0, ended
    assert "[priors] changes nothing here" in ended.said
