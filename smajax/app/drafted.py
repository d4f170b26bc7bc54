"""The experiment file begun from logs, or begun again with other presets: by the draft of `smajax new-experiment`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import tomlkit

from smajax.app.edit import carried_over, parsed
from smajax.app.project import Project
from smajax.app.ready import ready
from smajax.core.files import replace
from smajax.data.experiment.column_guess import TIME
from smajax.data.experiment.data_folder import data_folder
from smajax.data.experiment.errors import ExperimentError
from smajax.data.readers.table import MeasuredDataError


def run_files(project: Project) -> dict[str, tuple[Path, ...]]:
    """Run -> its logs, as the experiment file has them."""
    file = project.file
    if file is None:
        return {}
    try:
        folder = data_folder(project.path, file.data.folder)
    except ExperimentError:
        return {}
    return {
        run.name: tuple(
            dict.fromkeys(folder / name for name in ([run.file] if run.file else (run.files or {}).values()) if name)
        )
        for run in file.runs
    }


def columns_declared(project: Project) -> dict[str | int, tuple[str, str]]:
    """Column -> (quantity, unit), as the experiment file has it now."""
    file = project.file
    if file is None:
        return {}
    found: dict[str | int, tuple[str, str]] = {}
    for name, one in file.channels.items():
        if one.column is not None:
            found[one.column] = name, one.unit
    if file.time is not None and file.time.column is not None:
        found[file.time.column] = TIME, file.time.unit
    return found


def draft_file(project: Project, logs: Sequence[Path], choice: Mapping[str, str], decimal: str = "") -> None:
    """Write `experiment.toml` for these logs and presets (`wire`, `load`, `drive`; "" for a guess), with what the file says already.

    An experiment that begins from a model file still does. Raises MeasuredDataError and ExperimentError as `new-experiment` does; then the
    file is as before.
    """
    ready()
    from smajax.data.experiment.draft import draft
    from smajax.data.experiment.draft_facts import BenchFacts
    from smajax.data.experiment.draft_model import ModelChoice
    from smajax.data.model_catalogue import describe

    if not logs:
        raise MeasuredDataError("choose at least one log")
    old = parsed(project.path) if project.text else None
    begun = project.file.model.file if project.file else None
    model = ModelChoice(choice.get("load", ""), choice.get("wire", ""), choice.get("drive", ""))
    if begun is not None:
        model = ModelChoice(model=project.folder / begun)
    columns = columns_declared(project)
    first = draft(list(logs), project.path, "", model, decimal, columns=columns)
    before: Mapping[str, Any] = {} if old is None else old.get("model", {}).get("parameters", {})
    if before:
        named = tomlkit.parse(first.text)["model"]
        known = set(before) if begun else describe(named["wire"], named["load"], named["drive"]).parameters
        bench = BenchFacts({name: str(value) for name, value in before.items() if name in known})
        first = draft(list(logs), project.path, "", model, decimal, bench, columns)
    document = tomlkit.parse(first.text)
    if old is not None:
        carried_over(old, document)
    replace(project.path, tomlkit.dumps(document))
