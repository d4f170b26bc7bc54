"""A model file that was changed by hand: what holds then, and what is said."""

from __future__ import annotations

import dataclasses
import re
from pathlib import Path

import numpy as np
import pytest

from smajax.core.parameters import parameter_values
from smajax.data.experiment.errors import ExperimentError
from smajax.data.model_file.read import load_model
from smajax.data.model_file.record import LikelyModel
from tests.helpers.model_files import COVARIANCE, LATENT, edited, fitted_model


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


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ('wire_diameter = "0.31 mm"', 'wire_diameter = "0.25 mm"', "since the fit: wire_diameter (0.00031, now 0.00025 m)"),
        (r"load_mass = \{.*", 'load_mass = "1.5 kg"', "now 1.5 kg); the fitted values and their covariance are those of a fit"),
        ('wire = "flexinol_table_3_2"', 'wire = "niti_table_3_1"', "the fit: wire (flexinol_table_3_2); the fitted values and their covariance are"),
        ('noise = "0.1 mm"', 'noise = "0.2 mm"', "[outputs] was changed by hand: the noise and the prediction error are not"),
        ('"5.462 V"', '"9 V"', "[fitted_range] was changed by hand: where a run extrapolates is not what"),
        ('role = "held-out"', 'role = "fit"', "[fitted_to] was changed by hand: it is no record of the runs of the fit"),
    ],
)  # fmt: skip
def test_what_is_changed_by_hand_beside_the_fitted_values_is_said(
    tmp_path: Path, old: str, new: str, said: str
) -> None:
    path = fitted_model().save(tmp_path / "model.toml")
    assert not load_model(path).warnings
    text, count = re.subn(old, new, path.read_text(encoding="utf-8"), count=1)
    assert count
    path.write_text(text, encoding="utf-8")
    (warning,) = load_model(path).warnings
    assert said in warning


def test_a_standard_error_that_is_changed_by_hand_is_said_and_that_of_the_covariance_holds(tmp_path: Path) -> None:
    path, before = fitted_model().save(tmp_path / "model.toml"), fitted_model().parameters["specific_heat"]
    text = path.read_text(encoding="utf-8")
    line = next(one for one in text.splitlines() if one.startswith("specific_heat"))
    head, _, rest = line.partition('standard_error = "')
    for new in (f'{head}standard_error = "9 J/kg/K"{rest[rest.index(",") :]}', head + rest[rest.index(", ") + 2 :]):
        path.write_text(text.replace(line, new), encoding="utf-8")
        model = load_model(path)
        (warning,) = model.warnings
        assert "the standard error of specific_heat was changed by hand; that of the covariance" in warning
        assert model.parameters["specific_heat"] == before
        assert model.likely[0].names == tuple(LATENT)


def test_alternatives_are_found_by_their_effects(tmp_path: Path) -> None:
    model = fitted_model()
    creep = LikelyModel(("latent_heat", "creep"), 0.05, {**LATENT, "creep.austenite": 1e-4})
    path = dataclasses.replace(model, likely=(*model.likely, creep)).save(tmp_path / "model.toml")
    section = "[[alternatives]]\neffects = []\nprobability = 0.1\n\n"
    assert load_model(edited(path, (section, ""))).likely[1].values == creep.values
    with pytest.raises(
        ExperimentError, match=r"alternatives\.\[1\]\.effects: the file of the uncertainty has no model with radiation"
    ):
        load_model(edited(path, ('effects = ["latent_heat", "creep"]', 'effects = ["radiation"]')))


def test_effects_that_are_changed_by_hand_leave_no_errors_and_no_alternatives(tmp_path: Path) -> None:
    path = fitted_model().save(tmp_path / "model.toml")
    model = load_model(edited(path, ('effects = ["latent_heat"]', 'effects = ["latent_heat", "creep"]')))
    assert [one.effects for one in model.likely] == [("latent_heat", "creep")]
    assert model.likely[0].names == ()
    assert "effects were changed by hand" in model.warnings[0]


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("specific_heat = {.*", 'specific_heat = "600 J/kg/K"', "changed by hand since the fit: specific_heat"),
        ('wire_diameter = "0.31 mm"', 'wire_diameter = "0.25 mm"', "since the fit: wire_diameter (0.00031, now 0.00025 m)"),
        (r'effects = \["latent_heat"\]', 'effects = ["latent_heat", "creep"]', "effects were changed by hand"),
    ],
)  # fmt: skip
def test_a_file_that_was_changed_by_hand_and_saved_again_still_says_so(
    tmp_path: Path, old: str, new: str, said: str
) -> None:
    path = fitted_model().save(tmp_path / "model.toml")
    text, count = re.subn(old, new, path.read_text(encoding="utf-8"), count=1)
    assert count
    path.write_text(text, encoding="utf-8")
    again = load_model(path).save(tmp_path / "again.toml")
    for _ in range(2):
        (warning,) = load_model(again).warnings
        assert said in warning
        again = load_model(again).save(tmp_path / "third.toml")
