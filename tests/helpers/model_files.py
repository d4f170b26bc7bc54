"""A fitted model for tests of files, and how two are compared and a file is changed."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np

from smajax.core.parameters import parameter_values
from smajax.data.experiment.record import Prior
from smajax.data.experiment.schema import ChannelSection, LogFormat, SamplingSection, TimeSection
from smajax.data.model_file.actuator_model import ActuatorModel
from smajax.data.model_file.of_presets import model_of_presets
from smajax.data.model_file.record import FittedRun, LikelyModel, ModelOutput, ModelParameter
from smajax.model.extended import extended
from smajax.model.presets import build

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


def same(one: ActuatorModel, other: ActuatorModel) -> None:
    """Equal in every field; the covariances as arrays. `as_fitted` is of a model that was read."""
    for field in dataclasses.fields(ActuatorModel):
        if field.name not in ("likely", "as_fitted"):
            assert getattr(one, field.name) == getattr(other, field.name), field.name
    for mine, its in zip(one.likely, other.likely, strict=True):
        np.testing.assert_array_equal(mine.covariance, its.covariance)
        empty = np.zeros((0, 0))
        assert dataclasses.replace(mine, covariance=empty).__dict__.keys() == its.__dict__.keys()
        for name in ("effects", "probability", "values", "names", "priors"):
            assert getattr(mine, name) == getattr(its, name), name


def edited(path: Path, *changes: tuple[str, str]) -> Path:
    text = path.read_text(encoding="utf-8")
    for old, new in changes:
        assert old in text, old
        text = text.replace(old, new, 1)
    path.write_text(text, encoding="utf-8")
    return path
