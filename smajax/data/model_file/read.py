"""`model.toml` back to an `ActuatorModel`, checked as an experiment file is."""

from __future__ import annotations

import hashlib
from collections.abc import Container, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from smajax.core.parameters import parameter_values, parameters
from smajax.core.units import parse_quantity
from smajax.data.experiment.catalogue import ParameterInfo
from smajax.data.experiment.errors import ExperimentError, at_key, check_name, check_parameter
from smajax.data.experiment.toml_file import Quantity, read_toml, validated
from smajax.data.experiment.unknowns import bounded
from smajax.data.model_catalogue import CATALOGUE, check_together
from smajax.data.model_file.actuator_model import ActuatorModel
from smajax.data.model_file.edits import change, missing, same, without_edits
from smajax.data.model_file.record import (
    STATE_UNITS,
    FittedRun,
    LikelyModel,
    ModelOutput,
    ModelParameter,
    range_unit,
)
from smajax.data.model_file.schema import FIRST_LINE, FORMAT, LAST_SECTION, PLACES, ModelFile, ParameterSection
from smajax.data.model_file.uncertainty import read_uncertainty
from smajax.model.channels import INPUT_UNITS
from smajax.model.extended import extended
from smajax.model.presets import build
from smajax.model.system import System
from smajax.model.wire.order import disorder
from smajax.simulation.sensors import sensors_of


def load_model(path: str | Path) -> ActuatorModel:
    """The model in a file, or in the folder of a `model.toml`.

    Parameters that the file leaves out have the presets' values. Raises ExperimentError, whose message names the file, the
    key, what was got, what was expected and what to do.
    """
    path = Path(path)
    if path.is_dir():
        path = path / "model.toml"
    hint = "; `smajax close-loop` and `smajax identify` write model files" if path.suffix != ".toml" else ""
    content = read_toml(path, "a model file", ", or the folder of a model.toml", hint)
    _check_kind(path, content)
    _check_whole(path, content)
    file = validated(path, content, ModelFile, PLACES)
    model = _model(path, file)
    if file.unfinished:
        said = f"{path}: of a loop that was not finished: {file.unfinished} were still to come"
        model = replace(model, unfinished=file.unfinished, warnings=(said,))
    if file.uncertainty is None:
        return model
    return _with_uncertainty(path, file, model)


def _check_kind(path: Path, content: Mapping[str, Any]) -> None:
    """Raises ExperimentError for an experiment file, and for a file of a later version."""
    if "format" not in content and ("runs" in content or "unknown" in content):
        raise ExperimentError(
            path, "", "is an experiment file, expected a model file; `smajax close-loop` makes one from it"
        )
    number = content.get("format", FORMAT)
    if isinstance(number, int) and not isinstance(number, bool) and not 1 <= number <= FORMAT:
        later = "; it is from a later version of smajax: install that one" if number > FORMAT else ""
        known = f"1 to {FORMAT}" if FORMAT > 1 else f"{FORMAT}"
        raise ExperimentError(path, "format", f"got {number}, expected {known}{later}")


def _check_whole(path: Path, content: Mapping[str, Any]) -> None:
    """Raises ExperimentError for a file that the program wrote and that was cut off: what it lost would be the presets' values."""
    if LAST_SECTION not in content and path.read_text(encoding="utf-8-sig").startswith(FIRST_LINE):
        raise ExperimentError(
            path,
            "",
            f"its last section, [{LAST_SECTION}], is missing: the file was cut off. Copy it again, with the .nc file beside it, or write it "
            "again; if you removed that section yourself, remove the comment in the first lines too",
        )


def _model(path: Path, file: ModelFile) -> ActuatorModel:
    """Without what stands in the NetCDF file."""
    part = file.model
    for key, kind, name, known in (
        ("wire", "wire", part.wire, CATALOGUE.wires),
        ("load", "load", part.load, CATALOGUE.loads),
        ("drive", "drive", part.drive, CATALOGUE.drives),
        *([("law", "law", part.law, CATALOGUE.laws)] if part.law else []),
        *(("effects", "effect", name, CATALOGUE.effects) for name in part.effects),
        *(
            (f"alternatives.[{k + 1}].effects", "effect", name, CATALOGUE.effects)
            for k, one in enumerate(file.alternatives)
            for name in one.effects
        ),
    ):
        check_name(path, key if key.startswith("alternatives") else f"model.{key}", kind, name, known)
    system = extended(build(part.wire, part.load, part.drive, part.law), part.effects)
    try:
        check_together(system, part.load, part.drive)
    except ValueError as error:
        raise ExperimentError(path, "model", str(error)) from error
    table = {
        entry.name: ParameterInfo(entry.unit, entry.low, entry.high, also=entry.also)
        for entry in parameters(system).values()
    }
    presets = f"{part.wire} {part.load} {part.drive}"
    for name in file.parameters:
        _check_parameter(path, name, table, presets, part.effects)
    preset = {
        name: ModelParameter(value, "preset", table[name].low, table[name].high)
        for name, value in parameter_values(system).items()
    }
    given = {name: _parameter(path, name, one, table[name]) for name, one in file.parameters.items()}
    model = ActuatorModel(
        title=file.title,
        wire=part.wire,
        load=part.load,
        drive=part.drive,
        law=part.law,
        effects=tuple(one.effect_name for one in system.effects),
        parameters={**preset, **given},
        outputs=_outputs(path, file, sensors_of(system)),
        fitted_range={name: _range(path, name, ends, system) for name, ends in file.fitted_range.items()},
        runs=tuple(FittedRun(one.run, one.role, one.sha256) for one in file.fitted_to),
        log_format=file.log_format,
        made_with={name: text for name, text in file.made_with.items() if name != "smajax"},
    )
    contradiction = disorder(model.system)
    if contradiction is not None:
        raise ExperimentError(path, f"parameters.{contradiction[0]}", contradiction[2])
    return model


def _check_parameter(
    path: Path, name: str, table: Mapping[str, ParameterInfo], presets: str, effects: list[str]
) -> None:
    effect = name.split(".")[0]
    if "." in name and effect not in effects and effect in CATALOGUE.effects:
        raise ExperimentError(
            path,
            f"parameters.{name}",
            f"is of an effect that the model has not; add {effect!r} to [model] effects, or remove it",
        )
    check_parameter(path, f"parameters.{name}", name, table, presets)


def _parameter(path: Path, name: str, given: ParameterSection, info: ParameterInfo) -> ModelParameter:
    key = f"parameters.{name}"
    low = info.low if given.low is None else bounded(path, f"{key}.low", given.low, info)
    high = info.high if given.high is None else bounded(path, f"{key}.high", given.high, info)
    if low >= high:
        raise ExperimentError(
            path,
            f"{key}.low",
            f"got {low:g} {info.unit}, which is not below the high end, {high:g} {info.unit}; exchange them",
        )
    error = None
    if given.standard_error is not None:
        with at_key(path, f"{key}.standard_error"):
            error = parse_quantity(given.standard_error, info.unit, difference=True, also=info.also)
        if error < 0.0:
            raise ExperimentError(path, f"{key}.standard_error", f"got {given.standard_error!r}, expected zero or more")
    return ModelParameter(bounded(path, key, given.value, info), given.origin, low, high, error)


def _outputs(path: Path, file: ModelFile, sensors: Mapping[str, str]) -> tuple[ModelOutput, ...]:
    result = []
    for name, one in file.outputs.items():
        check_name(path, f"outputs.{name}", "output", name, sensors)
        numbers: dict[str, float | None] = {}
        for key in ("noise", "prediction_error", "reading_noise"):
            given = getattr(one, key)
            if given is None:
                numbers[key] = None
                continue
            with at_key(path, f"outputs.{name}.{key}"):
                number = parse_quantity(given, sensors[name], difference=True)
            if not number > 0.0:
                raise ExperimentError(path, f"outputs.{name}.{key}", f"got {given!r}, expected a size above zero")
            numbers[key] = number
        more = numbers["prediction_error"], numbers["reading_noise"]
        result.append(ModelOutput(name, sensors[name], numbers["noise"] or 0.0, one.offset, *more))
    return tuple(result)


def _range(path: Path, name: str, ends: list[Quantity], system: System) -> tuple[float, float]:
    key, table = f"fitted_range.{name}", parameters(system)
    check_name(path, key, "quantity", name, (*STATE_UNITS, *INPUT_UNITS, *table))
    if len(ends) != 2:
        raise ExperimentError(path, key, f"got {len(ends)} values, expected two, the lowest and the highest")
    with at_key(path, key):
        low, high = (parse_quantity(end, range_unit(name, table)) for end in ends)
    if low > high:
        raise ExperimentError(path, key, f"got {ends[0]!r} and {ends[1]!r}, expected the lowest first; exchange them")
    return low, high


def _with_uncertainty(path: Path, file: ModelFile, model: ActuatorModel) -> ActuatorModel:
    """The model with the likely models of the NetCDF file. Values that were changed by hand are known, not fitted."""
    name = str(file.uncertainty)
    beside = path.parent / name
    if Path(name).name != name:
        raise ExperimentError(path, "uncertainty", f"got {name!r}, expected the name of a file in the same folder")
    without = "or remove the key `uncertainty`, and predict without the parameters' uncertainty"
    remedy = f"copy the two files again from where they were written, {without}"
    try:
        content = beside.read_bytes()
    except FileNotFoundError:
        raise ExperimentError(
            path,
            "uncertainty",
            f"there is no file {beside}, which was written with this one; put it beside this file, {without}",
        ) from None
    except (OSError, ValueError) as error:
        raise ExperimentError(path, "uncertainty", f"{beside} cannot be read ({error}); {without}") from None
    other = f"{beside} is there, and is not what was written with this file"
    if file.uncertainty_sha256 not in (None, hashlib.sha256(content).hexdigest()):
        raise ExperimentError(
            path,
            "uncertainty",
            f"{other} (its digest is another: it was cut off, changed, or is of another fit); {remedy}",
        )
    try:
        kept = read_uncertainty(content)
    except ValueError as error:
        raise ExperimentError(path, "uncertainty", f"{other} ({error}); {remedy}") from None
    said = _with_likely(path, model, _matched(path, file, model, kept.likely), file.parameters)
    return without_edits(path, said, kept.written, file.parameters)


def _matched(path: Path, file: ModelFile, model: ActuatorModel, kept: list[LikelyModel]) -> list[LikelyModel]:
    """The model itself, then the alternatives of the text, with their probabilities; by their effects. Raises ExperimentError."""
    by_effects = {frozenset(one.effects): one for one in kept}
    if not kept:
        return []
    own = by_effects.get(frozenset(model.effects))
    if own is None:
        # Effects were added or removed by hand: what is known of the others' values is of another model.
        return [replace(kept[0], effects=model.effects, probability=1.0, names=(), covariance=np.zeros((0, 0)))]
    result = [replace(own, effects=model.effects, probability=file.probability)]
    for number, one in enumerate(file.alternatives):
        found = by_effects.get(frozenset(one.effects))
        if found is None:
            raise ExperimentError(
                path,
                f"alternatives.[{number + 1}].effects",
                f"the file of the uncertainty has no model with {' + '.join(one.effects) or 'no effects'}; remove this section",
            )
        result.append(replace(found, effects=tuple(one.effects), probability=one.probability))
    if not sum(one.probability for one in result) > 0.0:
        raise ExperimentError(path, "probability", "the probabilities of all models are zero; expected some above it")
    return result


def _with_likely(path: Path, model: ActuatorModel, likely: list[LikelyModel], there: Container[str]) -> ActuatorModel:
    """The model with its likely models. Values that were changed by hand are given ones, without an error.

    there: the parameters that the text has. A fitted one that it lacks is the preset's, as `edits` says.
    """
    if not likely:
        return model
    warnings = []
    if likely[0].values and not likely[0].names and any(one.standard_error for one in model.parameters.values()):
        warnings.append(
            f"{path}: its effects were changed by hand, so that nothing is known of the fitted values' errors"
        )
    changed = _changed(likely[0], model)
    by_hand = [name for name in changed if name in there or name not in model.parameters]
    if by_hand:
        warnings.append(
            f"{path}: changed by hand and taken as known: {', '.join(by_hand)}; the other fitted values keep their covariance"
        )
    if gone := [change(model, name, likely[0].values[name]) for name in changed if name not in by_hand]:
        warnings.append(f"{path}: {missing(gone)}")
    kept = tuple(_without(one, changed) for one in likely)
    exact = {
        name: replace(model.parameters[name], value=value)  # every digit of what the text has rounded
        for name, value in kept[0].values.items()
        if name in model.parameters
    }
    given = {
        name: replace(model.parameters[name], origin="given", standard_error=None)
        for name in by_hand
        if name in model.parameters
    }
    values = {**model.parameters, **exact, **given}
    return replace(model, parameters=values, likely=kept, warnings=(*model.warnings, *warnings))


def _changed(fitted: LikelyModel, model: ActuatorModel) -> list[str]:
    """Names of the fitted values that are others in the text."""
    return [
        name
        for name, value in fitted.values.items()
        if name not in model.parameters or not same(model.parameters[name].value, value)
    ]


def _without(one: LikelyModel, gone: list[str]) -> LikelyModel:
    """Without the values `gone`, over which the others are not conditioned."""
    keep = [k for k, name in enumerate(one.names) if name not in gone]
    return replace(
        one,
        values={name: value for name, value in one.values.items() if name not in gone},
        names=tuple(one.names[k] for k in keep),
        covariance=one.covariance[np.ix_(keep, keep)],
        priors={name: prior for name, prior in one.priors.items() if name not in gone},
    )
