"""Unknowns and runs: what is to be found, and which runs are held out, chosen on their plots."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from smajax.app.drafted import run_files
from smajax.app.edit import edited, set_runs, set_unknowns
from smajax.app.model_facts import fresh_bounds, rows_of
from smajax.app.project import Project
from smajax.app.step import FieldError, Sent, Step
from smajax.data.experiment.errors import ExperimentError
from smajax.data.experiment.schema import ChannelSection, ExperimentFile, RunSection


def _plots(project: Project, file: ExperimentFile, run: RunSection) -> list[dict[str, Any]]:
    """Output and inputs of a run, each by its log and column."""
    found = []
    paths = run_files(project).get(run.name, ())
    by_name = {name: project.folder / file.data.folder / one for name, one in (run.files or {}).items()}
    for name, channel in sorted(file.channels.items(), key=lambda one: one[1].role, reverse=True):
        path = by_name.get(name) or (paths[0] if paths else None)
        key = _column(run, name, channel)
        if path is None or key is None:
            continue
        try:
            own = path.resolve().relative_to(project.folder).as_posix()
        except ValueError:
            continue
        found.append({"log": own, "key": key, "name": name, "unit": run.units.get(name, channel.unit)})
    return found


def _column(run: RunSection, name: str, channel: ChannelSection) -> int | str | None:
    return run.columns.get(name, channel.column if channel.column is not None else channel.variable)


def page(project: Project) -> Mapping[str, Any]:
    file = project.file
    if file is None:
        return {"runs": [], "rows": [], "free": {}, "rest": []}
    rows = rows_of(file)
    by_name = {row.name: row for row in rows}
    needs_mass = file.model.load == "dead_weight" and "mass" not in file.channels
    return {
        "runs": [{"run": run, "plots": _plots(project, file, run)} for run in file.runs],
        "free": {name: {"box": box, "row": by_name.get(name)} for name, box in file.unknown.items()},
        "rest": [row for row in rows if row.name not in file.unknown],
        "given": file.model.parameters,
        "needs_mass": needs_mass,
    }


def save(project: Project, sent: Sent) -> str:
    if sent.action == "next":
        return "fit"
    file = project.file
    by_name = {row.name: row for row in rows_of(file)} if file else {}
    values = dict(sent.values)
    if new := values.pop("unknown.new", ""):
        values[f"unknown.{new}.free"] = "on"

    def fresh(name: str) -> Mapping[str, str]:
        if name not in by_name:
            raise FieldError("", f"there is no parameter {name!r} of this bench")
        return fresh_bounds(by_name[name])

    def change(document: Any) -> None:
        set_unknowns(document, values, fresh)
        set_runs(document, values)

    try:
        edited(project.path, change)
    except ExperimentError as error:
        raise FieldError("", str(error)) from None
    return ""


STEP = Step(
    "runs", "Unknowns and runs", page, save, keys=("unknown", "runs", "nuisance"), needs="experiment", to_look_at=True
)
