"""The findings as plain JSON values: the same numbers as the page, SI and unrounded, for a program to read."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from smajax.attribution.findings import (
    CoefficientFinding,
    EffectFinding,
    Findings,
    ParameterFinding,
    RunFinding,
    UnknownTerm,
)


def plain(value: Any) -> Any:
    """`value` as strict JSON allows it: numpy scalars become Python's, NaN and infinities (JSON has none) become null.

    Raises TypeError for anything that has no JSON form.
    """
    if value is None or isinstance(value, str):
        return value
    if isinstance(value, (bool, np.bool_)):
        return bool(value)
    if isinstance(value, (int, np.integer)):
        return int(value)
    if isinstance(value, (float, np.floating)):
        return float(value) if math.isfinite(value) else None
    if isinstance(value, Mapping):
        return {str(key): plain(entry) for key, entry in value.items()}
    if isinstance(value, (list, tuple, np.ndarray)):
        return [plain(entry) for entry in value]
    raise TypeError(f"got {type(value).__name__} in the findings, expected text, numbers, lists or mappings of those")


def _run(run: RunFinding) -> dict[str, Any]:
    return {
        "name": run.name,
        "role": run.role,
        "samples": len(run.time),
        "duration": run.time[-1] - run.time[0] if len(run.time) else None,
        "rmse_before": run.rmse_before,
        "rmse_after": run.rmse_after,
        "offset_before": run.offset_before,
        "offset_after": run.offset_after,
    }


def _parameter(found: ParameterFinding) -> dict[str, Any]:
    return {
        "value": found.value,
        "standard_error": found.standard_error,
        "unit": found.unit,
        "lower": found.lower,
        "upper": found.upper,
        "start": found.start,
        "remark": found.remark,
    }


def _coefficient(found: CoefficientFinding) -> dict[str, Any]:
    return {
        "value": found.value,
        "standard_error": found.standard_error,
        "unit": found.unit,
        "interval_over_runs": found.by_runs,
    }


def _effect(effect: EffectFinding) -> dict[str, Any]:
    return {
        "name": effect.name,
        "title": effect.title,
        "equation": effect.equation,
        "formula": effect.formula,
        "sentence": effect.sentence,
        "added": effect.added,
        "coefficients": {name: _coefficient(found) for name, found in effect.coefficients.items()},
        "evidence": effect.evidence,
    }


def _unknown(term: UnknownTerm) -> dict[str, Any]:
    return {
        "name": term.name,
        "title": term.title,
        "equation": term.equation,
        "named": term.named,
        "alike": term.alike,
        "why": term.why,
        "score_gain": term.score_gain,
        "leave_one_out_rmse_without": term.left_out_before,
        "leave_one_out_rmse": term.left_out_after,
        "held_out_rmse_without": term.held_out_before,
        "held_out_rmse": term.held_out_after,
        "function": {
            "of": term.symbol,
            "state": term.state,
            "state_unit": term.state_unit,
            "unit": term.unit,
            "at": term.at,
            "values": term.values,
            "standard_error": term.error,
            "standard_error_parameters_held": term.error_held,
        },
        "samples": {"edges": term.cells, "counts": term.samples},
        "formulas": [
            {"text": one.text, "chi_square": one.missed, "numbers": one.numbers, "bic": one.bic}
            for one in term.formulas
        ],
    }


def findings_to_json(findings: Findings) -> dict[str, Any]:
    """The record without its time series, ready for `json.dumps(..., allow_nan=False)`."""
    record = {
        "experiment": findings.experiment,
        "title": findings.title,
        "source": findings.source,
        "verdict": findings.verdict,
        "summary": findings.summary,
        "output": {
            "name": findings.output_name,
            "unit": findings.output_unit,
            "noise_sigma": findings.noise_sigma,
            "noise_how": findings.noise_how,
        },
        "runs": [_run(run) for run in findings.runs],
        "before": {"parameters": {found.name: _parameter(found) for found in findings.before}},
        "after": {"parameters": {found.name: _parameter(found) for found in findings.after}},
        "effects": [_effect(effect) for effect in findings.effects],
        "portrait_before": dataclasses.asdict(findings.portrait_before),
        "portrait_after": dataclasses.asdict(findings.portrait_after),
        "rounds": [
            {
                "number": entry.number,
                "tried": [{"model": model, "leave_one_out_rmse": rmse} for model, rmse in entry.tried],
                "chosen": entry.chosen,
                "why": entry.why,
                "alike": entry.alike,
            }
            for entry in findings.rounds
        ],
        "rivals": [dataclasses.asdict(rival) for rival in findings.rivals],
        "lone_runs": [dataclasses.asdict(one) for one in findings.lone_runs],
        "unknown": [_unknown(term) for term in findings.unknown],
        "unexplained": findings.unexplained,
        "cannot_know": findings.cannot_know,
        "check": findings.check,
        "provenance": findings.provenance,
    }
    return {key: plain(value) for key, value in record.items()}
