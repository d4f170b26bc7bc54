"""Units that the experiment file says, held against those that the headings of the log carry."""

from __future__ import annotations

import math
from collections.abc import Mapping

from smajax.core.units import UnitError, convert
from smajax.data.experiment.column_guess import MEANT, TIME
from smajax.data.experiment.schema import ChannelSection, RunSection, TimeSection
from smajax.data.readers.headers import BRACKETS, SLASHED, unit_in


def heading_warnings(
    channels: Mapping[str, ChannelSection], time: TimeSection | None, run: RunSection | None = None
) -> list[str]:
    """One for each column whose heading has another unit: one of the two is wrong by a factor, or the column is another one.

    A letter behind an underscore that is a unit of another kind (`T_s`, a temperature) is no unit. run: asked of what its log has otherwise alone.
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
    for key, column, declared in keys:
        heading = column if isinstance(column, str) else ""
        said = unit_in(heading)
        if said in ("", "-", "1"):  # a plain number: of a log in per cent as often as not
            continue
        try:
            zero = convert(0.0, MEANT.get(said, said), declared)
            one = convert(1.0, MEANT.get(said, said), declared)
        except UnitError:
            if _says_another_kind(heading, said, declared):
                result.append(
                    f"{key} is {declared!r}, and the heading {heading!r} says {said}, a unit of another kind: is that the column? "
                    "Its numbers are taken as the file says"
                )
            continue
        if not (math.isclose(one, 1.0, rel_tol=1e-9) and abs(zero) < 1e-9):
            result.append(
                f"{key} is {declared!r}, and the heading {heading!r} says {said}: 1 {said} is {one:g} {declared}. One of the two "
                "is wrong; the file's is taken"
            )
    return result


def _says_another_kind(heading: str, said: str, declared: str) -> bool:
    """Whether what a heading ends with is a unit for sure. `temp_deg` are degrees Celsius as often as not."""
    if said not in SLASHED or (said in ("deg", "°") and MEANT.get(declared, declared) in ("degC", "K")):
        return False
    return len(said) > 1 or bool(BRACKETS.search(heading)) or not heading.endswith(f"_{said}")
