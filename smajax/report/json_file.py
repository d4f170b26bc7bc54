"""The findings as plain JSON values: the same numbers as the page, SI and unrounded, and the sentences beside them."""

from __future__ import annotations

import dataclasses
import math
import warnings
from collections.abc import Mapping, Sequence
from enum import StrEnum
from typing import Any

import numpy as np

from smajax.attribution.findings import (
    CoefficientFinding,
    EffectFinding,
    Findings,
    OutputFinding,
    ParameterFinding,
    ResidualDiagnostics,
    Round,
    RunFinding,
    UnknownTerm,
    other_outputs,
)
from smajax.attribution.run_finding import BesideModels
from smajax.attribution.verdict import unknowns_at_bounds
from smajax.report.identifiability_words import remark_text
from smajax.report.narrative import Narrative, narrate
from smajax.report.narrative.rounds import chosen_text
from smajax.report.narrative.verdict import doubt

# (where, key of before) -> key of today; "" is the top. The old ones are read until version 0.3.
RENAMED: Mapping[tuple[str, str], str] = {
    ("", "portrait_before"): "residual_before",
    ("", "portrait_after"): "residual_after",
    ("", "rivals"): "confounders",
    ("", "lone_runs"): "outlier_runs",
    ("residual_before", "kept"): "filter_coefficient",
    ("residual_after", "kept"): "filter_coefficient",
    ("confounders", "rival"): "confounder",
    ("confounders", "alike"): "overlap",
    ("outlier_runs", "noise"): "residual_is_noise",
    ("outlier_runs", "foretold"): "predicted_rmse",
    ("unknown", "alike"): "indistinguishable",
}


def plain(value: Any) -> Any:
    """`value` as strict JSON allows it: numpy scalars become Python's, NaN and infinities (JSON has none) become null.

    Raises TypeError for anything that has no JSON form.
    """
    if isinstance(value, StrEnum):
        return value.value
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
        "samples": run.samples,
        "duration": run.time[-1] - run.time[0] if len(run.time) else None,
        **_errors(run),
        **(
            {"other_outputs": {one.name: {"samples": one.samples, **_errors(one)} for one in run.others}}
            if run.others
            else {}
        ),
        **({"values_of_run_before": run.own_before, "values_of_run_after": run.own_after} if run.own_after else {}),
    }


def _errors(one: BesideModels) -> dict[str, Any]:
    return {
        "rmse_before": one.rmse_before,
        "rmse_after": one.rmse_after,
        "offset_before": one.offset_before,
        "offset_after": one.offset_after,
        "rmse_average": None if one.average is None else one.average.rmse,
        "band_coverage": None if one.average is None else one.average.coverage,
        "band_coverage_moving": None if one.average is None else one.average.moving_coverage,
    }


def _sensor(one: OutputFinding) -> dict[str, Any]:
    return {"name": one.name, "unit": one.unit, "noise_sigma": one.noise_sigma, "noise_how": one.noise_how}


def _parameter(result: ParameterFinding) -> dict[str, Any]:
    return {
        "value": result.value,
        "standard_error": result.standard_error,
        "unit": result.unit,
        "lower": result.lower,
        "upper": result.upper,
        "start": result.start,
        "remark": remark_text(result.remark),
        "prior_base": result.prior_base,
        "prior_deviation": result.prior_deviation,
    }


def _coefficient(result: CoefficientFinding) -> dict[str, Any]:
    return {
        "value": result.value,
        "standard_error": result.standard_error,
        "unit": result.unit,
        "interval_over_runs": result.by_runs,
        **({} if result.widths_off is None else {"widths_of_prior": result.widths_off}),
    }


def _effect(effect: EffectFinding, narrative: Narrative) -> dict[str, Any]:
    return {
        "name": effect.name,
        "title": effect.title,
        "equation": effect.equation,
        "formula": effect.formula,
        "sentence": narrative.effects.get(effect.name, ""),
        "added": effect.added,
        "coefficients": {name: _coefficient(result) for name, result in effect.coefficients.items()},
        "evidence": effect.evidence,
    }


def _unknown(term: UnknownTerm, why: str) -> dict[str, Any]:
    return {
        "name": term.name,
        "title": term.title,
        "equation": term.equation,
        "named": term.named,
        "indistinguishable": term.indistinguishable,
        "why": why,
        "log_odds": term.log_odds,
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
            {"text": one.text, "chi_square": one.chi_square, "numbers": one.numbers, "bic": one.bic}
            for one in term.formulas
        ],
    }


def _residual(result: ResidualDiagnostics, sentences: Sequence[str]) -> dict[str, Any]:
    record = dataclasses.asdict(result)
    if not result.noise_by_output:  # of one output the verdict says it
        del record["noise_by_output"]
    return {**record, "sentences": sentences}


def _round(entry: Round, why: str) -> dict[str, Any]:
    return {
        "number": entry.number,
        "tried": [{"model": model, "leave_one_out_rmse": rmse} for model, rmse in entry.tried],
        "chosen": chosen_text(entry),
        "why": why,
    }


def findings_to_json(findings: Findings, narrative: Narrative | None = None) -> dict[str, Any]:
    """The record without its time series, ready for `json.dumps(..., allow_nan=False)`."""
    words = narrative or narrate(findings)
    at_bounds = [one.name for one in findings.coefficients_at_bounds]
    unknowns = [one.name for one in unknowns_at_bounds(findings)]
    record = {
        "experiment": findings.experiment,
        "title": findings.title,
        "source": findings.source,
        "verdict": findings.verdict,
        **({"coefficients_at_bounds": at_bounds} if at_bounds else {}),
        **({"unknowns_at_bounds": unknowns} if unknowns else {}),
        **({"held_out_runs": why} if (why := doubt(findings)) else {}),
        "remaining": findings.remaining,
        "effects_excluded": findings.effects_excluded,
        "summary": words.summary,
        "output": {
            "name": findings.output_name,
            "unit": findings.output_unit,
            "noise_sigma": findings.noise_sigma,
            "noise_how": findings.noise_how,
        },
        **({"other_outputs": [_sensor(one) for one in other_outputs(findings)]} if other_outputs(findings) else {}),
        "integration_error": findings.integration.record(),
        "runs": [_run(run) for run in findings.runs],
        "priors": [dataclasses.asdict(one) for one in findings.priors],
        "averaged_models": [{"effects": list(one.effects), "weight": one.weight} for one in findings.averaged],
        "dropped_models": [
            {"effects": list(one.effects), "weight": one.weight, "why": why}
            for one, why in zip(findings.dropped, words.dropped, strict=True)
        ],
        "before": {"parameters": {result.name: _parameter(result) for result in findings.before}},
        "after": {"parameters": {result.name: _parameter(result) for result in findings.after}},
        "effects": [_effect(effect, words) for effect in findings.effects],
        "residual_before": _residual(findings.residual_before, words.residual_before),
        "residual_after": _residual(findings.residual_after, words.residual_after),
        "rounds": [_round(entry, why) for entry, why in zip(findings.rounds, words.rounds, strict=True)],
        "confounders": [dataclasses.asdict(one) for one in findings.confounders],
        "outlier_runs": [dataclasses.asdict(one) for one in findings.outlier_runs],
        "record_errors": [dataclasses.asdict(one) for one in findings.record_errors],
        "unknown": [_unknown(term, why) for term, why in zip(findings.unknown, words.unknown, strict=True)],
        "unexplained": words.unexplained,
        "cannot_know": words.cannot_know,
        "check": words.check,
        "provenance": findings.provenance,
    }
    return {key: plain(value) for key, value in record.items()}


def with_current_keys(record: Mapping[str, Any]) -> dict[str, Any]:
    """A record of `report.json`, as `json.loads` gives it, with the keys of today; DeprecationWarning where it has old ones."""
    old: dict[str, str] = {}

    def renamed(place: str, entry: Any) -> Any:
        if isinstance(entry, list):
            return [renamed(place, one) for one in entry]
        if not isinstance(entry, Mapping):
            return entry
        result = {}
        for key, value in entry.items():
            now = RENAMED.get((place, key), key)
            if now != key:
                old[f"{place}.{key}".removeprefix(".")] = now
            result[now] = value if place else renamed(now, value)
        return result

    result = dict(renamed("", record))
    if old:
        listed = ", ".join(f"{key} ({now} now)" for key, now in old.items())
        warnings.warn(
            f"keys of an older report.json, read until version 0.3: {listed}", DeprecationWarning, stacklevel=2
        )
    return result
