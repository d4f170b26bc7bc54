"""An experiment file and its measured files to one validated Experiment."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import lru_cache, partial
from pathlib import Path

import numpy as np

from smajax.core.names import close_matches
from smajax.core.units import UnitError, convert, parse_quantity
from smajax.core.wording import and_listed
from smajax.data.experiment.catalogue import WIRE_SIZES, Catalogue, ModelDescription
from smajax.data.experiment.column_overrides import own_columns
from smajax.data.experiment.data_folder import data_folder
from smajax.data.experiment.declared_priors import declared_priors
from smajax.data.experiment.effect_names import check_effects, useless
from smajax.data.experiment.errors import ExperimentError, at_key, check_name
from smajax.data.experiment.from_model_file import with_model_file
from smajax.data.experiment.headings import heading_warnings
from smajax.data.experiment.magnitude import common_warnings, magnitude_warnings
from smajax.data.experiment.motion import motion_warnings
from smajax.data.experiment.plausibility import (
    constant_warnings,
    copy_warnings,
    length_warnings,
    quantum_warning,
    role_warnings,
    run_warnings,
)
from smajax.data.experiment.record import Experiment, FromModelFile, Output, Run, Unknown
from smajax.data.experiment.recorded_ambient import AMBIENT, ambient_warnings
from smajax.data.experiment.schema import ExperimentFile, is_counted, noise_example, read_schema
from smajax.data.experiment.shared_columns import check_columns
from smajax.data.experiment.signals import Reading, ReadRun, read_run, time_unit
from smajax.data.experiment.unknowns import (
    given_parameters,
    parameters_of_runs,
    preset_warnings,
    run_starts,
    unknowns,
)
from smajax.data.readers.noise import LEAST_SAMPLES, estimate_noise
from smajax.data.readers.read import read_table

ESTIMATE = "estimate"
# Times the largest reading below which, and times the range above which, a noise is none.
FINEST, COARSEST = 1e-12, 1e3


def _describe(path: Path, file: ExperimentFile, catalogue: Catalogue) -> ModelDescription:
    model = file.model
    check_name(path, "model.wire", "wire", model.wire, catalogue.wires)
    check_name(path, "model.load", "load", model.load, catalogue.loads)
    check_name(path, "model.drive", "drive", model.drive, catalogue.drives)
    if model.law:
        check_name(path, "model.law", "law", model.law, catalogue.laws)
    try:
        return catalogue.describe(model.wire, model.load, model.drive, model.law)
    except ValueError as error:
        raise ExperimentError(path, "model", str(error)) from error


def _channel_units(path: Path, file: ExperimentFile, model: ModelDescription) -> tuple[tuple[str, ...], dict[str, str]]:
    """(names of the outputs, the program's own unit of every channel and input)."""
    inputs = model.inputs_required | model.inputs_optional
    units: dict[str, str] = {name: model.input_units[name] for name in inputs}
    for name, channel in file.channels.items():
        key = f"channels.{name}"
        known = sorted(model.outputs if channel.role == "output" else inputs)
        if name not in known:
            raise ExperimentError(
                path,
                key,
                f"the model has no {channel.role} {name!r}{close_matches(name, known, f'its {channel.role}s are')}; "
                "rename the channel, remove it, or choose another load or drive",
            )
        if channel.role == "output":
            units[name] = model.outputs[name]
        with at_key(path, f"{key}.unit"):
            convert(0.0, channel.unit, units[name])
    outputs = tuple(name for name, channel in file.channels.items() if channel.role == "output")
    if not outputs:
        raise ExperimentError(path, "channels", "no channel has role = 'output'; expected at least one")
    return outputs, units


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
    for run in file.runs:
        check_columns(path, file, run)
    if not any(run.role == "fit" for run in file.runs):
        raise ExperimentError(path, "runs", "no run has role = 'fit'; give at least one")


def _has_times(file: ExperimentFile) -> bool:
    """Of its samples: counted ones have times where the file says how far apart they are."""
    return not is_counted(file.time) or file.sampling is not None


def _step(path: Path, file: ExperimentFile, heated: bool) -> float:
    """s. heated: whether a drive heats the wire, which takes its time."""
    if file.sampling is None:
        if not _has_times(file) and not heated:
            return 1.0
        if not _has_times(file):
            raise ExperimentError(
                path,
                "sampling",
                "is missing; samples are counted ([time] kind = 'sample'), and how warm a heated wire gets depends on their times: add a section "
                "[sampling] with step = '50 ms' or so, the time from one sample to the next",
            )
        raise ExperimentError(path, "sampling", "is missing; expected a section [sampling] with step = '50 ms' or so")
    with at_key(path, "sampling.step"):
        step = parse_quantity(file.sampling.step, "s", offered=time_unit(file.time))
    if step <= 0.0:
        raise ExperimentError(path, "sampling.step", f"got {file.sampling.step!r}, expected a time above zero")
    return step


def _check_samples(path: Path, key: str, name: str, file: ExperimentFile, read: ReadRun) -> None:
    """Raises ExperimentError when the run has too few samples to estimate noise from, as measured or on the clock."""
    measured = read.signals[name].measured.size
    count = min(measured, int(np.isfinite(read.run.outputs[name]).sum()))
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


def _output(path: Path, file: ExperimentFile, name: str, unit: str, runs: Sequence[ReadRun]) -> tuple[Output, float]:
    """(output, sigma of its noise at the sensor's own rate); `runs` are those of the fit."""
    key = f"channels.{name}.noise"
    channel = file.channels[name]
    given = channel.noise
    offset = file.nuisance.offset if channel.offset is None else channel.offset
    example = noise_example(channel.unit)
    fit = [read for read in runs if np.isfinite(read.run.outputs[name]).any()]
    if not fit:
        raise ExperimentError(path, f"channels.{name}", "no fit run has a sample of it; remove the channel")
    gain = float(np.median([read.noise_gain[name] for read in fit]))
    if given is not None and given != ESTIMATE:
        try:
            sensor = parse_quantity(given, unit, difference=True, offered=channel.unit)
        except UnitError as error:
            raise ExperimentError(path, key, f"{error}; give a noise like '{example}', or '{ESTIMATE}'") from error
        if sensor <= 0.0:
            raise ExperimentError(
                path, key, f"got {given!r}, expected a noise above zero like '{example}', or '{ESTIMATE}'"
            )
        readings = np.concatenate([read.signals[name].measured for read in fit])
        if sensor < FINEST * float(np.abs(readings).max()) or 0.0 < COARSEST * float(np.ptp(readings)) < sensor:
            low, high = (fit[0].signals[name].as_logged(one) for one in (readings.min(), readings.max()))
            raise ExperimentError(
                path,
                key,
                f"got {given!r}, and the readings go from {low} to {high}: no sensor has that noise there; expected one like '{example}', or '{ESTIMATE}'",
            )
        how = f"given as {given}" + (f", times {gain:.3g} for the average over a step" if gain < 1.0 else "")
        return Output(name, unit, sensor * gain, how, True, offset, sensor if gain < 1.0 else None), sensor
    for read in fit:
        _check_samples(path, key, name, file, read)
    # On the clock, where the residual is; the increment is the sensor's, since averaging hides it. Averages over windows that
    # share samples resemble their neighbours, and their differences show less than there is: of noise without a memory
    # the sensor's own rate tells what the average leaves.
    on_clock = [read.run.outputs[name] for read in fit]
    sigmas = [
        estimate_noise(values[np.isfinite(values)], read.quantum[name])
        for values, read in zip(on_clock, fit, strict=True)
    ]
    sensors = [estimate_noise(read.signals[name].measured, 0.0) for read in fit]
    averaged = [sensor * read.noise_gain[name] for sensor, read in zip(sensors, fit, strict=True)]
    sigma = max(float(np.median(sigmas)), float(np.median(averaged)))
    if sigma <= 0.0:
        raise ExperimentError(path, key, f"no noise can be seen in {name!r}; give it as text like '{example}'")
    how = f"estimated from {len(fit)} fit run{'s' if len(fit) > 1 else ''} (median)"
    sensor = float(np.median(sensors))
    single = max(sensor, sigma) if gain < 1.0 else None
    return Output(name, unit, sigma, how, False, offset, single), sensor


def _fitted_before(kept: FromModelFile, file: ExperimentFile, runs: Sequence[Run]) -> list[str]:
    """That fit runs are some that the model file was fitted to: values with its errors as priors would count them twice.

    A value that the experiment file gives, or has among its unknowns, is without that prior.
    """
    names = [name for name in kept.errors if name not in {*file.model.parameters, *file.unknown}]
    again = [run.name for run in runs if run.role == "fit" and run.sha256 in kept.fitted_to]
    if not names or not again:
        return []
    one = len(again) == 1
    who = f"run {again[0]!r} is one" if one else f"runs {and_listed([repr(name) for name in again])} are some"
    return [
        f"{who} that the model file was fitted to: in `close-loop`, whose priors are its values' errors, {'it counts' if one else 'they count'} twice "
        f"for {and_listed(names)}; under [unknown] a value is free, without that prior"
    ]


def _undetermined(kept: FromModelFile, file: ExperimentFile) -> list[str]:
    """That the model file has fitted values which no run determined, where the experiment file says nothing of them."""
    names = [name for name in kept.undetermined if name not in {*file.model.parameters, *file.unknown}]
    if not names:
        return []
    one = len(names) == 1
    return [
        f"{and_listed(names)} {'is a value' if one else 'are values'} of a fit whose runs did not determine {'it' if one else 'them'} "
        f"([model] file): `close-loop` fits {'it' if one else 'them'} again, with the prior that a value had, else with the width that "
        "data sheets leave a preset, else with that of the former bounds; `identify` only fits what [unknown] has"
    ]


def _untold(file: ExperimentFile, free: Sequence[Unknown]) -> list[str]:
    """That no size of the bench is given: the preset's are another bench's."""
    if file.model.load == "coupon" or file.model.parameters or {*WIRE_SIZES} & {one.name for one in free}:
        return []
    return [
        f"[model.parameters] gives nothing of this bench: the length and diameter of the preset wire {file.model.wire!r} and the rest "
        "of the presets are taken. Where yours differ, a wrong value is fitted or a missing effect named"
    ]


def _check_order(
    path: Path, file: ExperimentFile, model: ModelDescription, values: Mapping[str, float], place: str = ""
) -> None:
    """ExperimentError where values (known ones, and starts of unknown ones) contradict each other."""
    result = model.disorder(values)
    if result is None:
        return
    colder, warmer, what = result
    named = next((name for name in (colder, warmer) if name in file.unknown or name in values), colder)
    key = place or ("unknown" if named in file.unknown else "model.parameters")
    raise ExperimentError(path, place if place else f"{key}.{named}", what)


def _columns(file: ExperimentFile) -> frozenset[str | int]:
    """Every column that the file names."""
    keys = [key for channel in file.channels.values() for key in (channel.column, channel.variable)]
    keys += [
        file.time.column if file.time is not None else None,
        *(key for run in file.runs for key in run.columns.values()),
    ]
    return frozenset(key for key in keys if key is not None)


def load_experiment(path: str | Path, catalogue: Catalogue) -> Experiment:
    """Reads an experiment file (or the folder of an `experiment.toml`) and its runs.

    Raises ExperimentError, whose message names the file, the key, what was got, what was expected and what to do.
    """
    path = Path(path)
    if path.is_dir():
        path = path / "experiment.toml"
    return experiment_of(path, read_schema(path), catalogue)


def experiment_of(path: Path, file: ExperimentFile, catalogue: Catalogue) -> Experiment:
    """The experiment that `file` says, read from `path`, with its runs. Raises ExperimentError as `load_experiment` does."""
    file, kept = with_model_file(path, file)
    model = _describe(path, file, catalogue)
    fixed = given_parameters(path, "model.parameters", file.model.parameters, file, model.parameters)
    every = unknowns(path, file, model.parameters)
    fixed |= {unknown.name: unknown.start for unknown in every if file.unknown[unknown.name].fixed}
    free = tuple(unknown for unknown in every if unknown.name not in fixed) + run_starts(path, file, model)
    check_effects(path, file, catalogue, kept)
    priors, not_tried = declared_priors(path, file, catalogue, model, kept)
    values = (dict(kept.values) if kept else {}) | fixed | {unknown.name: unknown.start for unknown in free}
    _check_order(path, file, model, values)
    output_names, units = _channel_units(path, file, model)
    _check_runs(path, file, model)
    overrides = parameters_of_runs(path, file, model)
    for name, own in overrides.items():
        _check_order(path, file, model, {**values, **own}, f"runs.{name}.parameters")
    reading = Reading(
        path=path,
        folder=data_folder(path, file.data.folder),
        channels=file.channels,
        time=file.time,
        units=units,
        output_names=output_names,
        inputs_sampled=model.inputs_sampled,
        inputs_squared=model.inputs_squared,
        step=_step(path, file, bool(model.heats)),
        timed=_has_times(file),
        tables=lru_cache(maxsize=None)(partial(read_table, wanted=_columns(file), decimal=file.data.decimal)),
    )
    runs = [
        read_run(replace(reading, others=number > 0), run, overrides[run.name]) for number, run in enumerate(file.runs)
    ]
    outputs = [_output(path, file, name, units[name], _of_fit(runs)) for name in output_names]
    warnings = _log_warnings(file, reading, runs, outputs)
    heats = sorted(model.heats & runs[0].run.inputs.keys())
    zeroed = {output.name for output, _ in outputs if output.offset}
    scale = None if model.scale is None else model.scale(values)
    warnings += magnitude_warnings(runs, scale, heats, reading.step, zeroed)
    warnings += ambient_warnings(runs, file.channels.get(AMBIENT), scale, heats, reading.step)
    warnings += useless(file, model) + not_tried + _untold(file, free)
    warnings += [] if kept else preset_warnings(file.model.wire, free, model.parameters)
    warnings += role_warnings(file.runs)
    warnings += motion_warnings([read.run for read in runs], [output for output, _ in outputs])
    warnings += (
        []
        if kept is None
        else [
            *kept.warnings,
            *_fitted_before(kept, file, [read.run for read in runs]),
            *_undetermined(kept, file),
        ]
    )
    return Experiment(
        name=path.resolve().parent.name if path.name == "experiment.toml" else path.stem,
        title=file.title,
        path=path,
        wire=file.model.wire,
        load=file.model.load,
        drive=file.model.drive,
        law=file.model.law,
        parameters=fixed,
        unknowns=free,
        step=reading.step,
        clocked=_has_times(file),
        outputs=tuple(output for output, _ in outputs),
        effects_only=tuple(file.effects.only) if file.effects.only is not None else None,
        effects_excluded=tuple(file.effects.exclude),
        runs=tuple(read.run for read in runs),
        warnings=tuple(warnings),
        priors=priors,
        log_format=file.log_format,
        model_file=kept,
    )


def _of_fit(runs: Sequence[ReadRun]) -> list[ReadRun]:
    return [read for read in runs if read.run.role == "fit"]


def _log_warnings(
    file: ExperimentFile, reading: Reading, runs: Sequence[ReadRun], outputs: Sequence[tuple[Output, float]]
) -> list[str]:
    """Of the logs alone, whatever the model. outputs: each with the sigma of its noise at the sensor's own rate."""
    warnings = [text for read in runs for text in run_warnings(read, reading.step)]
    if _has_times(file):
        warnings += length_warnings(runs, file.time)
    warnings += heading_warnings(file.channels, file.time)
    for run in file.runs:
        warnings += heading_warnings(*own_columns(reading.path, run, file.channels, file.time), run)
    warnings += constant_warnings(runs)
    for output, sensor_sigma in outputs:
        warnings += quantum_warning(_of_fit(runs), output.name, sensor_sigma)
    return warnings + copy_warnings(runs) + common_warnings(runs, is_counted(file.time))
