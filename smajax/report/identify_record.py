"""An identification as a record for machines."""

from __future__ import annotations

from typing import Any

import numpy as np

from smajax.fit.identify_result import Identified
from smajax.fit.posterior import Posterior
from smajax.report.identifiability_words import check_sentences, remark_text, weak_combinations
from smajax.report.identify_words import conclusions, ended_sentence, rms_by_role


def record(result: Identified) -> dict[str, Any]:
    """Everything but the series, in the program's own units; a number that is none is null."""
    profiled = {one.name: one for one in result.profiles}
    return {
        "experiment": result.experiment,
        "title": result.title,
        "conclusions": conclusions(result),
        "parameters": {
            one.name: {
                "value": one.value,
                "standard_error": one.standard_error,
                "unit": one.unit,
                "bounds": [one.lower, one.upper],
                "start": one.start,
                "remark": remark_text(one.note),
                **(
                    {"prior": {"mean": k.mean, "sigma": k.sigma, "of_the_logarithm": k.logarithmic}}
                    if (k := one.prior)
                    else {}
                ),
                **(
                    {"profile": {"values": p.values.tolist(), "rise": p.rise.tolist(), "interval": [p.low, p.high]}}
                    if (p := profiled.get(one.name))
                    else {}
                ),
            }
            for one in result.estimates
        },
        "correlation": {"parameters": list(result.correlated), "matrix": result.correlation.tolist()},
        "weak_combinations": weak_combinations(result.directions),
        "fits": {
            "mean_square_over_noise": list(result.start_costs),
            "stopped": ended_sentence(result.ended),
            "robust": result.robust,
        },
        "residual": {
            "rms_over_noise": result.over_noise,
            "whiteness_p_value": result.whiteness_p,
            "normality_p_value": result.normality_p,
            "samples_an_independent_one": result.independent,
        },
        "noise_sigma": result.outputs[0].noise_sigma,
        "output": {"name": result.outputs[0].name, "unit": result.outputs[0].unit},
        "outputs": {
            one.name: {
                "unit": one.unit,
                "noise_sigma": one.noise_sigma,
                "noise_how": one.noise_how,
                "rms_over_noise": one.over_noise,
                "rmse": rms_by_role(result, k),
            }
            for k, one in enumerate(result.outputs)
        },
        "runs": {
            run.name: {
                "role": run.role,
                "rmse": run.rmse,
                "samples": len(run.time),
                "outputs": {
                    one.output: {"rmse": one.rmse, "samples": int(np.isfinite(one.measured).sum())}
                    for one in run.series
                },
            }
            for run in result.runs
        },
        "integration_error": result.integration.record(),
        "values_of_held_out_runs": result.values_of_held_out_runs,
        **({"posterior": _posterior_record(result.posterior)} if result.posterior is not None else {}),
        "suggestions": [
            {"run": one.what, "information_nats": one.information, "standard_errors_become": one.shrinks}
            for one in result.suggestions
        ],
        "presets": {"held": list(result.held_presets), "fitted": list(result.fitted_presets)},
        "check": list(check_sentences(result.warnings, result.checks)),
        "provenance": result.provenance,
    }


def _posterior_record(drawn: Posterior) -> dict[str, Any]:
    parameters = {
        name: {
            "mean": float(draws.mean()),
            "standard_deviation": float(draws.std()),
            "interval": np.percentile(draws, [2.5, 97.5]).tolist(),
            "r_hat": float(r_hat),
            "independent_draws": float(effective),
        }
        for name, draws, r_hat, effective in zip(drawn.names, drawn.flat.T, drawn.r_hat, drawn.effective, strict=True)
    }
    return {
        "parameters": parameters,
        "converged": drawn.converged,
        "accepted": drawn.accepted,
        "inflation": drawn.inflation,
    }
