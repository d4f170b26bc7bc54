"""Columns, units and signs that the log of one run has otherwise than those of the others."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from smajax.data.experiment.column_guess import TIME
from smajax.data.experiment.errors import check_name
from smajax.data.experiment.schema import ChannelSection, RunSection, TimeSection

Places = tuple[Mapping[str, ChannelSection], TimeSection | None]


def own_columns(
    path: Path, run: RunSection, channels: Mapping[str, ChannelSection], time: TimeSection | None
) -> Places:
    """The channels and the time as this run's `columns`, `units` and `reversed` have them. Raises ExperimentError for a name that is no channel, or no output."""
    timed = time is not None and time.kind == "column"
    known = [*channels, *([TIME] if timed else [])]
    for key, table in (("columns", run.columns), ("units", run.units)):
        for name in table:
            check_name(path, f"runs.{run.name}.{key}.{name}", "channel", name, known)
    outputs = [name for name, channel in channels.items() if channel.role == "output"]
    for name in run.reversed:
        check_name(path, f"runs.{run.name}.reversed", "output", name, outputs)

    def changes(name: str) -> dict[str, Any]:
        place = {"column": run.columns[name]} if name in run.columns else {}
        return place | ({"unit": run.units[name]} if name in run.units else {})

    def changed(name: str, channel: ChannelSection) -> ChannelSection:
        own = changes(name)
        if name in run.reversed:
            own["reversed"] = not channel.reversed
        return channel.model_copy(update=own | ({"variable": None} if "column" in own else {}))

    own_time = time.model_copy(update=changes(TIME)) if time is not None and timed else time
    return {name: changed(name, channel) for name, channel in channels.items()}, own_time
