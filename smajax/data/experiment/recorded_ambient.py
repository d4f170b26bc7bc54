"""A recorded temperature of the air that is no air's: mostly a thermocouple on the wire."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import scipy  # its parts are imported when they are first used

from smajax.data.experiment.catalogue import Scale
from smajax.data.experiment.declared_quantities import warmings
from smajax.data.experiment.schema import ChannelSection
from smajax.data.experiment.signals import ReadRun
from smajax.data.readers.table import Array

AMBIENT = "ambient_temperature"
# More than the air of a room, or of a climate chamber (some 10 K a minute), changes by in so many seconds.
CHANGE, SECONDS = 5.0, 10.0  # K, s
SMOOTHED = 1.0  # s over which readings are averaged before, so that a sensor's noise is no change
RISES, FOLLOWS = (
    3.0,
    0.5,
)  # K, and the rank correlation with the heat, from which on the wire's heat is what the sensor shows
LEAST = 20  # samples


def _smoothed(values: Array, step: float) -> Array:
    count = max(1, round(SMOOTHED / step))
    return np.asarray(scipy.ndimage.uniform_filter1d(values, count, mode="nearest"))


def _fastest(values: Array, step: float) -> tuple[float, float]:
    """(largest change within a window, length of the window, s)."""
    count = max(2, round(SECONDS / step) + 1)
    change = scipy.ndimage.maximum_filter1d(values, count) - scipy.ndimage.minimum_filter1d(values, count)
    return float(change.max()), (count - 1) * step


def ambient_warnings(
    runs: Sequence[ReadRun], channel: ChannelSection | None, scale: Scale | None, heats: Sequence[str], step: float
) -> list[str]:
    """At most one sentence. channel: what the file says of the ambient temperature; scale, heats: as `magnitude_warnings` has them; step: of the clock, s."""
    recorded = [read for read in runs if AMBIENT in read.signals and read.run.inputs[AMBIENT].size >= LEAST]
    if channel is None or not recorded:
        return []
    column = channel.column if channel.column is not None else channel.variable
    what = f"the input {AMBIENT!r} (column {column!r})"
    then = (
        "Is it a thermocouple on or beside the wire? The temperature of the wire is an output: declare the column as [channels.temperature] with "
        f"role = 'output', and give the air's as a constant, {AMBIENT} = '23 degC', in [model.parameters]"
    )
    smooth = [_smoothed(read.run.inputs[AMBIENT], step) for read in recorded]
    change, seconds, name = max(
        (*_fastest(values, step), read.run.name) for values, read in zip(smooth, recorded, strict=True)
    )
    if change > CHANGE * max(1.0, seconds / SECONDS):
        return [
            f"run {name!r}: {what} changes by {change:.3g} K within {seconds:.3g} s, which the air of a room does not. {then}"
        ]
    if scale is None:
        return []
    related = [
        float(scipy.stats.spearmanr(warm, values).statistic)
        for warm, values in zip(warmings(recorded, scale, heats, step), smooth, strict=True)
        if warm.size and np.ptp(warm) > 0.0 and np.ptp(values) > RISES
    ]
    if related and np.median(related) > FOLLOWS:
        return [
            f"{what} follows the heat (rank correlation {np.median(related):.2f} in the median run), which the air of a room does not. {then}"
        ]
    return []
