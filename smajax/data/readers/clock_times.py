"""Clock times of a log, `2026-11-12 10:00:00.100` or `10:00:00,100`, as nanoseconds."""

from __future__ import annotations

import re
from datetime import date

import numpy as np

from smajax.data.readers.table import Array

NANO = 1_000_000_000
DAY = 86_400
DAYS = 366  # from which on a number of days is a date's
EPOCH = NANO * DAY * date(1970, 1, 1).toordinal()  # where other programs begin to count, in ns since the year 1
MOMENT = re.compile(
    r"(?:(\d{4})-(\d\d)-(\d\d)[T ] *)?(\d{1,3}):([0-5]\d):([0-5]\d)(?:[.,](\d{1,9}))?(?:Z|([+-])(\d\d):?(\d\d))?",
    re.ASCII,
)


def moment(cell: str) -> int | None:
    """ISO date and time in ns since the year 1, or a time of day in ns since midnight; None where `cell` is neither."""
    result = MOMENT.fullmatch(cell.strip())
    if result is None:
        return None
    year, month, day, hours, minutes, seconds, part, sign, zone_hours, zone_minutes = result.groups()
    try:
        days = date(int(year), int(month), int(day)).toordinal() if year else 0
    except ValueError:
        return None
    zone = (3600 * int(zone_hours) + 60 * int(zone_minutes)) * (-1 if sign == "-" else 1) if sign else 0
    whole = DAY * days + 3600 * int(hours) + 60 * int(minutes) + int(seconds) - zone
    return NANO * whole + int((part or "").ljust(9, "0"))


def past_midnight(seconds: Array, first: int) -> Array:
    """Times (n,) since `first` (ns) of which a time of day that falls back by more than half a day has passed midnight."""
    there = np.isfinite(seconds)
    if first >= DAYS * DAY * NANO or not there.any():
        return seconds
    steps = np.diff(seconds[there], prepend=seconds[there][:1])
    result = seconds.copy()
    result[there] += DAY * np.cumsum(steps < -0.5 * DAY)
    return result
