"""Files to take along: the experiment file, models, reports, tables."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from smajax.app.project import EXPERIMENT, Project
from smajax.app.step import Step

MEANING = {
    "report.html": "the report, one file",
    "report.json": "the same numbers, for a program",
    "model.toml": "the fitted model, for `predict`, `simulate` and `tune`",
    "model.nc": "its covariance; keep it beside model.toml",
    "base_model.toml": "the fitted base model",
    "base_model.nc": "its covariance",
    "parameters.csv": "parameters with standard errors",
    "runs.csv": "the runs, measured and simulated",
    "identify.html": "estimates with error bars, one file",
    "identify.json": "the same numbers, for a program",
    "predict.html": "the prediction, one file",
    "predict.json": "the same numbers, for a program",
    "tune.html": "the tuning, one file",
    "gains.json": "the gains, for `sweep --gains`",
}
# What a command keeps for itself, to resume from.
KEPT = ("asked.json", "state.npz", "finish.npz")


def page(project: Project) -> Mapping[str, Any]:
    found = []
    for result in project.results:
        files = sorted(
            one
            for one in (project.folder / result.folder).iterdir()
            if one.is_file() and not one.name.startswith(".") and one.name not in KEPT
        )
        found.append(
            {
                "result": result,
                "files": [
                    {
                        "name": one.name,
                        "own": f"{result.folder}/{one.name}",
                        "size": one.stat().st_size,
                        "about": MEANING.get(one.name, ""),
                    }
                    for one in files
                ],
            }
        )
    return {"found": found, "experiment": EXPERIMENT if project.text else ""}


STEP = Step("download", "Download", page, light=True)
