"""Files to take along: the experiment file, models, reports, tables; and a model or a controller as an FMU or C, made here."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from smajax.app.pages.fit import begin, watch
from smajax.app.pages.predict import models
from smajax.app.project import EXPERIMENT, Project
from smajax.app.step import FieldError, Sent, Step
from smajax.control.tune.folder_names import GAINS, KEPT

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
    "tune.json": "the same numbers, for a program",
    "loops.csv": "the closed loops of the check",
    "gains.json": "the gains, for `sweep --gains`",
}
EXPORTED = "exported"  # the folder of what `smajax export` writes
KINDS = {"fmu": "FMU, for Simulink and others", "c": "C99, for a microcontroller"}


def _files(project: Project, paths: Iterable[Path]) -> list[dict[str, Any]]:
    return [
        {
            "name": one.name,
            "own": one.relative_to(project.folder).as_posix(),
            "size": one.stat().st_size,
            "about": MEANING.get(one.name, ""),
        }
        for one in sorted(paths)
        if one.is_file() and not one.is_symlink() and not one.name.startswith(".") and one.name not in KEPT
    ]


def _gains(project: Project) -> dict[str, str]:
    """Files of gains -> the model that they were tuned on, as `tune` was given it; "" where its record does not say."""
    return {
        f"{one.folder}/{GAINS}": str(project.record_of(one).get("model", ""))
        for one in project.results
        if one.command == "tune" and (project.folder / one.folder / GAINS).is_file()
    }


def page(project: Project) -> Mapping[str, Any]:
    found = [
        {"result": one, "files": _files(project, (project.folder / one.folder).iterdir())} for one in project.results
    ]
    folder = project.folder / EXPORTED
    there = [] if folder.is_symlink() or not folder.is_dir() else [*folder.iterdir(), *folder.glob("*/*")]
    gains, known = _gains(project), models(project)
    return {
        "found": found,
        "experiment": EXPERIMENT if project.text else "",
        "exported": _files(project, there),
        "kinds": KINDS,
        "models": known,
        "gains": list(gains),
        **watch(project, ("export",)),
    }


def save(project: Project, sent: Sent) -> str:
    what, kind, gains, known = sent.values.get("what", ""), sent.values.get("to", ""), _gains(project), models(project)
    if what not in (*known, *gains):
        raise FieldError("what", f"there is no {what!r} to export")
    if kind not in KINDS:
        raise FieldError("to", f"{kind!r} is neither of {', '.join(KINDS)}")
    words = [what, "--to", kind, "--overwrite"]
    if what in gains:
        model = sent.values.get("model") or gains[what]
        if model not in known:
            raise FieldError("model", "choose the model that the controller assumes")
        words += ["--model", model]
    if (project.folder / EXPORTED).is_symlink():
        raise FieldError("", f"{EXPORTED!r} is a link; what is exported is written into a folder of that name")
    name = what.partition("/")[0]
    begin(project, "export", words, f"{EXPORTED}/{name}.fmu" if kind == "fmu" else f"{EXPORTED}/{name}_c", {})
    return ""


STEP = Step("download", "Download", page, save, light=True)
