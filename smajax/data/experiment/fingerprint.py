"""What distinguishes one experiment from another: every key of its file, and its data by their content."""

from __future__ import annotations

import tomllib
from collections.abc import Iterator, Mapping
from typing import Any

from smajax.data.experiment.record import Experiment


def _entries(place: str, value: Any) -> Iterator[tuple[str, str]]:
    """(key path, value as text) of all entries of a table; a run is named by its `name`."""
    if isinstance(value, Mapping):
        for key, one in value.items():
            yield from _entries(f"{place}.{key}" if place else key, one)
    elif place == "runs":
        for run in value:
            yield from _entries(f"runs.{run['name']}", run)
    else:
        yield place, repr(value)


def fingerprint(experiment: Experiment) -> dict[str, Any]:
    """Its name, the content of its file without comments and layout, and the digest of each run's files."""
    content = tomllib.loads(experiment.path.read_text(encoding="utf-8-sig"))
    kept = {} if experiment.model_file is None else {"model file": experiment.model_file.sha256[:16]}
    return {
        **kept,
        "experiment": experiment.name,
        "experiment file": dict(_entries("", content)),
        "data": {run.name: run.sha256[:16] for run in experiment.runs},
    }
