"""A model as a file: what is written is read again, and what is wrong with one is said as of an experiment file."""

from __future__ import annotations

import dataclasses
import math
from pathlib import Path

import numpy as np
import pytest

from smajax.attribution.job import job_of
from smajax.core.parameters import get_parameters, parameter_values
from smajax.data.experiment.draft import draft
from smajax.data.experiment.draft_model import ModelChoice
from smajax.data.experiment.errors import ExperimentError
from smajax.data.experiment.record import Prior
from smajax.data.experiment.schema import ChannelSection, LogFormat, SamplingSection, TimeSection
from smajax.data.model_file.actuator_model import ActuatorModel
from smajax.data.model_file.of_experiment import actuator_model
from smajax.data.model_file.of_presets import model_of_presets
from smajax.data.model_file.read import load_model
from smajax.data.model_file.record import FittedRun, LikelyModel, ModelOutput, ModelParameter
from smajax.data.open_experiment import open_experiment
from smajax.fit.base_model import base_model
from smajax.model.effects.prior_width import CoefficientPrior
from smajax.model.extended import extended
from smajax.model.presets import build
from tests.helpers.small_bench import bench

FITTED = {"convection_coefficient": 89.89379596500423, "specific_heat": 559.3696799656494}
LATENT = {**FITTED, "latent_heat.enthalpy": 24243.742564828313}
COVARIANCE = np.array([[0.0104, 0.02, 1.5], [0.02, 0.7207, 6.0], [1.5, 6.0, 997.0]])


def fitted_model() -> ActuatorModel:
    """A dead weight with a latent heat, another likely model without, everything that a file may hold."""
    known = model_of_presets("flexinol_table_3_2", "dead_weight", "voltage", "brinson").parameters
    system = extended(build("flexinol_table_3_2", "dead_weight", "voltage", "brinson"), ["latent_heat"])
    values = {name: known.get(name) or ModelParameter(0.0, "preset", 0.0, 6e4) for name in parameter_values(system)}
    boxes = {
        "convection_coefficient": (30.0, 300.0),
        "specific_heat": (200.0, 1500.0),
        "latent_heat.enthalpy": (0.0, 6e4),
    }
    errors = np.sqrt(np.diag(COVARIANCE))
    for (name, value), error in zip(LATENT.items(), errors, strict=True):
        values[name] = ModelParameter(value, "fitted", *boxes[name], float(f"{error:.6g}"))
    values["wire_diameter"] = ModelParameter(0.00031, "given", *_ends(known["wire_diameter"]))
    return ActuatorModel(
        title='A "bench" of 2 µm\ttabs',
        wire="flexinol_table_3_2",
        load="dead_weight",
        drive="voltage",
        law="brinson",
        effects=("latent_heat",),
        parameters=values,
        outputs=(ModelOutput("position", "m", 1e-4, True, 1.65e-4),),
        likely=(
            LikelyModel(
                ("latent_heat",), 0.9, LATENT, tuple(LATENT), COVARIANCE, {"specific_heat": Prior(600.0, 0.2, True)}
            ),
            LikelyModel((), 0.1, FITTED, tuple(FITTED), COVARIANCE[:2, :2]),
        ),
        fitted_range={"voltage": (0.0, 5.462), "temperature": (23.0, 117.358), "stress": (7.6e7, 1.43e8)},
        runs=(FittedRun("steps", "fit", "ab12"), FittedRun("ramp", "held-out", "cd34")),
        log_format=LogFormat(
            channels={
                "voltage": ChannelSection(role="input", column="U [V]", unit="V"),
                "position": ChannelSection(role="output", column=3, unit="mm", noise="0.1 mm", reversed=True),
            },
            time=TimeSection(column="t", unit="ms"),
            sampling=SamplingSection(step="100 ms"),
            decimal=",",
        ),
        made_with={"experiment": "experiment.toml"},
    )


def _ends(one: ModelParameter) -> tuple[float, float]:
    return one.low, one.high


def same(one: ActuatorModel, other: ActuatorModel) -> None:
    """Equal in every field; the covariances as arrays."""
    for field in dataclasses.fields(ActuatorModel):
        if field.name != "likely":
            assert getattr(one, field.name) == getattr(other, field.name), field.name
    for mine, its in zip(one.likely, other.likely, strict=True):
        np.testing.assert_array_equal(mine.covariance, its.covariance)
        empty = np.zeros((0, 0))
        assert dataclasses.replace(mine, covariance=empty).__dict__.keys() == its.__dict__.keys()
        for name in ("effects", "probability", "values", "names", "priors"):
            assert getattr(mine, name) == getattr(its, name), name


def test_what_is_written_is_read_again_to_the_last_bit(tmp_path: Path) -> None:
    model = fitted_model()
    path = model.save(tmp_path / "model.toml")
    again = load_model(path)
    same(model, again)
    assert path.read_text(encoding="utf-8") == again.save(tmp_path / "again.toml").read_text(encoding="utf-8").replace(
        "again.nc", "model.nc"
    )
    assert sorted(one.name for one in tmp_path.iterdir()) == ["again.nc", "again.toml", "model.nc", "model.toml"]
    same(again, load_model(tmp_path))  # the folder of a model.toml


def test_values_are_in_units_of_a_data_sheet_and_read_again_to_the_last_bit(tmp_path: Path) -> None:
    model = fitted_model()
    odd = dict(model.parameters)
    for name, value in {
        "young_modulus_martensite": 28.3e9,
        "young_modulus_austenite": 75e9 / 1.0000001,  # sixteen digits in either unit
        "resistivity_austenite": 8.4e-7,
        "load_mass": 0.075,
        "wire_length": 0.537,
    }.items():
        odd[name] = dataclasses.replace(odd[name], value=value, origin="given")
    model = dataclasses.replace(model, parameters=odd)
    path = model.save(tmp_path / "model.toml")
    text = path.read_text(encoding="utf-8")
    for line in (
        'young_modulus_martensite = "28.3 GPa"',
        'resistivity_austenite = "0.84 µΩ m"',
        'load_mass = "75 g"',
        'wire_length = "0.537 m"',
        'wire_diameter = "0.31 mm"',
        'stress = ["76 MPa", "143 MPa"]',
        'noise = "0.1 mm"',
        'temperature = ["23 degC", "117.358 degC"]',
    ):
        assert f"\n{line}" in text, line
    same(model, load_model(path))
    (enthalpy,) = [one for one in text.splitlines() if one.startswith('"latent_heat.enthalpy"')]
    assert enthalpy.count(" J/g") == 4, enthalpy  # its error and bounds too


def test_presets_are_such_a_file_and_build_the_same_system(tmp_path: Path) -> None:
    path = model_of_presets("niti_table_3_1", "arm", "amplified_voltage").save(tmp_path / "arm.toml")
    model = load_model(path)
    assert parameter_values(model.system) == parameter_values(build("niti_table_3_1", "arm", "amplified_voltage"))
    assert not (tmp_path / "arm.nc").exists()


def test_a_file_by_hand_needs_its_parts_and_the_values_that_differ(tmp_path: Path) -> None:
    path = tmp_path / "mine.toml"
    path.write_text(
        'format = 1\n[model]\nwire = "flexinol_table_3_2"\nload = "dead_weight"\ndrive = "voltage"\n'
        'effects = ["latent_heat"]\n[parameters]\nwire_length = "420 mm"\n"latent_heat.enthalpy" = "12 J/g"\n'
        'convection_coefficient = { value = "90 W/m^2/K", origin = "fitted", standard_error = "3 W/m^2/K" }\n',
        encoding="utf-8",
    )
    model = load_model(path)
    assert model.values["wire_length"] == pytest.approx(0.42, rel=1e-12)
    assert model.values["latent_heat.enthalpy"] == 12000.0
    assert model.parameters["convection_coefficient"].standard_error == 3.0
    assert model.parameters["wire_diameter"].origin == "preset"


def test_a_value_that_is_changed_by_hand_is_known_and_the_others_keep_their_covariance(tmp_path: Path) -> None:
    path = fitted_model().save(tmp_path / "model.toml")
    text = path.read_text(encoding="utf-8")
    line = next(one for one in text.splitlines() if one.startswith("specific_heat"))
    path.write_text(text.replace(line, 'specific_heat = "600 J/kg/K"'), encoding="utf-8")
    model = load_model(path)
    assert model.values["specific_heat"] == 600.0
    assert model.likely[0].names == ("convection_coefficient", "latent_heat.enthalpy")
    np.testing.assert_array_equal(model.likely[0].covariance, COVARIANCE[np.ix_([0, 2], [0, 2])])
    assert all("specific_heat" not in one.values for one in model.likely)
    assert "specific_heat" in model.warnings[0]
    # In the other likely model it is the changed value too.
    assert parameter_values(model.system_of((), model.likely[1].values))["specific_heat"] == 600.0


def test_draws_have_the_covariance_and_the_probabilities_of_the_file() -> None:
    model = fitted_model()
    drawn = np.asarray(get_parameters(model.plants(4000, seed=3), list(LATENT))).T
    values = drawn[drawn[:, 2] > 0.0]
    assert len(values) / len(drawn) == pytest.approx(0.9, abs=0.02)
    np.testing.assert_allclose(values.mean(axis=0), list(LATENT.values()), rtol=2e-3)
    scale = np.sqrt(np.outer(np.diag(COVARIANCE), np.diag(COVARIANCE)))
    np.testing.assert_allclose(np.cov(values.T) / scale, COVARIANCE / scale, atol=0.06)
    plants = model.plants(5, seed=1)
    assert plants.wire.heat.convection_coefficient.shape == (5,)
    assert [one.effect_name for one in plants.effects] == ["latent_heat"]


def test_draws_lie_within_the_bounds() -> None:
    model = fitted_model()
    # Correlated, and with half of it beyond a bound: cut off there, and not heaped up on it.
    near = {**LATENT, "convection_coefficient": 31.0}
    covariance = np.array([[4.0, 3.6, 0.0], [3.6, 4.0, 0.0], [0.0, 0.0, 1.0]])
    wide = dataclasses.replace(model.likely[0], values=near, covariance=covariance)
    plants = dataclasses.replace(model, likely=(wide,)).plants(2000, seed=2)
    convection, heat = np.asarray(get_parameters(plants, ["convection_coefficient", "specific_heat"]))
    assert convection.min() > 30.0
    assert np.mean(convection < 30.01) < 0.02
    # Given the one the other is as before: E = mean + 0.9 (x - mean), and its deviation 2 sqrt(1 - 0.81).
    rest = heat - FITTED["specific_heat"] - 0.9 * (convection - 31.0)
    assert abs(rest.mean()) < 0.08
    assert rest.std() == pytest.approx(2.0 * np.sqrt(1.0 - 0.81), rel=0.06)


def test_drawn_transformation_temperatures_are_in_their_order() -> None:
    model = fitted_model()
    values = {"austenite_start": 77.0, "austenite_finish": 78.0}
    likely = LikelyModel(("latent_heat",), 1.0, values, tuple(values), np.diag([4.0, 4.0]))
    start, finish = np.asarray(
        get_parameters(dataclasses.replace(model, likely=(likely,)).plants(500, seed=1), list(values))
    )
    assert (start < finish).all()
    assert finish.std() > 1.0


def _edited(path: Path, *changes: tuple[str, str]) -> Path:
    text = path.read_text(encoding="utf-8")
    for old, new in changes:
        assert old in text, old
        text = text.replace(old, new, 1)
    path.write_text(text, encoding="utf-8")
    return path


def test_alternatives_are_found_by_their_effects(tmp_path: Path) -> None:
    model = fitted_model()
    creep = LikelyModel(("latent_heat", "creep"), 0.05, {**LATENT, "creep.austenite": 1e-4})
    path = dataclasses.replace(model, likely=(*model.likely, creep)).save(tmp_path / "model.toml")
    section = "[[alternatives]]\neffects = []\nprobability = 0.1\n\n"
    assert load_model(_edited(path, (section, ""))).likely[1].values == creep.values
    with pytest.raises(
        ExperimentError, match=r"alternatives\.\[1\]\.effects: the file of the uncertainty has no model with radiation"
    ):
        load_model(_edited(path, ('effects = ["latent_heat", "creep"]', 'effects = ["radiation"]')))


def test_effects_that_are_changed_by_hand_leave_no_errors_and_no_alternatives(tmp_path: Path) -> None:
    path = fitted_model().save(tmp_path / "model.toml")
    model = load_model(_edited(path, ('effects = ["latent_heat"]', 'effects = ["latent_heat", "creep"]')))
    assert [one.effects for one in model.likely] == [("latent_heat", "creep")]
    assert model.likely[0].names == ()
    assert "effects were changed by hand" in model.warnings[0]


def test_the_file_of_another_fit_is_refused(tmp_path: Path) -> None:
    path = fitted_model().save(tmp_path / "model.toml")
    other = dataclasses.replace(fitted_model().likely[0], values={name: 1.01 * value for name, value in LATENT.items()})
    dataclasses.replace(fitted_model(), likely=(other,)).save(tmp_path / "other.toml")
    (tmp_path / "other.nc").replace(tmp_path / "model.nc")
    with pytest.raises(ExperimentError, match="its digest is another"):
        load_model(path)


def test_probabilities_that_are_all_zero_are_refused(tmp_path: Path) -> None:
    path = fitted_model().save(tmp_path / "model.toml")
    with pytest.raises(ExperimentError, match="the probabilities of all models are zero"):
        load_model(
            _edited(path, ("probability = 0.9", "probability = 0.0"), ("probability = 0.1", "probability = 0.0"))
        )


def test_a_fit_run_that_the_model_file_was_fitted_to_is_said_to_count_twice(tmp_path: Path) -> None:
    presets = 'wire = "flexinol_table_3_2"\nload = "dead_weight"\ndrive = "voltage"\n'
    digest = open_experiment(bench(tmp_path)).runs[0].sha256
    dataclasses.replace(fitted_model(), runs=(FittedRun("steps", "fit", digest),)).save(tmp_path / "model.toml")
    experiment = open_experiment(bench(tmp_path, (presets, 'file = "model.toml"\n')))
    assert any("run 'A' is one that the model file was fitted to" in one for one in experiment.warnings)
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


GOOD = 'format = 1\n[model]\nwire = "flexinol_table_3_2"\nload = "dead_weight"\ndrive = "voltage"\n'


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (GOOD.replace("format = 1", "format = 7"), r"format: got 7, expected 1 to 1; it is from a later version"),
        (GOOD.replace("format = 1\n", ""), r"format: is missing; expected a whole number, 1"),
        (GOOD.replace("dead_weight", "dead_wieght"), r"model\.load: there is no load 'dead_wieght'; did you mean"),
        (GOOD.replace('drive = "voltage"\n', ""), r"model\.drive: is missing; expected the name of a drive"),
        (GOOD.replace('"voltage"', '"none"'), r"model: load `dead_weight` with drive `none`"),
        (GOOD + 'effects = ["latent_hat"]\n', r"model\.effects: there is no effect 'latent_hat'; did you mean"),
        (GOOD + '[parameters]\nwire_lenght = "1 m"\n', r"parameters\.wire_lenght: there is no parameter 'wire_lenght'"),
        (
            GOOD + '[parameters]\nwire_length = "1 kg"\n',
            r"parameters\.wire_length: got unit 'kg', expected one like 'm'",
        ),
        (
            GOOD + '[parameters]\nwire_length = "1000 m"\n',
            r"parameters\.wire_length: got '1000 m', that is 1000 m; expected",
        ),
        (
            GOOD + '[parameters]\n"latent_heat.enthalpy" = "1 J/g"\n',
            r"is of an effect that the model has not; add 'latent_heat' to \[model\] effects",
        ),
        (
            GOOD + '[parameters]\nwire_length = { value = "1 m", origin = "measured" }\n',
            r"parameters\.wire_length\.origin: got 'measured', expected 'fitted', 'given' or 'preset'",
        ),
        (GOOD + '[parameters]\naustenite_start = "90 degC"\n', r"parameters\.austenite_start: "),
        (GOOD + '[outputs.angle]\nnoise = "1 deg"\n', r"outputs\.angle: there is no output 'angle'"),
        (GOOD + '[outputs.position]\nnoise = "0 mm"\n', r"outputs\.position\.noise: got '0 mm', expected a size above"),
        (GOOD + '[fitted_range]\nvoltage = ["5 V", "1 V"]\n', r"fitted_range\.voltage: got '5 V' and '1 V'"),
        (GOOD + '[fitted_range]\nvolts = ["5 V", "1 V"]\n', r"fitted_range\.volts: there is no quantity 'volts'"),
        ("uncertainty = '../x.nc'\n" + GOOD, r"uncertainty: got '\.\./x\.nc', expected the name of a file in the same"),
        ("uncertainty = 'x.nc'\n" + GOOD, r"uncertainty: .*x\.nc cannot be read .*put it beside this file"),
        ("[[runs]]\nname = 'A'\n", r"is an experiment file, expected a model file; `smajax close-loop` makes one"),
        ("not toml at all", r"is not TOML"),
        ("a = " + "[" * 5000, r"is not TOML"),
    ],
)
def test_what_is_wrong_with_a_file_is_said_with_its_key(tmp_path: Path, text: str, said: str) -> None:
    path = tmp_path / "model.toml"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(ExperimentError, match=said):
        load_model(path)


def test_a_foreign_or_a_cut_netcdf_file_is_refused(tmp_path: Path) -> None:
    path = fitted_model().save(tmp_path / "model.toml")
    beside = tmp_path / "model.nc"
    whole = beside.read_bytes()
    dataclasses.replace(fitted_model(), likely=fitted_model().likely[:1]).save(tmp_path / "other.toml")
    for content in (b"", b"no NetCDF", whole[: len(whole) // 2], (tmp_path / "other.nc").read_bytes()):
        beside.write_bytes(content)
        with pytest.raises(ExperimentError, match=r"uncertainty: .*model\.nc is not what was written with this file"):
            load_model(path)


def test_no_other_name_and_no_folder_are_written_to(tmp_path: Path) -> None:
    with pytest.raises(ExperimentError, match=r"expected a name that ends in \.toml"):
        fitted_model().save(tmp_path / "model.nc")
    with pytest.raises(ExperimentError, match="there is no such file; expected a model file"):
        load_model(tmp_path / "none.toml")


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


def undetermined_model() -> ActuatorModel:
    """`fitted_model` with three more fitted values that its runs did not determine: one of them had a prior."""
    model = fitted_model()
    more = {"austenite_start": 68.0, "young_modulus_martensite": 28e9, "recoverable_strain": 0.045}
    boxes = {
        "austenite_start": (43.0, 93.0),
        "young_modulus_martensite": (20e9, 40e9),
        "recoverable_strain": (0.0, 0.1),
    }
    parameters = {**model.parameters, **{name: ModelParameter(more[name], "fitted", *boxes[name]) for name in more}}
    own = dataclasses.replace(
        model.likely[0],
        values={**model.likely[0].values, **more},
        priors={**model.likely[0].priors, "recoverable_strain": Prior(0.047, 0.1, True)},
    )
    return dataclasses.replace(model, parameters=parameters, likely=(own, *model.likely[1:]))


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
