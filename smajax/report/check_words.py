"""The check of an experiment in sentences and rows: what was read, and how far the model is off before any fit."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from smajax.core.display_units import digits, display, label, written
from smajax.core.wording import and_listed, counted, times_noise
from smajax.fit.experiment_check import CheckedRun, ExperimentCheck
from smajax.model.channels import channel
from smajax.report.identifiability_words import check_sentences

HEAD = ("run", "role", "duration (s)", "samples", "missing")
UNKNOWNS_HEAD = ("unknown", "initial guess", "from", "to", "unit", "a value for each run")
MOVED = 0.05  # of the martensite fraction: a wire that changes by less does not transform


def answer(found: ExperimentCheck) -> str:
    """What was read, in one sentence."""
    runs = [counted(len(names), f"{role} run") for role in ("fit", "held-out") if (names := _names(found, role))]
    outputs = and_listed([label(one.output) for one in found.runs[0].series])
    return f"The file and its logs can be read: {and_listed(runs)} of {outputs}, on a clock of {digits(1e3 * found.step, 4)} ms; {counted(len(found.unknowns), 'unknown')} to fit."


def conclusions(found: ExperimentCheck) -> list[str]:
    """The error at the initial guess, what the wire does there, then the warnings and what the runs determine."""
    return [*_errors(found), *_at_rest(found), *check_sentences(found.warnings, found.checks)]


def _names(found: ExperimentCheck, role: str) -> list[str]:
    return [run.name for run in found.runs if run.role == role]


def _errors(found: ExperimentCheck) -> Iterator[str]:
    for k, one in enumerate(found.runs[0].series):
        shown, rmse = display(one.unit, one.output), found.rmse(k)
        if np.isfinite(rmse):
            ratio = f", {times_noise(rmse / one.noise)}" if one.noise > 0.0 else ""
            yield (
                f"At the initial guess the {label(one.output)} of the fit runs is off by {digits(shown.of(rmse), 3)} {shown.unit} (rms){ratio}; "
                f"noise: {digits(shown.of(one.noise), 3)} {shown.unit} ({found.noises[one.output]})."
            )
        else:
            yield f"At the initial guess the model has no number for the {label(one.output)} of every fit run: check sizes, units and the initial guess."


def _at_rest(found: ExperimentCheck) -> Iterator[str]:
    """Runs in which the wire does not transform at the initial guess: a fit may have nowhere to go from there."""
    still = [run.name for run in found.runs if not _range(run, "martensite_fraction") > MOVED]
    if still:
        warm = max(float(np.max(run.states["temperature"])) for run in found.runs if run.name in still)
        where = "any run" if len(still) == len(found.runs) else and_listed(still)
        yield (
            f"At the initial guess the wire does not transform in {where} (it reaches {digits(warm, 3)} °C there): check the drive's unit, the "
            "bench's sizes, the convection and the transformation temperatures."
        )


def _range(run: CheckedRun, state: str) -> float:
    return float(np.ptp(run.states[state]))


def _from_to(values: np.ndarray) -> str:
    """`0.2 to 1.5`, or one number of what is constant."""
    there = values[np.isfinite(values)]
    if not there.size:
        return "-"
    low, high = float(there.min()), float(there.max())
    return digits(low, 3) if low == high else f"{digits(low, 3)} to {digits(high, 3)}"


def run_rows(found: ExperimentCheck) -> tuple[list[str], list[list[str]]]:
    """(head, rows): what was read of each run, and what the model does with it at the initial guess."""
    first = found.runs[0]
    inputs = list(first.inputs)
    head = [*HEAD, *(_with_unit(name, channel(name).unit) for name in inputs)]
    for one in first.series:
        unit = display(one.unit, one.output).unit
        head += [_with_unit(one.output, unit), _with_unit("error at the initial guess", unit)]
    head += ["temperature (°C)", "martensite fraction"]
    rows = []
    for run in found.runs:
        missing = sum(int(np.sum(~np.isfinite(one.measured))) for one in run.series)
        row = [run.name, run.role, digits(float(run.time[-1] - run.time[0]), 4), str(len(run.time)), str(missing)]
        row += [_from_to(np.asarray(channel(name).of(run.inputs[name]))) for name in inputs]
        for one in run.series:
            shown = display(one.unit, one.output)
            row += [_from_to(shown.of(one.measured)), digits(shown.of(one.rmse), 3)]
        rows.append([*row, _from_to(run.states["temperature"]), _from_to(run.states["martensite_fraction"])])
    return head, rows


def _with_unit(name: str, unit: str) -> str:
    return f"{label(name)} ({unit})" if unit else label(name)


def unknown_rows(found: ExperimentCheck) -> list[list[str]]:
    """Every unknown with its initial guess and bounds, in the unit in which files have it."""
    rows = []
    for name, one in found.unknowns.items():
        shown = written(one.unit, one.start)
        start, low, high = (digits(shown.of(value), 4) for value in (one.start, one.low, one.high))
        rows.append([name, start, low, high, shown.unit, "yes" if one.per_run else ""])
    return rows


def by_columns(head: Sequence[str], rows: Sequence[Sequence[str]]) -> list[list[str]]:
    """A wide table turned on its side, for a terminal: a run a column."""
    return [list(line) for line in zip(head, *rows, strict=True)]
