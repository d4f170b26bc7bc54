"""`[model] file = "model.toml"`: the base model of an experiment is one that was kept."""

from __future__ import annotations

import hashlib
from pathlib import Path

from smajax.data.experiment.errors import ExperimentError
from smajax.data.experiment.record import FromModelFile
from smajax.data.experiment.schema import ExperimentFile, ModelSection
from smajax.data.experiment.toml_file import Quantity, quantity
from smajax.data.model_file.read import load_model


def with_model_file(path: Path, file: ExperimentFile) -> tuple[ExperimentFile, FromModelFile | None]:
    """(the experiment file with wire, load, drive, law and known values of its model file, the rest of that); None without one.

    What the model file gives is known here too, unless the experiment file has it among the unknowns or says another value. What was
    fitted, and what is the presets', is where a fit begins. Raises ExperimentError.
    """
    if file.model.file is None:
        missing = [key for key in ("wire", "load", "drive") if not getattr(file.model, key)]
        if missing:
            expected = ModelSection.model_fields[missing[0]].description
            raise ExperimentError(
                path,
                f"model.{missing[0]}",
                f"is missing; expected {expected}; or file = 'model.toml' in the place of all three",
            )
        return file, None
    place = path.parent / file.model.file
    try:
        model = load_model(place)
    except ExperimentError as error:
        raise ExperimentError(path, "model.file", str(error)) from None
    given: dict[str, Quantity] = {
        name: quantity(one.value, model.table[name].unit)
        for name, one in model.parameters.items()
        if one.origin == "given" and name not in file.unknown
    }
    section = ModelSection(
        wire=model.wire,
        load=model.load,
        drive=model.drive,
        law=model.law,
        parameters={**given, **file.model.parameters},
    )
    open_ = {name: one for name, one in model.parameters.items() if one.origin != "given"}
    fitted = {name: one for name, one in open_.items() if one.origin == "fitted"}
    source = place / "model.toml" if place.is_dir() else place
    kept = FromModelFile(
        effects=model.effects,
        values={name: one.value for name, one in open_.items()},
        errors=model.errors,
        bounds={name: (one.low, one.high) for name, one in fitted.items()},
        fitted_to={one.sha256: one.name for one in model.runs if one.role == "fit"},
        warnings=model.warnings,
        priors=dict(model.likely[0].priors) if model.likely else {},
        sha256=hashlib.sha256(source.read_bytes()).hexdigest(),
    )
    return file.model_copy(update={"model": section}), kept
