"""What the sensor makes of the true value, and what the wire is given of the command."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from studies.attribution_benchmark.parameters import Effects

Vector = NDArray[np.float64]
ECCENTRIC_PERIOD = 0.37  # share of the stroke per turn of the encoder
ECCENTRIC_PHASE = 0.8  # rad


def reading(times: Vector, value: Vector, effects: Effects, stroke: float) -> Vector:
    """Noise-free reading of a value that counts from the start of the run; `stroke`: of a full transformation."""
    get = effects.get
    shown = value.copy()
    lag = get("sensor_lag", 0.0)
    if lag:  # tau dy/dt + y = x, exact for x straight between samples
        step = float(times[1] - times[0])
        decay, slope = np.exp(-step / lag), np.diff(value) / step
        for k in range(1, value.size):
            ramp = slope[k - 1]
            shown[k] = value[k] - ramp * lag + (shown[k - 1] - value[k - 1] + ramp * lag) * decay
    if get("dead_band", 0.0):  # play between shaft and sensor
        half, at = get("dead_band", 0.0) * stroke / 2, shown[0]
        for k in range(value.size):
            at = min(max(at, shown[k] - half), shown[k] + half)
            shown[k] = at
    shown = shown * (1 + get("sensor_gain", 0.0)) + get("sensor_offset", 0.0) * stroke
    shown += get("sensor_drift", 0.0) * stroke * times / times[-1]
    eccentric = get("eccentric_encoder", 0.0) * stroke
    if eccentric:
        shown += eccentric * np.sin(2 * np.pi * shown / (ECCENTRIC_PERIOD * stroke) + ECCENTRIC_PHASE)
    flat = get("sensor_saturation", 0.0)
    if flat:  # the sensor's slope falls over the far half of the stroke
        x = np.maximum(np.abs(shown) / stroke - 0.5, 0.0)
        shown -= np.sign(shown) * flat * stroke * x**2
    if get("sensor_limit", 0.0):  # the sensor shows nothing beyond it, either way from the start
        end = (1 - get("sensor_limit", 0.0)) * stroke
        shown = np.clip(shown, -end, end)
    cell = get("quantisation", 0.0) * stroke
    return np.round(shown / cell) * cell if cell else shown
