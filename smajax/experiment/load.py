"""An experiment file and its measured files to one validated Experiment."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import lru_cache
from pathlib import Path

import numpy as np

from smajax.experiment.catalogue import Catalogue, ModelDescription, ParameterInfo
from smajax.experiment.errors import ExperimentError, at_key, check_name
from smajax.experiment.folder import data_folder
from smajax.experiment.plausibility import (
    constant_warnings,
    copy_warnings,
    length_warnings,
    quantum_warning,
    role_warnings,
    run_warnings,
    size_warnings,
)
from smajax.experiment.record import Experiment, Unknown
from smajax.experiment.schema import ExperimentFile, Quantity, read_schema
from smajax.experiment.signals import Reading, ReadRun, read_run
from smajax.measured.names import instead, listed
from smajax.measured.noise import LEAST_SAMPLES, estimate_noise
from smajax.measured.read import read_table
from smajax.units import UnitError, convert, parse_quantity

ESTIMATE = "estimate"
# A noise that a sensor may have, as an example, where the channel's own unit is too large for one or shows none.
_EXAMPLES = {"m": "0.01 mm", "Pa": "0.1 MPa", "rad": "0.1 deg", "1": "0.01 %", "-": "0.01 %"}


def _describe(path: Path, file: ExperimentFile, catalogue: Catalogue) -> ModelDescription:
    model = file.model
    check_name(path, "model.wire", "wire", model.wire, catalogue.wires)
    check_name(path, "model.load", "load", model.load, catalogue.loads)
    check_name(path, "model.drive", "drive", model.drive, catalogue.drives)
    try:
        return catalogue.describe(model.wire, model.load, model.drive)
    except ValueError as error:
        raise ExperimentError(path, "model", str(error)) from error


def _bounded(path: Path, key: str, value: Quantity, info: ParameterInfo) -> float:
    """One parameter value in the program's own unit, inside what makes physical sense."""
    with at_key(path, key):
        number = parse_quantity(value, info.unit)
    if not info.low <= number <= info.high:
        raise ExperimentError(
            path,
            key,
            f"got {value!r}, that is {number:g} {info.unit}; expected {info.low:g} to {info.high:g} {info.unit}",
        )
    return number


def _parameters(
    path: Path, key: str, values: Mapping[str, Quantity], file: ExperimentFile, known: Mapping[str, ParameterInfo]
) -> dict[str, float]:
    found: dict[str, float] = {}
    for name, value in values.items():
        where = f"{key}.{name}"
        check_name(path, where, "parameter", name, known)
        if name in file.unknown:
            raise ExperimentError(path, where, f"is given here and is an unknown too; remove this or [unknown.{name}]")
        found[name] = _bounded(path, where, value, known[name])
    return found


def _unknowns(path: Path, file: ExperimentFile, known: Mapping[str, ParameterInfo]) -> tuple[Unknown, ...]:
    found: list[Unknown] = []
    for name, section in file.unknown.items():
        key = f"unknown.{name}"
        check_name(path, key, "parameter", name, known)
        info = known[name]
        low = _bounded(path, f"{key}.low", section.low, info)
        high = _bounded(path, f"{key}.high", section.high, info)
        start = _bounded(path, f"{key}.start", section.start, info)
        if low >= high:
            raise ExperimentError(
                path, f"{key}.low", f"got {section.low!r}, which is not below high = {section.high!r}; exchange the two"
            )
        if not low <= start <= high:
            raise ExperimentError(
                path, f"{key}.start", f"got {section.start!r}, expected between {section.low!r} and {section.high!r}"
            )
        found.append(Unknown(name=name, unit=info.unit, low=low, high=high, start=start))
    return tuple(found)


def _channel_units(path: Path, file: ExperimentFile, model: ModelDescription) -> tuple[str, dict[str, str]]:
    """(name of the output, the program's own unit of every channel and input)."""
    inputs = model.inputs_required | model.inputs_optional
    units: dict[str, str] = {name: model.input_units[name] for name in inputs}
    outputs = [name for name, channel in file.channels.items() if channel.role == "output"]
    if len(outputs) != 1:
        got = f"got the outputs {listed(outputs)}" if outputs else "no channel has role = 'output'"
        raise ExperimentError(path, "channels", f"{got}; expected exactly one output channel")
    for name, channel in file.channels.items():
        key = f"channels.{name}"
        known = sorted(model.outputs if channel.role == "output" else inputs)
        if name not in known:
            raise ExperimentError(
                path,
                key,
                f"the model has no {channel.role} {name!r}{instead(name, known, f'its {channel.role}s are')}; "
                "rename the channel, remove it, or choose another load or drive",
            )
        if channel.role == "output":
            units[name] = model.outputs[name]
        with at_key(path, f"{key}.unit"):
            convert(0.0, channel.unit, units[name])
    return outputs[0], units


def _check_runs(path: Path, file: ExperimentFile, model: ModelDescription) -> None:
    """Names, roles and inputs of the runs, before any file is read."""
    inputs = model.inputs_required | model.inputs_optional
    from_files = {name for name, channel in file.channels.items() if channel.role == "input"}
    seen: set[str] = set()
    for run in file.runs:
        key = f"runs.{run.name}"
        if run.name in seen:
            raise ExperimentError(path, f"{key}.name", "is used by two runs; give each run a name of its own")
        seen.add(run.name)
        for name in run.inputs:
            check_name(path, f"{key}.inputs.{name}", "input", name, inputs)
        for name in run.files or {}:
            check_name(path, f"{key}.files.{name}", "channel", name, file.channels)
        missing = sorted(model.inputs_required - from_files - set(run.inputs))
        if missing:
            raise ExperimentError(
                path,
                "channels",
                f"the model needs the input {missing[0]!r}, which no channel gives; add [channels.{missing[0]}] with "
                f"role = 'input', or a constant in [runs.inputs] of run {run.name!r}",
            )
    if not any(run.role == "fit" for run in file.runs):
        raise ExperimentError(path, "runs", "no run has role = 'fit'; give at least one")


def _step(path: Path, file: ExperimentFile) -> float:
    by_sample = file.time is not None and file.time.kind == "sample"
    if file.sampling is None:
        if by_sample:
            return 1.0
        raise ExperimentError(path, "sampling", "is missing; expected a section [sampling] with step = '50 ms' or so")
    with at_key(path, "sampling.step"):
        step = parse_quantity(file.sampling.step, "s")
    if step <= 0.0:
        raise ExperimentError(path, "sampling.step", f"got {file.sampling.step!r}, expected a time above zero")
    if by_sample and step != 1.0:
        raise ExperimentError(path, "sampling.step", "with [time] kind = 'sample' the step is 1 s; remove [sampling]")
    return step


def _check_samples(path: Path, key: str, file: ExperimentFile, read: ReadRun, measured: int) -> None:
    """Raises ExperimentError when the run has too few samples to estimate noise from, as measured or on the clock."""
    count = min(measured, read.run.output.size)
    if count >= LEAST_SAMPLES:
        return
    # Where the file itself has too few, or one sample is one step, no other step gives more.
    remedy, where = "take a longer run", " in its file"
    if measured > count and file.sampling is not None:
        remedy, where = "take a shorter step or a longer run", f" at a step of {file.sampling.step}"
    raise ExperimentError(
        path,
        key,
        f"run {read.run.name!r} has {count} samples{where}, expected at least {LEAST_SAMPLES} to estimate noise from; "
        f"{remedy}, or give the noise",
    )


def _noise(path: Path, file: ExperimentFile, name: str, unit: str, fit: Sequence[ReadRun]) -> tuple[float, float, str]:
    """(sigma on the clock, sigma at the sensor's own rate, where it is from) of the output."""
    key = f"channels.{name}.noise"
    given = file.channels[name].noise
    example = _EXAMPLES.get(unit, f"0.01 {file.channels[name].unit}")
    gain = float(np.median([read.noise_gain for read in fit]))
    if given is not None and given != ESTIMATE:
        try:
            sensor = parse_quantity(given, unit, difference=True)
        except UnitError as error:
            raise ExperimentError(path, key, f"{error}; give a noise like '{example}', or '{ESTIMATE}'") from error
        if sensor <= 0.0:
            raise ExperimentError(
                path, key, f"got {given!r}, expected a noise above zero like '{example}', or '{ESTIMATE}'"
            )
        how = f"given as {given}" + (f", times {gain:.3g} for the average over a step" if gain < 1.0 else "")
        return sensor * gain, sensor, how
    for read in fit:
        _check_samples(path, key, file, read, read.signals[name].values.size)
    # On the clock, where the residual is; the increment is the sensor's, since averaging hides it.
    sigmas = [estimate_noise(read.run.output, read.quantum) for read in fit]
    sensors = [estimate_noise(read.signals[name].values, 0.0) for read in fit]
    sigma = float(np.median(sigmas))
    if sigma <= 0.0:
        raise ExperimentError(path, key, f"no noise can be seen in {name!r}; give it as text like '{example}'")
    return sigma, float(np.median(sensors)), f"estimated from {len(fit)} fit run{'s' if len(fit) > 1 else ''} (median)"


def load_experiment(path: str | Path, catalogue: Catalogue) -> Experiment:
    """Reads an experiment file (or the folder of an `experiment.toml`) and its runs.

    Raises ExperimentError, whose message names the file, the key, what was got, what was expected and what to do.
    """
    path = Path(path)
    if path.is_dir():
        path = path / "experiment.toml"
    file = read_schema(path)
    model = _describe(path, file, catalogue)
    fixed = _parameters(path, "model.parameters", file.model.parameters, file, model.parameters)
    unknowns = _unknowns(path, file, model.parameters)
    for key, effects in (("effects.only", file.effects.only or []), ("effects.exclude", file.effects.exclude)):
        for effect in effects:
            check_name(path, key, "effect", effect, catalogue.effects)
    output_name, units = _channel_units(path, file, model)
    _check_runs(path, file, model)
    overrides = {
        run.name: _parameters(path, f"runs.{run.name}.parameters", run.parameters, file, model.parameters)
        for run in file.runs
    }
    reading = Reading(
        path=path,
        folder=data_folder(path, file.data.folder),
        channels=file.channels,
        time=file.time,
        units=units,
        output_name=output_name,
        inputs_sampled=model.inputs_sampled,
        inputs_squared=model.inputs_squared,
        step=_step(path, file),
        tables=lru_cache(maxsize=None)(read_table),
    )
    runs = [read_run(reading, run, overrides[run.name]) for run in file.runs]
    fit = [read for read in runs if read.run.role == "fit"]
    sigma, sensor_sigma, how = _noise(path, file, output_name, units[output_name], fit)
    warnings = [text for read in runs for text in run_warnings(read, output_name, reading.step)]
    if file.time is None or file.time.kind != "sample":
        warnings += length_warnings(runs, "s" if file.time is None else file.time.unit)
    warnings += constant_warnings(runs, output_name)
    warnings += quantum_warning(fit, sensor_sigma, units[output_name])
    warnings += copy_warnings(runs)
    warnings += size_warnings(runs)
    warnings += role_warnings(file.runs)
    return Experiment(
        name=path.resolve().parent.name if path.name == "experiment.toml" else path.stem,
        title=file.title,
        path=path,
        wire=file.model.wire,
        load=file.model.load,
        drive=file.model.drive,
        parameters=fixed,
        unknowns=unknowns,
        offset=file.nuisance.offset,
        step=reading.step,
        output_name=output_name,
        output_unit=units[output_name],
        noise_sigma=sigma,
        noise_how=how,
        effects_only=tuple(file.effects.only) if file.effects.only is not None else None,
        effects_excluded=tuple(file.effects.exclude),
        runs=tuple(read.run for read in runs),
        warnings=tuple(warnings),
    )
