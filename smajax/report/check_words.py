"""The check of an experiment in sentences and rows: what was read, and how far the model is off before any fit."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from smajax.core.display_units import digits, display, label, written
from smajax.core.wording import and_listed, counted, times_noise
from smajax.data.experiment.magnitude import STRENGTH
from smajax.fit.experiment_check import CheckedRun, ExperimentCheck
from smajax.model.channels import channel
from smajax.report.identifiability_words import check_sentences

HEAD = ("run", "role", "duration (s)", "samples", "missing")
UNKNOWNS_HEAD = ("unknown", "initial guess", "from", "to", "unit", "a value for each run")
MOVED = 0.05  # of the martensite fraction: a wire that changes by less does not transform
ROLES = ("fit", "held-out")


def answer(found: ExperimentCheck) -> str:
    """What was read, in one sentence."""
    runs = [counted(len(names), f"{role} run") for role in ROLES if (names := _names(found, role))]
    outputs = and_listed([label(one.output) for one in found.runs[0].series])
    what = f"{and_listed(runs)} of {outputs}, on a clock of {digits(1e3 * found.step, 4)} ms; {counted(len(found.unknowns), 'unknown')} to fit"
    number = len(warnings(found))
    return f"The file and its logs can be read: {what}. " + (
        f"{counted(number, 'warning')}: look at {'it' if number == 1 else 'them'} before you fit."
        if number
        else "No warning."
    )


def warnings(found: ExperimentCheck) -> list[str]:
    """What looks wrong: in the file and its logs, and in what the model does at the initial guess."""
    return [*found.warnings, *_without_numbers(found), *_overloaded(found), *_at_rest(found)]


def conclusions(found: ExperimentCheck) -> list[str]:
    """The warnings, the error at the initial guess, and what the runs determine."""
    return [*(f"Warning: {one}" for one in warnings(found)), *at_the_guess(found)]


def at_the_guess(found: ExperimentCheck) -> list[str]:
    """The error at the initial guess, and what the runs determine there."""
    return [*_errors(found), *check_sentences((), found.checks)]


def _names(found: ExperimentCheck, role: str) -> list[str]:
    return [run.name for run in found.runs if run.role == role]


def _errors(found: ExperimentCheck) -> Iterator[str]:
    for k, one in enumerate(found.runs[0].series):
        shown = display(one.unit, one.output)
        sizes = []
        for role in ROLES:
            rmse = found.rmse(k, role)
            if np.isfinite(rmse):
                ratio = f", {times_noise(rmse / one.noise)}" if one.noise > 0.0 else ""
                sizes.append(f"of the {role} runs is off by {shown.with_unit(rmse, 3)} (rms){ratio}")
        if sizes:
            zero = " Each run's own zero is taken off." if one.offset is not None else ""
            yield (
                f"At the initial guess the {label(one.output)} {'; that '.join(sizes)}. The noise is {shown.with_unit(one.noise, 3)}: "
                f"{found.noises[one.output]}.{zero}"
            )


def _without_numbers(found: ExperimentCheck) -> Iterator[str]:
    names = [run.name for run in found.runs if not run.has_numbers]
    if names:
        yield (
            f"at the initial guess the model has no number for samples of {and_listed(names)}: check the bench's sizes, units and the initial guess"
        )


def _overloaded(found: ExperimentCheck) -> Iterator[str]:
    """A wire that no wire stands: a load's number in another unit, mostly."""
    most, name = max((float(np.nanmax(run.states["stress"])), run.name) for run in found.runs)
    if most > STRENGTH:
        what = "the stress" if found.coupon else "the load, its mass or spring, and the wire's diameter"
        yield (
            f"at the initial guess the stress reaches {digits(1e-6 * most, 4)} MPa in {name}, and no wire carries more than {1e-6 * STRENGTH:.0f} MPa: "
            f"check {what}"
        )


def _at_rest(found: ExperimentCheck) -> Iterator[str]:
    """Runs in which the wire does not transform at the initial guess: a fit may have nowhere to go from there."""
    still = [run for run in found.runs if run.has_numbers and not _range(run, "martensite_fraction") > MOVED]
    if not still:
        return
    warm = max(float(np.max(run.states["temperature"])) for run in still)
    where = "any run" if len(still) == len(found.runs) else and_listed([run.name for run in still])
    look = (
        "the transformation temperatures"
        if found.coupon
        else ("the drive's unit, the bench's sizes, the load, the convection and the transformation temperatures")
    )
    yield f"at the initial guess the wire does not transform in {where} (it reaches {digits(warm, 3)} °C there): check {look}"


def _range(run: CheckedRun, state: str) -> float:
    return float(np.ptp(run.states[state]))


def _from_to(values: np.ndarray) -> str:
    """`0.2 to 1.5`, or one number of what is constant."""
    there = values[np.isfinite(values)]
    if not there.size:
        return "-"
    low, high = float(there.min()), float(there.max())
    return digits(low, 4) if low == high else f"{digits(low, 4)} to {digits(high, 4)}"


def run_rows(found: ExperimentCheck) -> tuple[list[str], list[list[str]]]:
    """(head, rows): what was read of each run, and what the model does with it at the initial guess."""
    first = found.runs[0]
    inputs = list(first.inputs)
    head = [*HEAD, *(_with_unit(label(name), channel(name).unit) for name in inputs)]
    for one in first.series:
        name, unit = label(one.output), display(one.unit, one.output).unit
        head += [_with_unit(name, unit), _with_unit(f"{name}, error", unit)]
        head += [_with_unit(f"{name}, zero of the run", unit)] * (one.offset is not None)
    states = {name: _with_unit(f"{label(name)}, simulated", channel(name).unit) for name in first.states}
    rows = []
    for run in found.runs:
        missing = sum(int(np.sum(~np.isfinite(one.measured))) for one in run.series)
        row = [run.name, run.role, digits(float(run.time[-1] - run.time[0]), 4), str(len(run.time)), str(missing)]
        row += [_from_to(np.asarray(channel(name).of(run.inputs[name]))) for name in inputs]
        for one, like in zip(run.series, first.series, strict=True):
            shown = display(one.unit, one.output)
            row += [_from_to(shown.of(one.measured)), digits(shown.of(one.rmse), 3)]
            row += [digits(shown.of(one.offset or 0.0), 3)] * (like.offset is not None)
        rows.append([*row, *(_from_to(np.asarray(channel(name).of(run.states[name]))) for name in states)])
    return [*head, *states.values()], rows


def _with_unit(name: str, unit: str) -> str:
    return f"{name} ({unit})" if unit else name


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
