"""What a model file said after its fit, and what of it was changed by hand since: such a change makes the covariance or the record untrue."""

from __future__ import annotations

import json
import math
from collections.abc import Container, Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, TypeVar

from smajax.core.display_units import digits
from smajax.core.wording import and_listed
from smajax.data.model_file.record import ModelOutput, ModelRecord

Record = TypeVar("Record", bound=ModelRecord)
CLOSE = 1e-9  # of a value: nearer than that it is the one that was written


def as_written(model: ModelRecord) -> str:
    """JSON of what the text of the file says of the bench and of the fit, SI: it is stored with the covariance."""
    return json.dumps(
        {
            "parts": _parts(model),
            "parameters": {name: [one.value, one.standard_error] for name, one in model.parameters.items()},
            "outputs": {one.name: _of_output(one) for one in model.outputs},
            "fitted_range": {name: list(ends) for name, ends in model.fitted_range.items()},
            "fitted_to": [[one.name, one.role, one.sha256] for one in model.runs],
        }
    )


def _of_output(one: ModelOutput) -> list[float | None]:
    """A file of before has nothing of single readings."""
    single = [] if one.reading_noise is None else [one.reading_noise]
    return [one.noise, one.offset, one.prediction_error, *single]


def _parts(model: ModelRecord) -> dict[str, str]:
    return {"wire": model.wire, "load": model.load, "drive": model.drive, "law": model.law}


def missing(named: Sequence[str]) -> str:
    """Of parameters that the text had after the fit and has no more, each as it is to be named."""
    are = "is" if len(named) == 1 else "are"
    return (
        f"missing in [parameters], where the fit wrote a line of each: {and_listed(named)}; what the preset has {are} taken. Put the lines back, or copy the "
        "file again: it may have been cut off"
    )


def without_edits(path: Path, model: Record, written: str, there: Container[str]) -> Record:
    """The model with a warning for each kind of change by hand, and with the standard errors that its covariance has.

    path: of the file, for the warnings. model: as its text says, with its likely models. written: of `as_written`; "" of a file from before version 0.2, of which nothing is known. Fitted values
    that were changed are for the reader of the covariance (`read`). there: the parameters that the text has.
    """
    if not written:
        return model
    before: Mapping[str, Any] = json.loads(written)
    known = {name: pair for name, pair in before["parameters"].items() if name in model.parameters}
    fitted = {name for one in model.likely[:1] for name in one.values}
    others = {
        name: value
        for name, (value, _) in known.items()
        if name not in fitted and not same(value, model.parameters[name].value)
    }
    errors = {
        name: error
        for name, (value, error) in known.items()
        if same(value, model.parameters[name].value) and not same(error, model.parameters[name].standard_error)
    }
    kept = {name: replace(model.parameters[name], standard_error=error) for name, error in errors.items()}
    warnings = (*model.warnings, *(f"{path}: {one}" for one in _sentences(model, before, others, errors, there)))
    return replace(model, parameters={**model.parameters, **kept}, warnings=warnings, as_fitted=written)


def _sentences(
    model: ModelRecord,
    before: Mapping[str, Any],
    others: Mapping[str, float],
    errors: Mapping[str, float | None],
    there: Container[str],
) -> Iterator[str]:
    parts = {kind: name for kind, name in before["parts"].items() if name != _parts(model)[kind]}
    if parts:
        named = and_listed([f"{kind} ({name or 'of the wire'})" for kind, name in parts.items()])
        yield f"changed by hand since the fit: {named}; the fitted values and their covariance are those of a fit with the former"
    if gone := [change(model, name, value) for name, value in others.items() if name not in there]:
        yield missing(gone)
    if by_hand := [change(model, name, value) for name, value in others.items() if name in there]:
        named = and_listed(by_hand)
        yield (
            f"changed by hand since the fit: {named}; the fitted values and their covariance are those of a fit with the former. Fit again "
            "for another bench; what differs in some runs alone is for --set"
        )
    if errors:
        yield (
            f"the standard error of {and_listed(list(errors))} was changed by hand; that of the covariance beside the file holds. Give the value "
            "alone, without an error, to have it taken as known"
        )
    now = json.loads(as_written(model))
    for key, what in (
        ("outputs", "the noise and the prediction error are not those of the fit, and the band is another"),
        ("fitted_range", "where a run extrapolates is not what the fit runs say"),
        ("fitted_to", "it is no record of the runs of the fit"),
    ):
        if now[key] != before[key]:
            yield f"[{key}] was changed by hand: {what}"


def change(model: ModelRecord, name: str, before: float) -> str:
    """`load_mass (0.8, now 1.2 kg)`."""
    return f"{name} ({digits(before, 4)}, now {digits(model.values[name], 4)} {model.table[name].unit})"


def same(one: float | None, other: float | None) -> bool:
    """Whether two values of a file are one but for the rounding of text; of none each is none."""
    if one is None or other is None:
        return one is other
    return math.isclose(one, other, rel_tol=CLOSE)
