"""Signals of different rates on one uniform clock.

An input is a command that holds between its samples, so its value for a step is its mean over that step (a voltage's
is the root of its mean square, since that is what heats). An output
is a measurement of something smooth, so its value is the one at the clock instant. When the clock is slower than the sensor it is
that of a mean about the instant, which keeps noise that is faster than the clock from folding into the residual, and which leaves a
parabola as it is. A plain mean over one step is off by a 24th of the curvature times the step squared; a model, which is compared at
instants, can only take that for physics: a lag of the sensor beside a command that acts earlier.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from smajax.data.readers.table import Array

# Below this many sensor samples a step there is nothing to average.
DECIMATION_FROM = 1.05
# The narrower window of a mean, in steps of the clock. With these two windows that width leaves white noise of a sensor white on the clock
# (with one step a sample is correlated with its neighbour by -0.1); of fewer samples a step than `FEW` one step does.
NARROWER = 7.0 / 6.0
FEW = 2.2
PHASES = 40  # instants over whose places between samples the noise is averaged
# A value more than this share of which would be made up is missing.
MADE_UP = 0.25
# Sample intervals without a row from which on samples are missing.
GAP_INTERVALS = 5.0


@dataclass(frozen=True)
class Resampled:
    """values (n,) on the clock, and by how much resampling shrank the sigma of white measurement noise (1: not)."""

    values: Array
    noise_gain: float


def uniform_clock(start: float, end: float, step: float) -> Array:
    """Times start, start + step, ... not beyond end, shape (n,), all in seconds."""
    # The tolerance keeps the last instant when rounding put the end a hair before it.
    count = int(np.floor((end - start) / step + 1e-6)) + 1
    return np.asarray(start + step * np.arange(count), dtype=np.float64)


def _piecewise_constant_integral(time: Array, values: Array, at: Array) -> Array:
    """Integral from time[0] to each of `at` of the signal that holds values[i] from time[i], the last one for ever."""
    area = np.concatenate([[0.0], np.cumsum(values[:-1] * np.diff(time))])
    index = np.clip(np.searchsorted(time, at, side="right") - 1, 0, time.size - 1)
    return area[index] + values[index] * (at - time[index])


def _piecewise_linear_integral(time: Array, values: Array, at: Array) -> Array:
    """Integral from time[0] to each of `at`, inside the samples, of the straight lines between the samples."""
    area = np.concatenate([[0.0], np.cumsum(0.5 * (values[1:] + values[:-1]) * np.diff(time))])
    index = np.clip(np.searchsorted(time, at, side="right") - 1, 0, time.size - 2)
    into = at - time[index]
    slope = (values[index + 1] - values[index]) / (time[index + 1] - time[index])
    return area[index] + values[index] * into + 0.5 * slope * into**2


def resample_input(time: Array, values: Array, clock: Array, step: float, *, squared: bool = False) -> Array:
    """Mean of a held signal over each [clock_i, clock_i + step), shape (len(clock),).

    time, values (n,): the samples, each held until the next. The mean is the exact integral over the step, so a pulse
    of one sample keeps its integral whatever the step. With `squared` it is the root of the mean square, with the sign
    of the mean: what a signal that acts by its square (the voltage on a heater) amounts to over the step.
    """
    if squared:
        sign = np.where(resample_input(time, values, clock, step) < 0.0, -1.0, 1.0)
        return np.asarray(sign * np.sqrt(resample_input(time, values**2, clock, step)), dtype=np.float64)
    edges = np.stack([clock, clock + step])
    low, high = _piecewise_constant_integral(time, values, edges)
    # A mean cannot leave the range of what it averages; rounding of the running integral could, by a hair.
    return np.asarray(np.clip((high - low) / step, values.min(), values.max()), dtype=np.float64)


def resample_output(time: Array, values: Array, clock: Array, step: float) -> Resampled:
    """A measured signal at each clock instant, shape (len(clock),), with its noise gain.

    When the sensor is faster than the clock: of the straight lines between the samples (1 + a) times the mean over a window about
    the instant, less a times that over one twice as wide; a is such that a parabola stays as it is, whatever the times of its samples.
    It has no delay. The window is as wide as leaves neighbours on the clock uncorrelated (`NARROWER`). Tones are let through by 0.75 at half the
    clock's rate, by -0.22 at the whole and by -0.14 at one and a half of it. Near the ends of the record the windows shrink evenly
    on both sides, so that they stay centred. Otherwise: the straight line between the neighbouring samples.
    """
    per_step = step / float(np.median(np.diff(time)))
    if per_step < DECIMATION_FROM:
        return Resampled(values=np.interp(clock, time, values), noise_gain=1.0)
    half = np.minimum(_half_width(per_step) * step, 0.5 * _room(time, clock))
    # What the straight lines' means make of a parabola about each instant: the square of a distance, where the parabola has none.
    middle = 0.5 * (time[0] + time[-1])
    squares, at = (time - middle) ** 2, (clock - middle) ** 2
    near, far = (_window_mean(time, squares, clock, size * half) - at for size in (1.0, 2.0))
    more = _wider_share(near, far)
    one, two = (_window_mean(time, values, clock, size * half) for size in (1.0, 2.0))
    return Resampled(values=(1.0 + more) * one - more * two, noise_gain=window_noise_gain(per_step))


def _half_width(samples_per_step: float) -> float:
    """Of the narrower window of `resample_output`, in steps."""
    return 0.5 * NARROWER if samples_per_step >= FEW else 0.5


def _wider_share(near: Array, far: Array) -> Array:
    """a of `resample_output`, from the second moments of the narrower and of the wider window. Where neither sees a curvature, 0."""
    wider = far - near
    return np.asarray(np.clip(np.where(wider > 0.0, near, 0.0) / np.where(wider > 0.0, wider, 1.0), 0.0, 1.0))


def _room(time: Array, clock: Array) -> Array:
    """From each instant to the nearer end of the record; 0 beyond."""
    return np.asarray(np.maximum(np.minimum(clock - time[0], time[-1] - clock), 0.0))


def _window_mean(time: Array, values: Array, clock: Array, half: Array) -> Array:
    """Mean of the straight lines between the samples over `half` (s) either side of each instant; the value there where it is next to zero."""
    # The integral grows along the run while a window's share does not: centred values keep the rounding small.
    centre = float(np.mean(values))
    low, high = _piecewise_linear_integral(time, values - centre, np.stack([clock - half, clock + half]))
    wide = half > 1e-6 * float(np.median(np.diff(time)))
    mean = centre + (high - low) / np.where(wide, 2.0 * half, 1.0)
    return np.asarray(np.where(wide, mean, np.interp(clock, time, values)))


def resample_with_gaps(time: Array, values: Array, clock: Array, step: float) -> Resampled:
    """As `resample_output` where samples are missing (nan, or no row for several intervals): nan where too much is.

    Shorter gaps are bridged by straight lines, so that one lost sample of many in a step loses no step.
    """
    known = np.isfinite(values)
    if not known.any():
        return Resampled(np.full(clock.size, np.nan), 1.0)
    # A stretch without rows is one of missing samples at its usual interval.
    usual = float(np.median(np.diff(time)))
    long = np.flatnonzero(np.diff(time) > GAP_INTERVALS * usual)
    at = np.sort(np.concatenate([time, time[long] + usual, time[long + 1] - usual]))
    here = np.searchsorted(time, at)
    measured = np.isclose(time[np.minimum(here, time.size - 1)], at, rtol=0.0, atol=1e-9 * usual)
    lost = ~(measured & known[np.minimum(here, time.size - 1)])
    result = resample_output(time, np.interp(time, time[known], values[known]), clock, step)
    window = np.minimum(0.5 * step, _room(at, clock)) if step >= DECIMATION_FROM * usual else np.zeros(clock.size)
    made_up = _window_mean(at, lost.astype(np.float64), clock, window)
    return Resampled(np.where(made_up > MADE_UP, np.nan, result.values), result.noise_gain)


def window_noise_gain(samples_per_step: float) -> float:
    """Sigma of white noise after `resample_output`, over its sigma before; about 1.09/sqrt(samples).

    Where the first instant is on a sample, over the places between samples that the next ones have.
    """
    phases = np.unique(np.round(np.arange(PHASES) * samples_per_step % 1.0, 3))
    return float(np.sqrt(np.mean([_squared_weights(samples_per_step, float(phase)) for phase in phases])))


def _squared_weights(samples_per_step: float, phase: float) -> float:
    """Sum of the squared weights of the samples, of an instant so much after one of them; a sample weighs the integral over the window of
    the hat function centred on it."""
    half = _half_width(samples_per_step) * samples_per_step
    reach = np.arange(-int(2.0 * half) - 3, int(2.0 * half) + 4, dtype=np.float64) - phase

    def hat_integral(at: Array) -> Array:
        inside = np.clip(at, -1.0, 1.0)
        return np.where(inside < 0.0, 0.5 * (1.0 + inside) ** 2, 1.0 - 0.5 * (1.0 - inside) ** 2)

    one, two = ((hat_integral(h - reach) - hat_integral(-h - reach)) / (2.0 * h) for h in (half, 2.0 * half))
    more = _wider_share(np.asarray(one @ reach**2), np.asarray(two @ reach**2))
    return float(np.sum(((1.0 + more) * one - more * two) ** 2))
