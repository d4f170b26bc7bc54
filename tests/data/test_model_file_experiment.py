"""A model file and the experiments that it came from or begins."""

from __future__ import annotations

import dataclasses
import math
from pathlib import Path

import pytest

from smajax.attribution.job import job_of
from smajax.core.parameters import parameter_values
from smajax.data.experiment.draft import draft
from smajax.data.experiment.draft_model import ModelChoice
from smajax.data.experiment.errors import ExperimentError
from smajax.data.model_file.of_experiment import actuator_model
from smajax.data.model_file.read import load_model
from smajax.data.model_file.record import FittedRun, LikelyModel
from smajax.data.open_experiment import open_experiment
from smajax.fit.base_model import base_model
from smajax.model.effects.prior_width import CoefficientPrior
from tests.helpers.model_files import COVARIANCE, FITTED, LATENT, fitted_model, same, undetermined_model
from tests.helpers.small_bench import bench


def test_an_experiment_may_begin_from_a_model_file(tmp_path: Path) -> None:
    (tmp_path / "kept").mkdir()
    fitted_model().save(tmp_path / "kept" / "model.toml")
    presets = 'wire = "flexinol_table_3_2"\nload = "dead_weight"\ndrive = "voltage"\n'
    file = bench(tmp_path, (presets, 'file = "kept/model.toml"\n'))
    experiment = open_experiment(file)
    values = parameter_values(base_model(experiment))
    assert experiment.law == "brinson"
    assert experiment.parameters == {"wire_diameter": 0.00031}
    assert experiment.declared_effects == ("latent_heat",)
    assert values["specific_heat"] == FITTED["specific_heat"]
    assert values["latent_heat.enthalpy"] == LATENT["latent_heat.enthalpy"]
    assert values["convection_coefficient"] == 100.0  # the start of the unknown
    kept = experiment.model_file
    assert kept is not None
    assert kept.errors.keys() == LATENT.keys()


def test_a_fit_run_that_the_model_file_was_fitted_to_is_said_to_count_twice(tmp_path: Path) -> None:
    presets = 'wire = "flexinol_table_3_2"\nload = "dead_weight"\ndrive = "voltage"\n'
    digest = open_experiment(bench(tmp_path)).runs[0].sha256
    dataclasses.replace(fitted_model(), runs=(FittedRun("steps", "fit", digest),)).save(tmp_path / "model.toml")
    experiment = open_experiment(bench(tmp_path, (presets, 'file = "model.toml"\n')))
    (said,) = [one for one in experiment.warnings if "run 'A' is one that the model file was fitted to" in one]
    # The bench has `convection_coefficient` under [unknown]: it is free, and its former error is no prior.
    assert "it counts twice for specific_heat and latent_heat.enthalpy; under" in said
    free = """[unknown]
specific_heat = { start = "560 J/kg/K", low = "200 J/kg/K", high = "1500 J/kg/K" }
"latent_heat.enthalpy" = { start = "24 J/g", low = "0 J/g", high = "60 J/g" }
"""
    alone = open_experiment(bench(tmp_path, (presets, 'file = "model.toml"\n'), ("[unknown]\n", free)))
    assert not any("twice" in one for one in alone.warnings)
    with pytest.raises(ExperimentError, match=r"effects\.exclude: 'latent_heat' is part of the model"):
        open_experiment(bench(tmp_path, (presets, 'file = "model.toml"\n[effects]\nexclude = ["latent_heat"]\n')))


def test_values_of_single_runs_are_those_of_the_bench_and_a_range(tmp_path: Path) -> None:
    own = 'file = "a.csv"\nparameters = { load_mass = "0.64 kg" }'
    experiment = open_experiment(bench(tmp_path, ('file = "a.csv"', own)))
    likely = [LikelyModel((), 1.0, {"convection_coefficient": 120.0})]
    made = actuator_model(
        experiment, likely, {"convection_coefficient": (40.0, 400.0)}, {}, [], {"voltage": (0.0, 5.0)}
    )
    assert (made.values["load_mass"], made.parameters["load_mass"].origin) == (0.64, "given")
    assert made.fitted_range["load_mass"] == (0.64, 0.64)
    same(made, load_model(made.save(tmp_path / "made.toml")))


@pytest.mark.parametrize("common", ["0.9 kg", ""])
def test_the_value_of_the_runs_without_their_own_stays_that_of_the_model(tmp_path: Path, common: str) -> None:
    given = f'[model.parameters]\nload_mass = "{common}"\n[unknown]\n' if common else "[unknown]\n"
    own = 'parameters = { load_mass = "0.64 kg" }'
    more = f'file = "a.csv"\n[[runs]]\nname = "partial"\nrole = "fit"\nfile = "a.csv"\n{own}'
    experiment = open_experiment(bench(tmp_path, ("[unknown]\n", given), ('file = "a.csv"', more)))
    likely = [LikelyModel((), 1.0, {"convection_coefficient": 120.0})]
    made = actuator_model(experiment, likely, {"convection_coefficient": (40.0, 400.0)}, {}, [], {})
    used = parameter_values(base_model(experiment))["load_mass"]
    assert used == (0.9 if common else 0.075)
    assert made.values["load_mass"] == used
    assert made.parameters["load_mass"].origin == ("given" if common else "preset")
    assert made.fitted_range["load_mass"] == (min(0.64, used), max(0.64, used))


def test_a_given_value_stays_where_every_run_has_its_own(tmp_path: Path) -> None:
    given = '[model.parameters]\nload_mass = "0.9 kg"\n[unknown]\n'
    own = 'file = "a.csv"\nparameters = { load_mass = "0.64 kg" }'
    experiment = open_experiment(bench(tmp_path, ("[unknown]\n", given), ('file = "a.csv"', own)))
    made = actuator_model(experiment, [LikelyModel((), 1.0, {"convection_coefficient": 120.0})], {}, {}, [], {})
    assert made.values["load_mass"] == 0.9
    assert made.fitted_range["load_mass"] == (0.64, 0.64)


def test_fitted_values_that_no_run_determined_take_part_in_a_following_loop(tmp_path: Path) -> None:
    undetermined_model().save(tmp_path / "model.toml")
    presets = 'wire = "flexinol_table_3_2"\nload = "dead_weight"\ndrive = "voltage"\n'
    experiment = open_experiment(bench(tmp_path, (presets, 'file = "model.toml"\n')))
    kept = experiment.model_file
    assert kept is not None
    assert set(kept.undetermined) == {"austenite_start", "young_modulus_martensite", "recoverable_strain"}
    (said,) = [one for one in experiment.warnings if "did not determine" in one]
    assert "austenite_start, young_modulus_martensite and recoverable_strain" in said
    job = job_of(experiment)
    assert job.presets["recoverable_strain"] == CoefficientPrior(0.047, 0.1, True)  # what it had
    assert job.presets["young_modulus_martensite"] == CoefficientPrior(28e9, 0.25, True)  # data sheets
    assert job.presets["austenite_start"] == CoefficientPrior(68.0, 50.0 / math.sqrt(12.0), False)
    assert job.bounds["austenite_start"] == (43.0, 93.0)
    assert job.presets["specific_heat"].sigma == pytest.approx(COVARIANCE[1, 1] ** 0.5)  # determined: by its error

    known = 'file = "model.toml"\n[model.parameters]\naustenite_start = "67 degC"\n'
    given = open_experiment(bench(tmp_path, (presets, known)))
    assert "austenite_start" not in job_of(given).presets
    assert not any("austenite_start" in one for one in given.warnings)


def test_a_base_of_the_experiment_file_goes_before_what_a_model_file_fitted(tmp_path: Path) -> None:
    fitted_model().save(tmp_path / "model.toml")
    presets = 'wire = "flexinol_table_3_2"\nload = "dead_weight"\ndrive = "voltage"\n'
    own = 'file = "model.toml"\n[priors.presets]\nspecific_heat = { base = "700 J/(kg K)", relative = 0.1 }\n'
    experiment = open_experiment(bench(tmp_path, (presets, own)))
    assert job_of(experiment).presets["specific_heat"] == CoefficientPrior(700.0, 0.1, True)
    likely = LikelyModel(("latent_heat",), 1.0, {"convection_coefficient": 120.0})
    made = actuator_model(experiment, [likely], {"convection_coefficient": (40.0, 400.0)}, {}, [], {})
    held = made.parameters["specific_heat"]
    assert (held.value, held.origin, held.standard_error) == (700.0, "preset", None)
    assert load_model(made.save(tmp_path / "made.toml")).values["specific_heat"] == 700.0


def test_a_draft_from_a_model_says_which_values_no_run_determined(tmp_path: Path) -> None:
    undetermined_model().save(tmp_path / "model.toml")
    bench(tmp_path)
    text = draft([tmp_path / "a.csv"], tmp_path / "e.toml", choice=ModelChoice(model=tmp_path / "model.toml")).text
    (line,) = [one for one in text.splitlines() if one.startswith("young_modulus_martensite")]
    assert line == (
        'young_modulus_martensite = { low = "20 GPa", high = "40 GPa", start = "28 GPa" }  # the runs of before did not determine it'
    )
    (determined,) = [one for one in text.splitlines() if one.startswith("specific_heat")]
    assert determined.endswith("}")


@pytest.mark.parametrize(
    ("new", "said"),
    [
        ('file = "model.toml"\nwire = "flexinol_table_3_2"\n', r"model: got file and wire; the file says its wire"),
        (
            'wire = "flexinol_table_3_2"\n',
            r"model\.load: is missing; expected the name of a load, as text; or file = 'model.toml'",
        ),
        ('file = "none.toml"\n', r"model\.file: .*none\.toml: there is no such file; expected a model file"),
        ('file = "experiment.toml"\n', r"model\.file: .*is an experiment file, expected a model file"),
    ],
)
def test_a_model_section_names_presets_or_a_file(tmp_path: Path, new: str, said: str) -> None:
    presets = 'wire = "flexinol_table_3_2"\nload = "dead_weight"\ndrive = "voltage"\n'
    with pytest.raises(ExperimentError, match=said):
        open_experiment(bench(tmp_path, (presets, new)))


def test_a_mass_that_the_logs_give_is_that_of_the_bench(tmp_path: Path) -> None:
    file = bench(
        tmp_path,
        ("[channels.position]", '[channels.mass]\nrole = "input"\ncolumn = "U"\nunit = "kg"\n[channels.position]'),
    )
    for name in ("a.csv", "b.csv"):  # the voltages, 5 and 0, stand in for masses
        text = (tmp_path / name).read_text(encoding="utf-8").replace(",0,", ",2,")
        (tmp_path / name).write_text(text, encoding="utf-8")
    experiment = open_experiment(file)
    likely = LikelyModel((), 1.0, {"convection_coefficient": 120.0})
    made = actuator_model(experiment, [likely], {"convection_coefficient": (40.0, 400.0)}, {}, [], {})
    assert made.parameters["load_mass"].origin == "given"
    assert made.values["load_mass"] in (2.0, 5.0)
