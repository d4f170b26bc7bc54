"""The fit: begun, watched, stopped and resumed."""

from __future__ import annotations

import re
import time as clock
from collections.abc import Mapping
from typing import Any

from smajax.app import jobs
from smajax.app.edit import ON, edited, set_effects
from smajax.app.project import EXPERIMENT, Project
from smajax.app.ready import ready
from smajax.app.step import FieldError, Sent, Step
from smajax.app.watched import Watched, watched
from smajax.core.display_units import display

COMMANDS = ("close-loop", "identify")
DEFAULTS = {"close-loop": "report", "identify": "identified"}
NAME = re.compile(r"[A-Za-z0-9][\w.\-]*\Z")


def out_name(sent: Sent, default: str) -> str:
    """The name of a result folder in the project. Raises FieldError."""
    name = sent.values.get("out", "").strip() or default
    if not NAME.match(name):
        raise FieldError("out", f"{name!r}: a name of letters, digits, `.`, `-` and `_`; it is made in this folder")
    return name


def begin(project: Project, command: str, words: list[str], out: str, about: Mapping[str, Any]) -> None:
    """Start a command. Raises FieldError while another one runs."""
    if (project.folder / out).is_symlink():
        raise FieldError("out", f"{out!r} is a link; give the name of a folder of its own")
    try:
        jobs.start(project.folder, command, words, out, about)
    except (jobs.JobError, OSError) as error:
        raise FieldError("", str(error)) from None


def effects() -> tuple[tuple[str, str], ...]:
    """(name, title) of every candidate effect."""
    ready()
    from smajax.model.effects.library import LIBRARY

    return tuple((name, effect.candidate.title) for name, effect in LIBRARY.items())


def page(project: Project) -> Mapping[str, Any]:
    file, experiment = project.file, project.examined.experiment
    only = file.effects.only if file else None
    return {
        "effects": effects(),
        "only": None if only is None else set(only),
        "unknowns": len(file.unknown) if file else 0,
        "fitted": [run.name for run in (file.runs if file else []) if run.role == "fit"],
        "held": [run.name for run in (file.runs if file else []) if run.role != "fit"],
        "warnings": experiment.warnings if experiment else (),
        "defaults": DEFAULTS,
        "existing": {one.folder for one in project.results},
        **watch(project, COMMANDS),
    }


def watch(project: Project, commands: tuple[str, ...]) -> dict[str, Any]:
    """What a page shows of the last job, where it was one of these commands."""
    job = project.job
    if job is None or job.command not in commands:
        return {"job": None, "busy": job if job is not None and job.running else None}
    seen = watched(project.folder, job)
    left = seen.seconds_left(clock.time()) if job.running else None
    return {
        "job": job,
        "busy": None,
        "seen": seen,
        "left": "" if left is None else f"about {left:.0f} s" if left < 90.0 else f"about {left / 60.0:.0f} min",
        "stage_time": _in_words(clock.time() - seen.moved if seen.between else clock.time() - seen.since)
        if seen.stage
        else "",
        "elapsed": _in_words((clock.time() if job.running else max(seen.latest, job.began)) - job.began),
        "now": _errors(job, seen),
        "parameters": _parameters(seen),
        "trouble": _trouble(seen) if not job.running else (),
    }


def _in_words(seconds: float) -> str:
    whole = int(seconds)
    return f"{whole} s" if whole < 60 else f"{whole // 60} min {whole % 60} s"


def _errors(job: jobs.Job, seen: Watched) -> list[dict[str, str]]:
    """The present error of each series, in the unit that is shown."""
    if not seen.errors:
        return []
    result = []
    for series, value in zip(job.about.get("series", ()), seen.errors[-1][1], strict=False):
        unit = display(series["unit"], series["output"])
        result.append({"run": series["run"], "output": series["output"], "error": unit.with_unit(value, 3)})
    return result


def _parameters(seen: Watched) -> list[tuple[str, str]]:
    found = []
    for name, value in (seen.parameters or {}).items():
        unit = display((seen.units or {}).get(name, ""), name)
        found.append((name, unit.with_unit(value, 4)))
    return found


def _trouble(seen: Watched) -> tuple[str, ...]:
    """What the command said beside its events, from its error on."""
    lines = [line for line in seen.said if line.strip()]
    first = next((k for k, line in enumerate(lines) if line.startswith("Error")), 0)
    return tuple(lines[first:])


def errors_plot(project: Project) -> dict[str, Any]:
    """The errors of the series over the time of the job."""
    job = project.job
    if job is None:
        return {"x": [], "series": []}
    seen = watched(project.folder, job)
    several = list(job.about.get("series", ()))
    unit = display(several[0]["unit"], several[0]["output"]) if several else display("")
    columns = []
    for k, one in enumerate(several):
        values = [numbers[k] if k < len(numbers) else None for _, numbers in seen.errors]
        columns.append(
            {"name": one["run"], "y": [None if v is None or v != v else float(f"{unit.of(v):.4g}") for v in values]}
        )
    x = [round(at - job.began, 2) for at, _ in seen.errors]
    return {"x": x, "series": columns, "unit": unit.unit, "x_name": "time since the start", "x_unit": "s", "log": True}


def save(project: Project, sent: Sent) -> str:
    if sent.action == "stop":
        jobs.stop(project.folder)
        return ""
    if sent.action == "resume":
        job = project.job
        if job is None:
            raise FieldError("", "there is nothing to resume")
        begin(project, job.command, [word for word in job.words if word != "--overwrite"], job.out, job.about)
        return ""
    if sent.action == "effects" or sent.action == "":
        chosen = None if sent.values.get("effects.all", ON) == ON else list(sent.several.get("effects.only", ()))
        edited(project.path, lambda document: set_effects(document, chosen))
        return ""
    _start(project, sent)
    return ""


def _start(project: Project, sent: Sent) -> None:
    experiment = project.examined.experiment
    if experiment is None:
        raise FieldError("", "the experiment cannot be loaded yet: the steps that are marked say why")
    command = sent.values.get("command", "close-loop")
    if command not in COMMANDS:
        raise FieldError("command", f"{command!r} is neither of {', '.join(COMMANDS)}")
    out = out_name(sent, DEFAULTS[command])
    words = [EXPERIMENT]
    if budget := sent.values.get("budget", "").strip():
        if command != "close-loop":
            raise FieldError("budget", "only the search for missing effects can be ended in time")
        try:
            minutes = float(budget)
        except ValueError:
            minutes = 0.0
        if not 0.0 < minutes < 1e5:
            raise FieldError("budget", f"a number of minutes above 0, not {budget!r}")
        words += ["--budget", f"{60.0 * minutes:g}s"]
    if sent.values.get("overwrite") == ON:
        words.append("--overwrite")
    series = [
        {"run": run.name, "output": one.name, "unit": one.unit}
        for run in experiment.runs
        if run.role == "fit"
        for one in experiment.outputs
    ]
    begin(project, command, words, out, {"series": series})


def done(project: Project) -> bool:
    return project.result(*COMMANDS) is not None


STEP = Step("fit", "Fit", page, save, keys=("effects", "priors"), done=done, needs="loads")
