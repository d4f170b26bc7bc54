"""The numbers of a page as CSV, SI: one row a parameter, and one row a sample of every run."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from smajax.attribution.findings import Findings, ParameterFinding
from smajax.core.files import csv_text, heading
from smajax.core.names_of_runs import is_of_run, of_run, parameter_of
from smajax.fit.prediction_band import moving
from smajax.model.channels import INPUT_UNITS
from smajax.report.identifiability_words import remark_text

if TYPE_CHECKING:
    from smajax.fit.identify_result import Identified  # which is made with words of this package
    from smajax.fit.prediction import Prediction

RUNS, PARAMETERS = "runs.csv", "parameters.csv"


def findings_parameters(findings: Findings) -> str:
    """Base model and final model side by side, in the order of the record."""
    before = {one.name: one for one in findings.before}
    after = {one.name: one for one in findings.after}
    rows = []
    for name in dict.fromkeys([*before, *after]):
        fitted = [one for which in (before, after) for one in _fitted(which.get(name))]
        any_ = after.get(name) or before[name]
        rows.append([name, any_.unit, *fitted, any_.lower, any_.upper, any_.start])
    first = {parameter_of(one.name): one for one in reversed(findings.after) if is_of_run(one.name)}
    for run in findings.runs:  # held-out ones, to which their own values alone were fitted
        for parameter, value in run.own_after.items():
            of = first[parameter]
            own = [run.own_before.get(parameter), None, value, None]
            rows.append([of_run(parameter, run.name), of.unit, *own, of.lower, of.upper, of.start])
    head = ["before", "standard error before", "after", "standard error after", "lower", "upper", "start"]
    return csv_text(["parameter", "unit", *head], rows)


def _fitted(result: ParameterFinding | None) -> list[float | None]:
    return [None, None] if result is None else [result.value, result.standard_error]


def findings_runs(findings: Findings) -> str:
    """Inputs, measurement, both models, and whether the output moves, of every run, one after another."""
    models = ("measured", "before", "after")
    units = dict.fromkeys(models, findings.output_unit)
    series = []
    for run in findings.runs:
        columns = {"time": run.time, **run.inputs, **{name: getattr(run, name) for name in models}}
        columns["moves"] = moving(run.measured, findings.noise_sigma)
        for one in run.others:
            for name in models:
                units[f"{one.name} {name}"] = one.unit
                columns[f"{one.name} {name}"] = getattr(one, name)
            columns[f"{one.name} moves"] = moving(one.measured, one.noise_sigma)
        series.append((run.name, run.role, columns))
    return _runs(series, units)


def identified_parameters(result: Identified) -> str:
    """The estimates, in the order of the record."""
    rows = [
        [one.name, one.unit, one.value, one.standard_error, one.lower, one.upper, one.start, remark_text(one.note)]
        for one in result.estimates
    ]
    head = ["parameter", "unit", "estimate", "standard error", "lower", "upper", "start", "remark"]
    return csv_text(head, rows)


def identified_runs(result: Identified) -> str:
    """Inputs and, sensor by sensor, measurement, simulation and the standard error of that, of every run."""
    units: dict[str, str] = {}
    series = []
    for run in result.runs:
        columns = {"time": run.time, **run.inputs}
        for output, one in zip(result.outputs, run.series, strict=True):
            for what in ("measured", "simulated", "spread"):
                units[f"{one.output} {what}"] = output.unit
                columns[f"{one.output} {what}"] = getattr(one, what)
        series.append((run.name, run.role, columns))
    return _runs(series, units)


def _runs(runs: Sequence[tuple[str, str, Mapping[str, np.ndarray]]], units: Mapping[str, str]) -> str:
    """(name, role, series by name) of each run as one table; a cell is empty where a run has no such series."""
    known = {"time": "s", **INPUT_UNITS, **units}
    names = list(dict.fromkeys(name for _, _, columns in runs for name in columns))

    def rows() -> Iterable[list[object]]:
        for run, role, columns in runs:
            blank = np.full(len(columns["time"]), np.nan)
            cells = np.stack([np.asarray(columns.get(name, blank), dtype=float) for name in names], axis=1)
            for row in cells.tolist():
                yield [run, role, *row]

    return csv_text(["run", "role", *(heading(name, known.get(name, "1")) for name in names)], rows())


def predicted_runs(result: Prediction) -> str:
    """Inputs and, sensor by sensor, measurement, prediction and the half width of its band, of every run."""
    units: dict[str, str] = {}
    series = []
    for run in result.runs:
        columns = {"time": run.time, **run.inputs}
        for one in run.series:
            for what, values in (
                ("measured", one.measured),
                ("predicted", one.reading),
                ("half width of the band", one.half_width),
            ):
                units[f"{one.output} {what}"] = one.unit
                columns[f"{one.output} {what}"] = values
            columns[f"{one.output} moves"] = one.moving
        series.append((run.name, "fit" if run.fitted else "held-out", columns))
    return _runs(series, units)
