"""Priors in an experiment file: read in SI, and a mistake in them names the key, what was expected and what is alike."""

from __future__ import annotations

from pathlib import Path

import pytest

from smajax.data.experiment import schema
from smajax.data.experiment.errors import ExperimentError
from smajax.data.experiment.load import load_experiment
from smajax.data.experiment.record import DeclaredPriors, Experiment, PriorSpread
from smajax.data.model_catalogue import CATALOGUE
from smajax.data.model_file.of_presets import model_of_presets
from smajax.data.model_file.write import write_model
from smajax.model.effects.candidate import PRIOR_ODDS
from tests.helpers.small_bench import bench


def _load(folder: Path, priors: str, *changes: tuple[str, str]) -> Experiment:
    return load_experiment(bench(folder, ("[sampling]", f"{priors}\n[sampling]"), *changes), CATALOGUE)


def test_priors_are_read_in_the_programs_own_units(tmp_path: Path) -> None:
    priors = """
[priors.latent_heat]
odds = "event"
enthalpy = { width = "10 J/g" }
[priors.creep]
odds = 0.5
time_constant = { base = "1 min", relative = 0.4 }
[priors.thermal_expansion]
martensite = { width = "2e-6 1/K" }
[priors.presets]
young_modulus_austenite = { relative = 0.1 }
young_modulus_martensite = { width = "2 GPa" }
austenite_start = { width = "5 degC" }
"""
    read = _load(tmp_path, priors).priors
    assert read.odds == {"latent_heat": PRIOR_ODDS["event"], "creep": 0.5}
    assert read.coefficients == {
        "latent_heat.enthalpy": PriorSpread(None, 1e4, False),
        "creep.time_constant": PriorSpread(60.0, 0.4, True),
        "thermal_expansion.martensite": PriorSpread(None, pytest.approx(2e-6), False),  # type: ignore[arg-type]
    }
    assert read.presets == {
        "young_modulus_austenite": PriorSpread(None, 0.1, True),
        "young_modulus_martensite": PriorSpread(None, 2e9, False),
        "austenite_start": PriorSpread(None, 5.0, False),
    }


def test_a_share_of_a_value_below_zero_is_a_width(tmp_path: Path) -> None:
    read = _load(
        tmp_path,
        "[priors.presets]\nthermal_modulus = { relative = 0.5 }",
        ('"flexinol_table_3_2"', '"flexinol_table_3_2_expanding"'),
    )
    assert read.priors.presets == {"thermal_modulus": PriorSpread(None, 0.275e6, False)}


def test_a_file_without_priors_has_none(tmp_path: Path) -> None:
    priors = _load(tmp_path, "").priors
    assert priors == DeclaredPriors()
    assert not priors


MISTAKES = [
    (
        "[priors.latent_het]\nodds = 0.1",
        r"priors.latent_het: there is no effect 'latent_het'; did you mean 'latent_heat'",
    ),
    ("[priors.latent_heat]\nods = 0.1", r"priors.latent_heat.ods: got 0.1, .*; did you mean 'odds'\?"),
    (
        '[priors.latent_heat]\nodds = "benches"',
        r"priors.latent_heat.odds: .*'benches'; did you mean 'bench'\? .*material \(0.1\)",
    ),
    (
        "[priors.latent_heat]\nodds = 0.0",
        r"priors.latent_heat.odds: got 0, expected odds above 0 .* \[effects\] exclude",
    ),
    ("[priors.latent_heat]\nodds = 1.5", r"priors.latent_heat.odds: got 1.5, expected odds above 0 and at most 1"),
    ("[priors.latent_heat]\nodds = true", r"priors.latent_heat.odds: got True, expected a class of odds"),
    (
        '[priors.latent_heat]\nentalpy = { width = "1 J/g" }',
        r"priors.latent_heat.entalpy: 'latent_heat' has no coefficient 'entalpy'; did you mean 'enthalpy'",
    ),
    (
        '[priors.latent_heat]\nenthalpy = { widht = "1 J/g" }',
        r"enthalpy.widht: is not a known key; did you mean 'width'",
    ),
    ('[priors.latent_heat]\nenthalpy = { width = "1 J" }', r"priors.latent_heat.enthalpy.width: got unit 'J'"),
    ('[priors.latent_heat]\nenthalpy = { width = "0 J/g" }', r"enthalpy.width: got '0 J/g', expected .* above zero"),
    ('[priors.latent_heat]\nenthalpy = { width = "-1 J/g" }', r"enthalpy.width: got '-1 J/g', expected .* above zero"),
    ('[priors.latent_heat]\nenthalpy = { width = "1 GJ/g" }', r"enthalpy.width: got '1 GJ/g', .*expected at most half"),
    ('[priors.latent_heat]\nenthalpy = { base = "5 J/g" }', r"enthalpy.base: the effect is off where this is zero"),
    ("[priors.latent_heat]\nenthalpy = { relative = 0.1 }", r"enthalpy.relative: got a middle of 0, .*give width"),
    ("[priors.latent_heat]\nenthalpy = {}", r"priors.latent_heat.enthalpy: says nothing; give base, width or relative"),
    (
        '[priors.creep]\ntime_constant = { width = "1 s", relative = 1.0 }',
        r"time_constant: got both width and relative",
    ),
    (
        '[priors.creep]\ntime_constant = { base = "1 m" }',
        r"creep.time_constant.base: got unit 'm' \(minutes are 'min'\)",
    ),
    (
        "[priors.presets]\nyoung_modulus = { relative = 0.1 }",
        r"presets.young_modulus: there is no .*'young_modulus_aus",
    ),
    (
        "[priors.presets]\nyoung_modulus_austenite = { relative = -1.0 }",
        r"austenite.relative: got -1.0, expected a num",
    ),
    ("[priors.presets]\nyoung_modulus_austenite = {}", r"young_modulus_austenite: does not say how uncertain"),
    (
        '[priors.presets]\nyoung_modulus_austenite = { base = "60 GPa" }',
        r"austenite: does not say how uncertain .*what is known goes into \[model.parameters\]",
    ),
    (
        '[priors.presets]\nyoung_modulus_austenite = { base = "60 MPa", relative = 0.1 }',
        r"austenite.base: got '60 MPa', that is 6e\+07 Pa; expected",
    ),
    (
        "[priors.presets]\naustenite_start = { relative = 0.1 }",
        r"start.relative: got a preset of .* degC, .*give width",
    ),
    ("[priors.presets]\nconvection_coefficient = { relative = 0.1 }", r"coefficient: \[unknown\] gives it too"),
    ('[priors.presets]\n"latent_heat.enthalpy" = { relative = 0.1 }', r"there is no parameter 'latent_heat.enthalpy'"),
]


@pytest.mark.parametrize(("priors", "message"), MISTAKES)
def test_a_mistake_names_its_key_and_what_was_expected(tmp_path: Path, priors: str, message: str) -> None:
    with pytest.raises(ExperimentError, match=message):
        _load(tmp_path, priors)


def test_an_effect_of_the_model_has_no_prior_of_a_candidate(tmp_path: Path) -> None:
    own = ("[unknown]", '[model.parameters]\n"latent_heat.enthalpy" = "1 J/g"\n[unknown]')
    with pytest.raises(ExperimentError, match=r"priors.latent_heat: 'latent_heat' is part of the model"):
        _load(tmp_path, "[priors.latent_heat]\nodds = 0.1", own)


def test_a_prior_of_an_effect_that_is_not_tried_is_remarked(tmp_path: Path) -> None:
    read = _load(tmp_path, '[effects]\nexclude = ["latent_heat"]\n[priors.latent_heat]\nodds = 0.1')
    assert any("[priors.latent_heat]: [effects] leaves it out" in warning for warning in read.warnings)


def test_the_page_of_keys_has_every_section_and_key_that_the_reader_knows() -> None:
    page = (Path(__file__).parents[2] / "docs" / "reference" / "experiments.md").read_text(encoding="utf-8")
    table = page.partition("| section | key |")[2].partition("\n\n")[0]
    for section, kind in schema._PLACES.items():
        for key in kind.model_fields if kind is not None else ():
            if (*section, key) not in schema._PLACES and (*section, key, "*") not in schema._PLACES:
                assert f"`{key}`" in table or f"{key} = " in table or f"[{key}" in table, (section, key)


def test_what_a_model_file_fitted_is_as_uncertain_as_the_experiment_file_says(tmp_path: Path) -> None:
    model = model_of_presets("flexinol_table_3_2", "dead_weight", "voltage")
    write_model(model, tmp_path / "model.toml")
    own = 'wire = "flexinol_table_3_2"\nload = "dead_weight"\ndrive = "voltage"'
    read = _load(tmp_path, "[priors.presets]\nthermal_modulus = { relative = 0.1 }", (own, 'file = "model.toml"'))
    assert read.model_file is not None
    assert read.priors.presets == {"thermal_modulus": PriorSpread(None, 0.1, True)}
