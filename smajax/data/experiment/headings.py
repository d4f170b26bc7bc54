"""Units that the experiment file says, held against those that the headings of the log carry."""

from __future__ import annotations

import math
from collections.abc import Mapping

from smajax.core.units import UnitError, convert
from smajax.data.experiment.column_guess import MEANT, TIME
from smajax.data.experiment.schema import ChannelSection, RunSection, TimeSection
from smajax.data.readers.headers import unit_in


def heading_warnings(
    channels: Mapping[str, ChannelSection], time: TimeSection | None, run: RunSection | None = None
) -> list[str]:
    """One for each column whose heading has another unit of the same kind: one of the two is wrong by a factor.

    A tail that is a unit of another kind (`T_s`, a temperature) is no unit. run: asked of what its log has otherwise alone.
    """
    places: dict[str, ChannelSection | TimeSection] = dict(channels)
    if time is not None:
        places[TIME] = time
    if run is None:
        where = {name: f"{name}.unit" if name == TIME else f"channels.{name}.unit" for name in places}
    else:
        where = {name: f"runs.{run.name}.units.{name}" for name in {**run.columns, **run.units}}
    keys = [(key, places[name].column, places[name].unit) for name, key in where.items()]
    result = []
    for key, heading, declared in keys:
        said = unit_in(heading) if isinstance(heading, str) else ""
        if said in ("", "-", "1"):  # a plain number: of a log in per cent as often as not
            continue
        try:
            zero = convert(0.0, MEANT.get(said, said), declared)
            one = convert(1.0, MEANT.get(said, said), declared)
        except UnitError:
            continue
        if not (math.isclose(one, 1.0, rel_tol=1e-9) and abs(zero) < 1e-9):
            result.append(
                f"{key} is {declared!r}, and the heading {heading!r} says {said}: 1 {said} is {one:g} {declared}. One of the two "
                "is wrong; the file's is taken"
            )
    return result
