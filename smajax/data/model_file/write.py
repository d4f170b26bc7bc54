"""A `ModelRecord` as `model.toml`, and `model.nc` beside it: covariance, priors and alternatives of what was fitted."""

from __future__ import annotations

import hashlib
from importlib import metadata
from pathlib import Path
from typing import Any

from smajax.core.files import as_netcdf, replace
from smajax.data.experiment.errors import ExperimentError
from smajax.data.experiment.toml_file import Section, quantity, toml_key, toml_value
from smajax.data.model_file.record import ModelParameter, ModelRecord, range_unit
from smajax.data.model_file.schema import FIRST_LINE, FORMAT, LAST_SECTION
from smajax.data.model_file.uncertainty import uncertainty_of

HEAD = f"""\
{FIRST_LINE}`smajax predict`, `simulate`, `sweep`, `tune`, and `[model] file = "..."` of an experiment file.
# A value may be changed by hand: its line becomes name = "number unit", which is taken as known."""


DIGITS = 10  # of a fitted value in the text, where the NetCDF file has all


def write_model(model: ModelRecord, path: Path) -> Path:
    """Write `path` and, where anything was fitted, the NetCDF file of the same name. Each is there whole or not at all.

    Raises ExperimentError for a name without `.toml`.
    """
    if path.suffix != ".toml":
        raise ExperimentError(path, "", "expected a name that ends in .toml, such as model.toml")
    beside = path.with_suffix(".nc")
    if model.likely:
        # First, so that a file that names it never lacks it.
        content = as_netcdf(uncertainty_of(model))
        replace(beside, content)
        replace(path, model_text(model, beside.name, hashlib.sha256(content).hexdigest()))
    else:
        replace(path, model_text(model))
    return path


def model_text(model: ModelRecord, uncertainty: str = "", sha256: str = "") -> str:
    """The text of the file. `uncertainty`: name of the NetCDF file beside it, and `sha256` its digest."""
    lines = [HEAD, f"format = {FORMAT}", f"title = {toml_value(model.title)}"]
    if model.unfinished:
        lines.append(f"unfinished = {toml_value(model.unfinished)}  # were still to come when this was written")
    if uncertainty:
        lines.append(f"uncertainty = {toml_value(uncertainty)}  # covariance and priors of the fitted values")
        lines.append(f"uncertainty_sha256 = {toml_value(sha256)}")
        lines.append(f"probability = {model.likely[0].probability!r}  # of this set of effects")
    if model.log_format is not None and model.log_format.decimal:
        lines.append(f"decimal = {toml_value(model.log_format.decimal)}  # the decimal mark of the logs")
    parts = {"wire": model.wire, "load": model.load, "drive": model.drive, "law": model.law}
    lines += ["", "[model]", *(f"{key} = {toml_value(name)}" for key, name in parts.items() if name)]
    lines += [f"effects = {toml_value(model.effects)}", "", "[parameters]"]
    kept = model.likely[0].values if model.likely else {}
    for name, one in model.parameters.items():
        known = model.table[name]
        lines.append(f"{toml_key(name)} = {_parameter(one, known.unit, name in kept)}  # {known.about}")
    for output in model.outputs:
        lines += ["", f"[outputs.{toml_key(output.name)}]", f"noise = {_quantity(output.noise, output.unit)}"]
        if output.reading_noise is not None:
            noise = _quantity(output.reading_noise, output.unit)
            lines.append(
                f"reading_noise = {noise}  # of a single reading, by its neighbours: the noise of a sample is that of the fit"
            )
        lines.append(f"offset = {toml_value(output.offset)}  # whether each run has its own zero")
        if output.prediction_error is not None:
            error = _quantity(output.prediction_error, output.unit)
            lines.append(
                f"prediction_error = {error}  # on average nine of ten samples of runs that the fit did not see stay within"
            )
    for other in model.likely[1:]:
        lines += [
            "",
            "[[alternatives]]",
            f"effects = {toml_value(other.effects)}",
            f"probability = {other.probability!r}",
        ]
    if model.fitted_range:
        lines += ["", "[fitted_range]  # of the runs that it was fitted to: beyond it is extrapolation"]
        for name, ends in model.fitted_range.items():
            unit = range_unit(name, model.table)
            lines.append(f"{toml_key(name)} = {toml_value([quantity(end, unit, max(ends, key=abs)) for end in ends])}")
    if model.log_format is not None:
        lines += _log_format(model.log_format)
    for run in model.runs:
        lines += ["", "[[fitted_to]]", f"run = {toml_value(run.name)}", f"role = {toml_value(run.role)}"]
        lines.append(f"sha256 = {toml_value(run.sha256)}")
    made = {"smajax": metadata.version("smajax"), **model.made_with}
    lines += ["", f"[{LAST_SECTION}]", *(f"{toml_key(name)} = {toml_value(value)}" for name, value in made.items())]
    return "\n".join(lines) + "\n"


def _parameter(one: ModelParameter, unit: str, kept: bool) -> str:
    """`kept`: the NetCDF file has every digit."""
    if one.origin == "given":
        return _quantity(one.value, unit)
    value = float(f"{one.value:.{DIGITS}g}") if kept else one.value
    like = value or one.high
    entries = {"value": _quantity(value, unit, like)}
    if one.origin == "fitted":
        if one.standard_error is not None:
            entries["standard_error"] = _quantity(one.standard_error, "K" if unit == "degC" else unit, like)
        entries |= {"low": _quantity(one.low, unit, like), "high": _quantity(one.high, unit, like)}
    entries["origin"] = toml_value(one.origin)
    return f"{{ {', '.join(f'{key} = {value}' for key, value in entries.items())} }}"


def _log_format(shown: Section) -> list[str]:
    """[channels], [time] and [sampling], as in an experiment file."""
    content = shown.model_dump(exclude_defaults=True)
    lines: list[str] = []
    for name, channel in content.pop("channels").items():
        lines += ["", f"[channels.{toml_key(name)}]", *_entries(channel)]
    content.pop("decimal", None)  # at the head of the file
    for name, section in content.items():
        lines += ["", f"[{name}]", *_entries(section)]
    return lines


def _entries(section: dict[str, Any]) -> list[str]:
    return [f"{toml_key(name)} = {toml_value(value)}" for name, value in section.items() if value is not None]


def _quantity(value: float, unit: str, like: float | None = None) -> str:
    return toml_value(quantity(value, unit, like))
