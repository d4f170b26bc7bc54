"""Logs that lack a sensor which a model was fitted to: read by what they have; the other outputs are predicted and not compared."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from smajax.core.wording import and_listed
from smajax.data.experiment.motion import motion_warnings
from smajax.data.experiment.plausibility import role_warnings
from smajax.data.experiment.record import Experiment, Output
from smajax.data.experiment.schema import ChannelSection, LogFormat, RunSection
from smajax.data.model_file.record import ModelRecord
from smajax.data.readers.read import read_table
from smajax.data.readers.table import MeasuredDataError, NoColumnError


def _place(channel: ChannelSection) -> str | int | None:
    return channel.variable if channel.variable is not None else channel.column


def _absent(path: Path, log_format: LogFormat) -> frozenset[str]:
    """Outputs of which the log has no column. Raises MeasuredDataError where it cannot be read."""
    places = {name: _place(one) for name, one in log_format.channels.items() if one.role == "output"}
    table = read_table(path, [key for key in places.values() if key is not None], log_format.decimal)
    result = set()
    for name, key in places.items():
        try:
            if key is not None:
                table.name_of(key)
        except NoColumnError:
            result.add(name)
    return frozenset(result)


def by_outputs_there(
    log_format: LogFormat,
    runs: Sequence[RunSection],
    folder: Path,
    read: Callable[[LogFormat, Sequence[RunSection]], Experiment],
) -> Experiment | None:
    """The runs, each without the outputs that its log has no column of; None where no log lacks one, or one lacks all.

    read: the experiment of runs whose logs have all channels of a format; raises ExperimentError.
    """
    try:
        absent = {run.name: _absent(folder / str(run.file), log_format) for run in runs}
    except MeasuredDataError:
        return None
    outputs = {name for name, one in log_format.channels.items() if one.role == "output"}
    if not any(absent.values()) or outputs in absent.values():
        return None
    parts = []
    for lacking in dict.fromkeys(absent.values()):
        channels = {name: one for name, one in log_format.channels.items() if name not in lacking}
        own = [run for run in runs if absent[run.name] == lacking]
        parts.append(_without_roles(read(log_format.model_copy(update={"channels": channels}), own)))
    return _joined(parts, [run.name for run in runs])


def _without_roles(experiment: Experiment) -> Experiment:
    """Without what is said of the roles of its runs, which are some of the prediction's."""
    roles = {*role_warnings(experiment.runs), *motion_warnings(experiment.runs, experiment.outputs)}
    return replace(experiment, warnings=tuple(text for text in experiment.warnings if text not in roles))


def _joined(parts: Sequence[Experiment], order: Sequence[str]) -> Experiment:
    """One experiment of all their runs, with a missing sample wherever a run has not an output that another has."""
    outputs = tuple({output.name: output for part in parts for output in part.outputs}.values())
    runs = sorted((run for part in parts for run in part.runs), key=lambda run: order.index(run.name))
    warnings = dict.fromkeys(text for part in parts for text in part.warnings)
    return with_outputs(replace(parts[0], runs=tuple(runs), warnings=tuple(warnings)), outputs)


def with_outputs(experiment: Experiment, outputs: Sequence[Output]) -> Experiment:
    """The experiment with those outputs in that order; where a run has none of one, all its samples are missing."""
    runs = tuple(
        replace(run, outputs={one.name: run.outputs.get(one.name, np.full(run.time.shape, np.nan)) for one in outputs})
        for run in experiment.runs
    )
    return replace(experiment, outputs=tuple(outputs), runs=runs)


def with_outputs_of_model(model: ModelRecord, experiment: Experiment) -> tuple[Experiment, tuple[str, ...]]:
    """(the experiment that also has the outputs of the model which its logs lack, without a sample; a message on each of these).

    Measured ones come first.
    """
    missing = [one for one in model.outputs if one.name not in experiment.runs[0].outputs]
    unmeasured = [Output(one.name, one.unit, one.noise, "of the model's file", True, one.offset) for one in missing]
    result = with_outputs(experiment, [*experiment.outputs, *unmeasured])
    lacking: Mapping[str, list[str]] = {
        one.name: [run.name for run in result.runs if not np.isfinite(run.outputs[one.name]).any()]
        for one in model.outputs
    }
    return result, tuple(
        f"the output {name!r}, which the model was fitted to, is not in {and_listed(names)}: it is predicted there and compared with nothing"
        for name, names in lacking.items()
        if names
    )
