"""Units that the experiment file says, held against those that the headings of the log carry."""

from __future__ import annotations

import math
from collections.abc import Mapping

from smajax.experiment.guess import MEANT
from smajax.experiment.schema import ChannelSection, TimeSection
from smajax.measured.headers import unit_in
from smajax.units import UnitError, convert


def heading_warnings(channels: Mapping[str, ChannelSection], time: TimeSection | None) -> list[str]:
    """One for each column whose heading has another unit of the same kind: one of the two is wrong by a factor.

    A tail that is a unit of another kind (`T_s`, a temperature) is no unit.
    """
    keys = [(f"channels.{name}.unit", channel.column, channel.unit) for name, channel in channels.items()]
    if time is not None:
        keys.append(("time.unit", time.column, time.unit))
    found = []
    for where, heading, declared in keys:
        said = unit_in(heading) if isinstance(heading, str) else ""
        if said in ("", "-", "1"):  # a plain number: of a log in per cent as often as not
            continue
        try:
            zero = convert(0.0, MEANT.get(said, said), declared)
            one = convert(1.0, MEANT.get(said, said), declared)
        except UnitError:
            continue
        if not (math.isclose(one, 1.0, rel_tol=1e-9) and abs(zero) < 1e-9):
            found.append(
                f"{where} is {declared!r}, and the heading {heading!r} says {said}: 1 {said} is {one:g} {declared}. One of the two "
                "is wrong; the file's is taken"
            )
    return found
