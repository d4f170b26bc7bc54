"""The values that an experiment file gives, and those that it leaves to be found."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import Path

from smajax.core.display_units import unit_meant
from smajax.core.units import parse_quantity
from smajax.core.wording import and_listed
from smajax.data.experiment.catalogue import ModelDescription, ParameterInfo
from smajax.data.experiment.errors import ExperimentError, at_key, check_parameter
from smajax.data.experiment.record import RUN_STARTS, Prior, Unknown
from smajax.data.experiment.schema import BoxSection, ExperimentFile, PriorSection
from smajax.data.experiment.toml_file import Quantity, quantity

CELSIUS = ParameterInfo("degC", -273.15, 1500.0)  # of a wire as a run starts, which no parameter says
START = "initial_temperature"


def bounded(path: Path, key: str, value: Quantity, info: ParameterInfo) -> float:
    """One parameter value in the program's own unit, inside what makes physical sense."""
    bare = _bare(value)
    meant = None if bare is None else unit_meant(bare, info.unit, info.low, info.high, info.preset)
    if bare is not None and meant is None and info.unit not in ("-", "1"):
        like = quantity(info.low if info.preset is None else float(f"{info.preset:.3g}"), info.unit)
        raise ExperimentError(
            path,
            key,
            f"got {value!r} without a unit; expected {info.low:g} to {info.high:g} {info.unit}, written like {like!r}",
        )
    with at_key(path, key):
        number = parse_quantity(value, info.unit, offered=meant or "", also=info.also)
    if not info.low <= number <= info.high:
        raise ExperimentError(
            path,
            key,
            f"got {value!r}, that is {number:g} {info.unit}; expected {info.low:g} to {info.high:g} {info.unit}",
        )
    return number


def _bare(value: Quantity) -> float | None:
    """A finite number without a unit; None of other text."""
    try:
        number = float(value)
    except ValueError:
        return None
    return number if math.isfinite(number) else None


def _presets(file: ExperimentFile) -> str:
    return f"{file.model.wire} {file.model.load} {file.model.drive}"


def given_parameters(
    path: Path, key: str, values: Mapping[str, Quantity], file: ExperimentFile, known: Mapping[str, ParameterInfo]
) -> dict[str, float]:
    """Known values in the program's own units; none of them an unknown too."""
    result: dict[str, float] = {}
    for name, value in values.items():
        where = f"{key}.{name}"
        check_parameter(path, where, name, known, _presets(file))
        if name in file.unknown:
            raise ExperimentError(path, where, f"is given here and is an unknown too; remove this or [unknown.{name}]")
        result[name] = bounded(path, where, value, known[name])
    return result


def parameters_of_runs(path: Path, file: ExperimentFile, model: ModelDescription) -> dict[str, dict[str, float]]:
    """Known values of each run, by its name: of parameters, and the wire's temperature as it starts where no channel gives that."""
    known = dict(model.parameters)
    if "temperature" not in model.inputs_required and file.nuisance.initial_temperature is None:
        known[START] = CELSIUS
    found = {
        run.name: given_parameters(path, f"runs.{run.name}.parameters", run.parameters, file, known)
        for run in file.runs
    }
    without = [name for name, own in found.items() if START not in own]
    if without and len(without) < len(found):
        raise ExperimentError(
            path,
            f"runs.{without[0]}.parameters.{START}",
            "is missing, and other runs have it; give that of every run, or of none (at rest at the air's temperature)",
        )
    return found


def _prior(path: Path, key: str, section: PriorSection, info: ParameterInfo, low: float) -> Prior:
    mean = bounded(path, f"{key}.mean", section.mean, info)
    if section.log_sigma is not None:
        if mean <= 0.0 or low < 0.0:
            what = f"mean = {section.mean!r}" if mean <= 0.0 else "a box that begins below zero"
            raise ExperimentError(
                path, f"{key}.log_sigma", f"got {what}, which has no logarithm; give sigma = 'number unit' instead"
            )
        return Prior(mean, section.log_sigma, True)
    with at_key(path, f"{key}.sigma"):
        sigma = parse_quantity(section.sigma or 0.0, info.unit, difference=True, also=info.also)
    if sigma <= 0.0:
        raise ExperimentError(path, f"{key}.sigma", f"got {section.sigma!r}, expected a standard deviation above zero")
    return Prior(mean, sigma, False)


def _unknown(path: Path, key: str, name: str, section: BoxSection, info: ParameterInfo, per_run: bool) -> Unknown:
    low = bounded(path, f"{key}.low", section.low, info)
    high = bounded(path, f"{key}.high", section.high, info)
    start = bounded(path, f"{key}.start", section.start, info)
    if low >= high:
        raise ExperimentError(
            path, f"{key}.low", f"got {section.low!r}, which is not below high = {section.high!r}; exchange the two"
        )
    if not low <= start <= high:
        raise ExperimentError(
            path,
            f"{key}.start",
            f"got {section.start!r}, expected between {section.low!r} and {section.high!r}; move the start into the box, or the "
            "box to it",
        )
    prior = None if section.prior is None else _prior(path, f"{key}.prior", section.prior, info, low)
    return Unknown(name, info.unit, low, high, start, per_run, prior)


def unknowns(path: Path, file: ExperimentFile, known: Mapping[str, ParameterInfo]) -> tuple[Unknown, ...]:
    """Every section [unknown.NAME], the fixed ones too."""
    for name in file.unknown:
        check_parameter(path, f"unknown.{name}", name, known, _presets(file))
    return tuple(
        _unknown(path, f"unknown.{name}", name, section, known[name], section.per_run)
        for name, section in file.unknown.items()
    )


def preset_warnings(wire: str, free: Sequence[Unknown], known: Mapping[str, ParameterInfo]) -> list[str]:
    """Boxes that leave out what the presets have: those of another wire, mostly, that stayed when the wire was changed."""
    outside = []
    for one in free:
        value = known[one.name].preset if one.name in known else None
        slack = 1e-9 * (one.high - one.low)  # what a conversion of units leaves
        if value is not None and not one.low - slack <= value <= one.high + slack:
            outside.append(
                f"{one.name} = {value:.4g} {one.unit} (box: {one.low:g} to {one.high:g})".replace(" - ", " ")
            )
    if not outside:
        return []
    return [
        f"[unknown]: the preset's own value lies outside the box of {and_listed(outside)}. Were the boxes written for another wire "
        f"than {wire!r}? `smajax new-experiment LOG --wire {wire}` writes its own; else move low and high, or leave them where you know "
        "that your bench differs"
    ]


def run_starts(path: Path, file: ExperimentFile, model: ModelDescription) -> tuple[Unknown, ...]:
    """What each run starts with and nobody measured."""
    result = []
    for name, parameter in RUN_STARTS.items():
        section: BoxSection | None = getattr(file.nuisance, name)
        if section is None:
            continue
        key = f"nuisance.{name}"
        if name == "initial_temperature" and "temperature" in model.inputs_required:
            raise ExperimentError(path, key, "the temperature of this load is an input: remove this section")
        places = {"model.parameters": set(file.model.parameters), "unknown": set(file.unknown)}
        places |= {f"runs.{run.name}.parameters": set(run.parameters) for run in file.runs}
        given = [place for place, names in places.items() if parameter in names]
        if given:
            raise ExperimentError(path, key, f"is {parameter!r}, which {given[0]} gives too; remove one of the two")
        result.append(_unknown(path, key, name, section, model.parameters.get(parameter, CELSIUS), True))
    return tuple(result)
