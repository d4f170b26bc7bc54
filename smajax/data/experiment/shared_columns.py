"""Two channels on one column of a log: a mistake of the file, which a fit would take for two sensors that agree."""

from __future__ import annotations

from pathlib import Path

from smajax.data.experiment.errors import ExperimentError
from smajax.data.experiment.schema import ExperimentFile, RunSection


def check_columns(path: Path, file: ExperimentFile, run: RunSection) -> None:
    """An output that is read from the same column of a log as another channel is another quantity than one of them says."""
    taken: dict[tuple[str | None, str | int], str] = {}
    for name, channel in sorted(file.channels.items(), key=lambda one: one[1].role):  # inputs first
        column = run.columns.get(name, channel.column)
        if column is None:
            continue
        first = taken.setdefault(((run.files or {}).get(name, run.file), column), name)
        if first != name and channel.role == "output":
            raise ExperimentError(
                path,
                f"channels.{name}",
                f"is read from {column!r} in run {run.name!r}, as {first!r} is; give the column of each, or remove one",
            )
