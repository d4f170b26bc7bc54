"""Runs of a batch whose values no wire and no load has: they are found before they run, and marked in their status."""

from __future__ import annotations

import warnings
from collections.abc import Mapping, Sequence

import numpy as np

from smajax.core.parameters import Parameter, parameters
from smajax.model.system import System
from smajax.model.wire.order import ORDER, pairs
from smajax.simulation.batch.axes import Axes, Dimension
from smajax.simulation.observers import IMPOSSIBLE

RUN_ALL_THE_SAME = f"such runs are simulated all the same, and what comes of them means nothing: `status` {IMPOSSIBLE} marks them, and `good` leaves them out."


def _beyond(entry: Parameter, values: np.ndarray) -> np.ndarray:
    """Which values are out of the parameter's bounds; what is no number is."""
    return ~((values >= entry.low) & (values <= entry.high))


def impossible(system: System, values: Mapping[str, np.ndarray]) -> np.ndarray:
    """Which runs have a parameter out of its bounds, or two in the wrong order; shape (runs,), of values of this shape."""
    table = parameters(system)
    found = np.zeros(np.shape(next(iter(values.values()))), dtype=bool)
    for name, series in values.items():
        if name in table:
            found |= _beyond(table[name], series)
    for one in pairs(system, values):
        found |= one.wrong
    return found


def marked(
    system: System, values: Mapping[str, np.ndarray], results: Mapping[str, np.ndarray]
) -> dict[str, np.ndarray]:
    """`results` of runs with `values`, with the status `IMPOSSIBLE` from the start on where the values are.

    It stands in the place of what went wrong in such a run, which followed from its values. After the run and not in it: the program
    that runs is the same for all values.
    """
    wrong = impossible(system, values)
    if not wrong.any():
        return dict(results)
    status = np.where(wrong, IMPOSSIBLE, results["status"]).astype(results["status"].dtype)
    return {**results, "status": status, "first_bad_time": np.where(wrong, 0.0, results["first_bad_time"])}


def _of_names(axes: Axes, names: Sequence[str]) -> Axes:
    """What varies of these names alone: far fewer runs than the product of all."""
    own = ((one.name, {name: one.values[name] for name in names if name in one.values}) for one in axes.dimensions)
    return Axes(tuple(Dimension(dimension, values) for dimension, values in own if values))


def warn_of_impossible(system: System, axes: Axes) -> None:
    """Warns whoever called the caller's caller of values that no wire or load has: what comes of them may look like a result."""
    table = parameters(system)
    for dimension in axes.dimensions:
        for name, values in dimension.values.items():
            if name not in table:
                continue
            entry = table[name]
            beyond = values[_beyond(entry, values)]
            if beyond.size:
                warnings.warn(
                    f"{beyond.size} of {values.size} values of `{name}` are out of its bounds, {entry.low:g} to {entry.high:g} {entry.unit}, "
                    f"such as {beyond[0]:g}: {RUN_ALL_THE_SAME}",
                    stacklevel=4,
                )
    for lower, higher, _ in ORDER:
        varied = _of_names(axes, (lower, higher))
        if not varied.dimensions:
            continue
        for pair in pairs(system, varied.runs(0, varied.size)):
            if pair.lower == lower and pair.wrong.any():
                first = int(np.argmax(pair.wrong))
                warnings.warn(
                    f"{int(pair.wrong.sum())} of {pair.wrong.size} pairs of `{lower}` and `{higher}` are in the wrong order, such as "
                    f"{pair.low[first]:g} and {pair.high[first]:g} {table[lower].unit} ({pair.why}): {RUN_ALL_THE_SAME}",
                    stacklevel=4,
                )
