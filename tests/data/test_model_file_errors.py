"""What is wrong with a model file is said as of an experiment file."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import pytest

from smajax.data.experiment.errors import ExperimentError
from smajax.data.model_file.of_presets import model_of_presets
from smajax.data.model_file.read import load_model
from tests.helpers.model_files import LATENT, edited, fitted_model

GOOD = 'format = 1\n[model]\nwire = "flexinol_table_3_2"\nload = "dead_weight"\ndrive = "voltage"\n'


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (GOOD.replace("format = 1", "format = 7"), r"format: got 7, expected 1; it is from a later version"),
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
        (
            "uncertainty = 'x.nc'\n" + GOOD,
            r"uncertainty: .*x\.nc, which was written with this one; put it beside this file",
        ),
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
        load_model(edited(path, ("probability = 0.9", "probability = 0.0"), ("probability = 0.1", "probability = 0.0")))


def test_a_foreign_or_a_cut_netcdf_file_is_refused(tmp_path: Path) -> None:
    path = fitted_model().save(tmp_path / "model.toml")
    beside = tmp_path / "model.nc"
    whole = beside.read_bytes()
    dataclasses.replace(fitted_model(), likely=fitted_model().likely[:1]).save(tmp_path / "other.toml")
    for content in (b"", b"no NetCDF", whole[: len(whole) // 2], (tmp_path / "other.nc").read_bytes()):
        beside.write_bytes(content)
        with pytest.raises(
            ExperimentError, match=r"uncertainty: .*model\.nc is there, and is not what was written with this file"
        ):
            load_model(path)


def test_a_file_that_was_cut_off_is_refused_wherever_it_was_cut(tmp_path: Path) -> None:
    fitted = fitted_model().save(tmp_path / "model.toml")
    presets = model_of_presets("flexinol_table_3_2", "dead_weight", "voltage").save(tmp_path / "presets.toml")
    for path in (fitted, presets):
        text = path.read_text(encoding="utf-8")
        lines = text.splitlines(keepends=True)
        last = lines.index("[made_with]\n")
        cuts = {"".join(lines[:count]) for count in range(1, last + 1)}
        cuts.add(text[: text.index("#", 900) + 5])  # within a comment, which leaves a line that can be read
        for cut in cuts:
            path.write_text(cut, encoding="utf-8")
            with pytest.raises(
                ExperimentError, match=r"its last section, \[made_with\], is missing: the file was cut off"
            ):
                load_model(path)
        # Written by hand, without the first line of the program, a file may end where it likes.
        path.write_text(text[text.index("format = ") : text.index("[made_with]")], encoding="utf-8")
        assert not load_model(path).warnings


def test_a_value_that_the_fit_wrote_and_the_text_lacks_is_named_as_missing(tmp_path: Path) -> None:
    path = fitted_model().save(tmp_path / "model.toml")
    lines = path.read_text(encoding="utf-8").splitlines(keepends=True)
    gone = ("specific_heat = ", "wire_diameter = ")  # a fitted one and a given one
    path.write_text("".join(one for one in lines if not one.startswith(gone)), encoding="utf-8")
    model = load_model(path)
    fitted, given = model.warnings
    assert (
        "missing in [parameters], where the fit wrote a line of each: specific_heat (559.4, now 322 J/(kg K)); what"
        in fitted
    )
    assert "missing in [parameters], where the fit wrote a line of each: wire_diameter (0.00031, now 0.000" in given
    assert model.parameters["specific_heat"].origin == "preset"
    assert model.likely[0].names == ("convection_coefficient", "latent_heat.enthalpy")


def test_no_other_name_and_no_folder_are_written_to(tmp_path: Path) -> None:
    with pytest.raises(ExperimentError, match=r"expected a name that ends in \.toml"):
        fitted_model().save(tmp_path / "model.nc")
    with pytest.raises(ExperimentError, match="there is no such file; expected a model file"):
        load_model(tmp_path / "none.toml")
