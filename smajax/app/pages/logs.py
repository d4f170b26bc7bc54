"""The logs: dropped by the browser or there already; which of them are the runs of the experiment."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from smajax.app.confined import OutsideError
from smajax.app.drafted import draft_file, run_files
from smajax.app.log_files import UPLOADS, receive, safe_name
from smajax.app.project import Project
from smajax.app.step import FieldError, Sent, Step
from smajax.data.experiment.errors import ExperimentError
from smajax.data.readers.read import READERS
from smajax.data.readers.table import MeasuredDataError


def page(project: Project) -> Mapping[str, Any]:
    runs = {path.resolve() for files in run_files(project).values() for path in files}
    used = {
        own
        for log, path in zip(project.logs, project.log_paths, strict=True)
        if path.resolve() in runs
        for own in [log.own]
    }
    return {
        "used": used or {log.own for log in project.logs if not log.error},
        "endings": ",".join(READERS),
        "uploads": UPLOADS,
    }


def save(project: Project, sent: Sent) -> str:
    if sent.action == "upload":
        _receive(project, sent)
        return ""
    logs = []
    for own in sent.several.get("use", ()):
        try:
            logs.append(project.log_at(own))
        except OutsideError as error:
            raise FieldError("use", str(error)) from None
    if not logs:
        raise FieldError("use", "tick at least one log; three or more of different kinds say most")
    model = project.file.model if project.file else None
    choice = {name: getattr(model, name) for name in ("load", "wire", "drive")} if model else {}
    try:
        draft_file(project, logs, choice, sent.values.get("data.decimal", ""))
    except (MeasuredDataError, ExperimentError) as error:
        raise FieldError("use", str(error).replace(f"{project.folder}/", "")) from None
    return "columns"


def _receive(project: Project, sent: Sent) -> None:
    if not sent.files:
        raise FieldError("files", "no file was sent")
    wrong = []
    for name, content in sent.files:
        try:
            receive(project.folder, name, content)
        except MeasuredDataError as error:
            wrong.append(f"{safe_name(name)} was not taken: {str(error).replace(f'{project.folder}/{UPLOADS}/', '')}")
        except OSError as error:
            wrong.append(f"{safe_name(name)} cannot be written: {error.strerror}")
    if wrong:
        raise FieldError("files", "\n".join(wrong))


STEP = Step("logs", "Logs", page, save, keys=("data",), done=lambda project: bool(project.text), light=True)
