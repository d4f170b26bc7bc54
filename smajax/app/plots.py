"""Series of a log, or of a fit, as a page draws them: short enough to send, with no peak lost."""

from __future__ import annotations

from typing import Any

import numpy as np

from smajax.app.log_files import time_of
from smajax.data.readers.table import MeasuredDataError, Table


def _numbers(values: np.ndarray) -> list[float | None]:
    """With six digits; null where there is no number."""
    return [None if not np.isfinite(one) else float(f"{one:.6g}") for one in values]


def series(table: Table, key: str | int, unit: str, step: float | None = None) -> dict[str, Any]:
    """One column of a log against time: {x, y, name, unit, x_name}. step: s between samples that are counted, where the experiment file says it. Raises MeasuredDataError for a column that is not there."""
    from smajax.report.pictures import extremes

    name = table.name_of(key)
    if name not in table.columns:
        raise MeasuredDataError(table.unusable.get(name, f"{name!r} has no numbers"))
    values = np.asarray(table.columns[name], dtype=float)
    time = time_of(table, name)
    counted = time is None or time.shape != values.shape
    at = np.arange(values.size, dtype=float) * (step or 1.0) if counted or time is None else time
    x, y = extremes(at, values)
    return {
        "x": _numbers(x),
        "y": _numbers(y),
        "name": str(name),
        "unit": unit,
        "x_name": "sample" if counted and step is None else "time",
        "x_unit": "" if counted and step is None else "s",
    }
