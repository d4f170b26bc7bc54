"""Measured logs for a model: read as those that it was fitted to, else by guessed columns as a draft of an experiment is."""

from __future__ import annotations

import os
import tomllib
from collections.abc import Mapping, Sequence
from pathlib import Path

from smajax.data.experiment.draft import draft
from smajax.data.experiment.draft_model import ModelChoice
from smajax.data.experiment.errors import ExperimentError
from smajax.data.experiment.load import experiment_of
from smajax.data.experiment.record import Experiment
from smajax.data.experiment.schema import DataSection, ExperimentFile, LogFormat, ModelSection, RunSection, is_counted
from smajax.data.experiment.toml_file import Quantity, quantity, validated
from smajax.data.model_catalogue import CATALOGUE
from smajax.data.model_file.outputs_there import by_outputs_there, with_outputs_of_model
from smajax.data.model_file.record import ModelRecord
from smajax.data.readers.table import MeasuredDataError


def read_logs(
    model: ModelRecord,
    files: Sequence[str | Path],
    inputs: Mapping[str, Quantity] | None = None,
    parameters: Mapping[str, Quantity] | None = None,
    decimal: str = "",
) -> tuple[Experiment, tuple[str, ...]]:
    """(the logs as runs of the model, a message for each guess about them).

    A log is read by the channels in the model's file; where it has no such columns, by a guess at its own, and where that fails by those of
    the channels that it has, with one output at least. An output of the model that a log has not is one without a sample there. inputs: constants that no
    log has, as `{"mass": "0.2 kg"}`. parameters: values of these runs that replace the model's. decimal: the decimal mark, where the
    logs do not determine it. Raises ExperimentError, whose message names the file.
    """
    paths = [Path(file) for file in files]
    if not paths:
        raise ValueError("No log was given: name at least one file.")
    if gone := [path for path in paths if not path.is_file()]:
        raise ExperimentError(gone[0], "", "there is no such file; expected a log, or an experiment file")
    folder = Path(os.path.commonpath([path.resolve().parent for path in paths]))
    constants, own = dict(inputs or {}), dict(parameters or {})
    missed: ExperimentError | None = None
    if model.log_format is not None:
        runs = _runs(paths, folder, constants, own)
        try:
            return _experiment(model, model.log_format, folder, runs, decimal), ()
        except ExperimentError as error:
            missed = error
    try:
        file, messages = _guessed(model, paths, folder, decimal)
        lacking = _lacking(model, file, constants)
        if not lacking:
            runs = [run.model_copy(update={"inputs": constants, "parameters": own, "role": "fit"}) for run in file.runs]
            found, not_there = with_outputs_of_model(model, _experiment(model, file.log_format, folder, runs, decimal))
            return found, (*messages, *not_there)
        refused = ExperimentError(
            paths[0],
            "",
            f"no column for the input {lacking!r}, which the runs that the model was fitted to have; rename the column, or give a constant "
            f"with --input {lacking}=...",
        )
    except (ExperimentError, MeasuredDataError) as error:
        refused = missed or ExperimentError(
            paths[0], "", f"{error}; or give an experiment file, which says what its columns are"
        )
    there = None
    if missed is not None and model.log_format is not None:
        runs = _runs(paths, folder, constants, own)
        known_format = model.log_format.model_copy(update={"decimal": decimal or model.log_format.decimal})
        there = by_outputs_there(
            known_format, runs, folder, lambda known, some: _experiment(model, known, folder, some, decimal)
        )
    if there is None:
        raise refused
    return with_outputs_of_model(model, there)


def _runs(
    paths: Sequence[Path], folder: Path, inputs: Mapping[str, Quantity], parameters: Mapping[str, Quantity]
) -> list[RunSection]:
    """A run a file, named as its file; the roles mean nothing here."""
    stems = [path.stem for path in paths]
    names = stems if len(set(stems)) == len(stems) else [str(path) for path in paths]
    return [
        RunSection(
            name=name,
            role="fit",
            file=path.resolve().relative_to(folder).as_posix(),
            inputs=dict(inputs),
            parameters=dict(parameters),
        )
        for name, path in zip(names, paths, strict=True)
    ]


def _guessed(
    model: ModelRecord, paths: Sequence[Path], folder: Path, decimal: str
) -> tuple[ExperimentFile, tuple[str, ...]]:
    """A draft of an experiment of the model's wire, load and drive. Raises MeasuredDataError."""
    drafted = draft(paths, folder / "logs.toml", "logs", ModelChoice(model.load, model.wire, model.drive), decimal)
    file = validated(paths[0], tomllib.loads(drafted.text), ExperimentFile, {(): ExperimentFile})
    known = model.log_format
    if known is not None and known.sampling is not None and (file.sampling or is_counted(known.time)):
        file = file.model_copy(update={"sampling": known.sampling})
    return file, tuple(message for message in drafted.messages if message not in drafted.of_bench)


def _lacking(model: ModelRecord, file: ExperimentFile, constants: Mapping[str, Quantity]) -> str:
    """The first input of the model's own logs that none of these columns is; "" where they have all."""
    channels = {} if model.log_format is None else model.log_format.channels
    inputs = [name for name, one in channels.items() if one.role == "input"]
    return next((name for name in inputs if name not in file.channels and name not in constants), "")


def _experiment(
    model: ModelRecord, log_format: LogFormat, folder: Path, runs: Sequence[RunSection], decimal: str
) -> Experiment:
    """The logs as an experiment in which the model's values are known. Raises ExperimentError."""
    constant = {name for run in runs for name in run.inputs}
    channels = {name: one for name, one in log_format.channels.items() if name not in constant}
    table = model.table
    values = {name: quantity(one.value, table[name].unit) for name, one in model.parameters.items()}
    file = ExperimentFile(
        title=model.title,
        model=ModelSection(wire=model.wire, load=model.load, drive=model.drive, law=model.law, parameters=values),
        sampling=log_format.sampling,
        time=log_format.time,
        channels=channels,
        data=DataSection(folder=".", decimal=decimal or log_format.decimal),  # type: ignore[arg-type]
        runs=list(runs),
    )
    # A name in the folder of the logs stands for that of an experiment file: there is none.
    try:
        return experiment_of(folder / Path(str(runs[0].file)).name, file, CATALOGUE)
    except ExperimentError as error:
        raise _of_its_log(error, folder, runs) from error


def _of_its_log(error: ExperimentError, folder: Path, runs: Sequence[RunSection]) -> ExperimentError:
    """The error with the log of the run that it is about, or the first one, in the place of an experiment file."""
    about = [run for run in runs if f"{error.key}.".startswith(f"runs.{run.name}.")]
    log = folder / str(max(about, key=lambda run: len(run.name), default=runs[0]).file)
    message = str(error).removeprefix(f"{error.path}: ").removeprefix(f"{error.key}: ")
    key = error.key
    if message.startswith(f"{log}: "):
        # The key is that of the file, whose name stands before it.
        key, message = "", message.removeprefix(f"{log}: ")
    return ExperimentError(log, key, message)
