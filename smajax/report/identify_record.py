"""An identification as a record for machines."""

from __future__ import annotations

from typing import Any

import numpy as np

from smajax.fit.identify_result import Identified
from smajax.fit.posterior import Posterior
from smajax.report.identify_words import conclusions, rms_by_role


def record(found: Identified) -> dict[str, Any]:
    """Everything but the series, in the program's own units; a number that is none is null."""
    profiled = {one.name: one for one in found.profiles}
    return {
        "experiment": found.experiment,
        "title": found.title,
        "conclusions": conclusions(found),
        "parameters": {
            one.name: {
                "value": one.value,
                "standard_error": one.standard_error,
                "unit": one.unit,
                "bounds": [one.lower, one.upper],
                "start": one.start,
                "remark": one.remark,
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
            for one in found.estimates
        },
        "correlation": {"parameters": list(found.correlated), "matrix": found.correlation.tolist()},
        "weak_combinations": list(found.weak),
        "fits": {"mean_square_over_noise": list(found.start_costs), "stopped": found.stopped, "robust": found.robust},
        "residual": {
            "rms_over_noise": found.ratio,
            "whiteness_p_value": found.whiteness_p,
            "normality_p_value": found.normality_p,
            "samples_an_independent_one": found.independent,
        },
        "noise_sigma": found.outputs[0].noise_sigma,
        "output": {"name": found.outputs[0].name, "unit": found.outputs[0].unit},
        "outputs": {
            one.name: {
                "unit": one.unit,
                "noise_sigma": one.noise_sigma,
                "noise_how": one.noise_how,
                "rms_over_noise": one.ratio,
                "rmse": rms_by_role(found, k),
            }
            for k, one in enumerate(found.outputs)
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
            for run in found.runs
        },
        "integration_error": found.integration.record(),
        "own_of_held_out_runs": found.own_of_held_out,
        **({"posterior": _posterior_record(found.posterior)} if found.posterior is not None else {}),
        "suggestions": [
            {"run": one.what, "information_nats": one.information, "standard_errors_become": one.shrinks}
            for one in found.suggestions
        ],
        "check": list(found.check),
        "provenance": found.provenance,
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
