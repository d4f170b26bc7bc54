"""The runs of an experiment as runs of a kept model: which of the file's values hold there, and what does not go together."""

from __future__ import annotations

from dataclasses import replace

from smajax.core.display_units import digits, display
from smajax.core.names import close_matches
from smajax.core.units import parse_quantity
from smajax.data.experiment.errors import ExperimentError
from smajax.data.experiment.motion import motion_warnings
from smajax.data.experiment.plausibility import role_warnings
from smajax.data.experiment.record import RUN_STARTS, Experiment
from smajax.data.model_file.record import ModelRecord, range_unit
from smajax.model.channels import REPLACED

SAME = 1e-9  # of a value: a smaller difference is a unit's rounding


def runs_of_model(model: ModelRecord, experiment: Experiment) -> tuple[Experiment, tuple[str, ...]]:
    """(the experiment whose runs have the file's known values where the model has not fitted them, a note on each difference).

    Raises ExperimentError for runs of another wire, load or drive, and for values of what the model has not.
    """
    for part in ("wire", "load", "drive"):
        own, other = getattr(model, part), getattr(experiment, part)
        if own != other:
            raise ExperimentError(
                experiment.path,
                f"model.{part}",
                f"got {other!r}, expected that of the model, {own!r}: its runs are of another {part}",
            )
    for run in experiment.runs:
        for name in run.parameters:
            if name not in model.table and name not in RUN_STARTS:
                raise ExperimentError(
                    experiment.path,
                    f"runs.{run.name}.parameters.{name}",
                    f"is no parameter of the model{close_matches(name, model.table, 'it has')}; remove it",
                )
    known, notes = _known(model, experiment)
    runs = tuple(replace(run, parameters={**known, **run.parameters}) for run in experiment.runs)
    notes += _left_out(model, experiment)
    # What is said of roles is of a fit, and none is made here.
    roles = {*role_warnings(experiment.runs), *motion_warnings(experiment.runs, experiment.outputs)}
    warnings = tuple(text for text in experiment.warnings if text not in roles)
    return replace(experiment, runs=runs, warnings=warnings), tuple(notes)


def _known(model: ModelRecord, experiment: Experiment) -> tuple[dict[str, float], list[str]]:
    """(known values of the file that hold in its runs, a note on each that differs from the model's)."""
    result, notes = {}, []
    for name, value in experiment.parameters.items():
        own = model.parameters.get(name)
        if own is None:
            notes.append(f"{experiment.path}: gives {name}, which the model has not; it is not used")
        elif abs(own.value - value) > SAME * max(abs(own.value), abs(value)):
            unit = model.table[name].unit.replace("-", "")
            pair = f"{name}: the file gives {value:.6g} {unit}, the model has {own.value:.6g} {unit}".replace(" ,", ",")
            if own.origin == "fitted":
                notes.append(f"{pair}, fitted, which is used; --set, with logs, or [[runs]] parameters replace it")
            else:
                result[name] = value
                notes.append(f"{pair}; the file's is used")
    return result, notes


def _left_out(model: ModelRecord, experiment: Experiment) -> list[str]:
    """What the file or the model says of each run and this prediction has not."""
    notes = [
        f"{one.name} is unknown in the file, and nothing is fitted here: each run starts at rest, at the air's temperature"
        for one in experiment.unknowns
        if one.name in RUN_STARTS
    ]
    own = {name for run in experiment.runs for name in run.parameters}
    given = own | {name for run in experiment.runs for name in run.inputs}
    replaced = {channel: name for name, channel in REPLACED.items()}
    for name, (low, high) in model.fitted_range.items():
        parameter = name if name in model.table and name not in replaced else replaced.get(name, "")
        if not parameter or given & {name, parameter} or not low < high:
            continue
        unit = display(range_unit(name, model.table), name)
        ends = f"{digits(unit.of(low), 4)} to {unit.with_unit(high, 4)}"
        where = (
            f"--input {name}=..., or in [[runs]] inputs"
            if name in replaced
            else f"--set {name}=..., or in [[runs]] parameters"
        )
        notes.append(
            f"{name} was {ends} in the runs that the model was fitted to, and these runs do not say theirs: "
            f"{unit.with_unit(model.values[parameter], 4)} is taken; give it with {where}"
        )
    sampling = None if model.log_format is None else model.log_format.sampling
    if sampling is not None:
        step = parse_quantity(sampling.step, "s", bare="s")
        if abs(step - experiment.step) > 1e-6 * step:
            notes.append(
                f"the runs are on a step of {experiment.step:g} s, the model was fitted on one of {step:g} s: noise and prediction error are of the latter"
            )
    return notes
