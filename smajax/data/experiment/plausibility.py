"""Warnings about measured runs that are allowed and look wrong."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from smajax.core.wording import and_listed, counted
from smajax.data.experiment.column_guess import DRIVES
from smajax.data.experiment.record import Run
from smajax.data.experiment.schema import RunSection, TimeSection, is_counted
from smajax.data.experiment.signals import ReadRun, Signal, time_unit
from smajax.data.readers.table import Array

FEW_SAMPLES = 20
GAP_STEPS = 5.0
FLAT_SAMPLES = 5
# Intervals that differ by more than this share of the usual one, and the share of them that makes a clock uneven.
UNEVEN, UNEVEN_SHARE = 0.2, 0.1
# From this share of intervals beyond GAP_STEPS of the usual one they are no gaps, but another sampling rate.
TWO_RATES = 0.02
# Seconds: longer than most runs of a wire; a run of eleven seconds lasts that long when its ms are taken for s.
LONGEST_RUN = 3.0 * 3600.0
# Beside a held-out run two fit runs are what three logs give; without one, two that disagree leave open which of them is wrong.
FEWEST_FIT_RUNS, FEWEST_BESIDE_HELD_OUT = 3, 2
# Times the width of what nearly all samples lie in from which on one is far off, and the share of a run that may be.
FAR_OFF, FEW_FAR = 10.0, 0.01


def _sticks_at(values: Array, extreme: float) -> bool:
    """Whether the signal runs into `extreme` and stays exactly there, as one cut off by its range does.

    Coming to rest looks the same except for the speed of arrival, so only a fast one counts.
    """
    at = values == extreme
    edges = np.flatnonzero(np.diff(np.concatenate([[0], at.astype(np.int8), [0]])))
    fast = 0.02 * float(np.ptp(values))
    for begin, end in zip(edges[::2], edges[1::2], strict=True):
        if end - begin < FLAT_SAMPLES:
            continue
        before = values[max(begin - 2, 0)]
        after = values[min(end + 1, values.size - 1)]
        if abs(before - extreme) > fast or abs(after - extreme) > fast:
            return True
    return False


def _far_off(run: str, name: str, signal: Signal) -> list[str]:
    """Single samples far from all others: a sensor that dropped out, a number that stands for none."""
    times, values = signal.time[np.isfinite(signal.values)], signal.measured
    low, middle, high = np.percentile(values, [1.0, 50.0, 99.0])
    far = np.abs(values - middle) > FAR_OFF * (high - low)
    if high == low or not 0 < far.sum() <= max(1.0, FEW_FAR * values.size):
        return []
    first = int(np.argmax(far))
    return [
        f"run {run!r}: {counted(int(far.sum()), 'sample')} of the output {name!r} {'lies' if far.sum() == 1 else 'lie'} far from all "
        f"others, the first at {times[first]:.6g} s with {values[first]:.5g} (the others from {low:.4g} to {high:.4g}): did the sensor "
        "drop out?"
    ]


def _output_warnings(run: str, name: str, signal: Signal) -> list[str]:
    values = signal.measured
    if not values.size:
        return [f"run {run!r}: the output {name!r} has no sample"]
    if np.ptp(values) == 0.0:
        return [f"run {run!r}: the output {name!r} is constant ({values[0]:g}); nothing can be learnt from it"]
    result = _far_off(run, name, signal)
    cut = [
        word for word, extreme in (("highest", values.max()), ("lowest", values.min())) if _sticks_at(values, extreme)
    ]
    return result + [
        f"run {run!r}: the output {name!r} runs into its {word} value and stays exactly there; "
        "is the sensor at the end of its range, or the load at a stop?"
        for word in cut
    ]


def _repeated_warnings(run: str, signals: Mapping[str, Signal]) -> list[str]:
    """Samples that were taken out: one sentence for all signals that lost as many, as those of one log do."""
    numbers = sorted({signal.repeated for signal in signals.values()} - {0}, reverse=True)
    names = {number: [repr(name) for name, one in signals.items() if one.repeated == number] for number in numbers}
    return [
        f"run {run!r}: {counted(number, 'sample')} of {and_listed(names[number])} at a time that another one has "
        f"{'was' if number == 1 else 'were'} taken out"
        for number in numbers
    ]


def _time_warnings(run: str, name: str, signal: Signal, is_output: bool) -> list[str]:
    intervals = np.diff(signal.time)
    usual = float(np.median(intervals))
    longest = int(np.argmax(intervals))
    result: list[str] = []
    uneven = float(np.mean(np.abs(intervals - usual) > UNEVEN * usual))
    if uneven > UNEVEN_SHARE:
        low, high = np.percentile(intervals, [5.0, 95.0])
        result.append(
            f"run {run!r}: {name!r} is sampled unevenly ({low:.3g} to {high:.3g} s apart); it is brought to the even clock "
            "by its own times"
        )
    if intervals[longest] <= GAP_STEPS * usual:
        return result
    slow = intervals > GAP_STEPS * usual
    if slow.mean() > TWO_RATES:
        return [
            *result,
            f"run {run!r}: {name!r} is sampled at two rates, every {usual:.4g} s and every {np.median(intervals[slow]):.4g} s, "
            f"the latter first at {signal.time[int(np.argmax(slow))]:.6g} s; between samples it is bridged",
        ]
    return [
        *result,
        f"run {run!r}: {name!r} has a gap of {intervals[longest]:.4g} s at {signal.time[longest]:.6g} s "
        f"(usual interval {usual:.4g} s); it is bridged, check that nothing happened in it"
        + (", or write missing = 'skip' for this output, which leaves it out" if is_output else ""),
    ]


def run_warnings(read: ReadRun, step: float) -> list[str]:
    """What looks wrong in one run, one sentence each."""
    run = read.run
    result: list[str] = []
    if run.time.size < FEW_SAMPLES:
        result.append(f"run {run.name!r}: only {run.time.size} samples at a step of {step:g} s; is the step too long?")
    clocked = {name: signal for name, signal in read.signals.items() if name not in read.skipping}
    result += _repeated_warnings(run.name, clocked)
    for name, signal in clocked.items():
        result += _time_warnings(run.name, name, signal, name in run.outputs)
    duty = run.inputs.get("duty")
    if duty is not None and (duty.min() < 0.0 or duty.max() > 1.0):
        result.append(
            f"run {run.name!r}: the duty goes from {duty.min():g} to {duty.max():g}, outside 0 to 1; is it in percent?"
        )
    for output_name in run.outputs:
        output = read.signals[output_name]
        result += _output_warnings(run.name, output_name, output)
        sensor_step = float(np.median(np.diff(output.time)))
        if step < 0.95 * sensor_step:
            whose = "the sensor's" if len(run.outputs) == 1 else f"{output_name!r}'s"
            result.append(
                f"run {run.name!r}: the step of {step:g} s is shorter than {whose} {sensor_step:g} s; values between "
                "two samples are interpolated and their errors are not independent"
            )
    return result


def constant_warnings(runs: Sequence[ReadRun]) -> list[str]:
    """Inputs with one value in all runs although they are read from files: the wrong column looks like that.

    Another constant in each run is no such thing: a mass that was exchanged between runs looks like that.
    """
    still = [
        name
        for name in runs[0].signals
        if name not in runs[0].run.outputs
        and np.ptp(np.concatenate([read.signals[name].values for read in runs if name in read.signals])) == 0.0
    ]
    result = [f"the input {name!r} never changes in any run; is it the right column?" for name in still]
    return result + [line for name in DRIVES for line in _zero_in_a_run(runs, name) if name not in still]


def _zero_in_a_run(runs: Sequence[ReadRun], name: str) -> list[str]:
    """Runs without any heating in which an output goes half as far as in another run and back. One way alone it goes in a wire that cools."""
    result = []
    for read in runs:
        cold = name in read.signals and not read.signals[name].values.any()
        others = [one for one in read.signals if one != name and one not in read.run.outputs]
        if not cold or any(np.ptp(read.signals[one].values) > 0.0 for one in others):
            continue
        if any(_returns(read.signals[one].measured) > 0.5 * _largest(runs, one, read) for one in read.run.outputs):
            result.append(
                f"run {read.run.name!r}: the input {name!r} is 0 throughout, and the output moves: is it the right column?"
            )
    return result


def _returns(values: Array) -> float:
    """The lesser of the largest rise and the largest fall."""
    if not values.size:
        return 0.0
    rise = np.max(values - np.minimum.accumulate(values))
    return float(min(rise, np.max(np.maximum.accumulate(values) - values)))


def _largest(runs: Sequence[ReadRun], output: str, but: ReadRun) -> float:
    """Range of an output in the other run in which it is largest; infinite where no other run has it."""
    ranges = [
        float(np.ptp(read.signals[output].measured))
        for read in runs
        if read is not but and output in read.signals and read.signals[output].measured.size
    ]
    return max(ranges, default=np.inf)


def quantum_warning(runs: Sequence[ReadRun], name: str, sensor_noise: float) -> list[str]:
    """Whether the sensor's increment exceeds its noise, both before resampling and in the program's unit; the sentence has the log's."""
    quantum = float(np.median([read.quantum[name] for read in runs]))
    if quantum <= sensor_noise:
        return []
    whose = "the output's" if len(runs[0].run.outputs) == 1 else f"{name!r}'s"
    increment, noise = (runs[0].signals[name].as_logged(one, difference=True) for one in (quantum, sensor_noise))
    return [
        f"{whose} increment of {increment} is larger than its noise of {noise} at the "
        "sensor's rate; residuals of that size are rounding"
    ]


def copy_warnings(runs: Sequence[ReadRun]) -> list[str]:
    """Runs that are the same files: a held-out run that was fitted too proves nothing."""
    first: dict[str, str] = {}
    result: list[str] = []
    for read in runs:
        twin = first.setdefault(read.run.sha256, read.run.name)
        if twin != read.run.name:
            result.append(f"runs {twin!r} and {read.run.name!r} have the same data")
    return result


def length_warnings(runs: Sequence[ReadRun], time: TimeSection | None) -> list[str]:
    """Runs of hours. time: where the file says that it is; None where the signals carry their own."""
    unit = time_unit(time)
    question = "is the time in ms?" if unit == "s" else f"is the time in {unit}, as [time] says?"
    if is_counted(time):
        question = "is the step under [sampling] the time from one sample to the next?"
    lengths = {read.run.name: read.run.time[-1] - read.run.time[0] for read in runs}
    return [
        f"run {name!r} lasts {length:.5g} s; {question}" for name, length in lengths.items() if length > LONGEST_RUN
    ]


def role_warnings(runs: Sequence[RunSection] | Sequence[Run]) -> list[str]:
    """What cannot be told from so few runs."""
    result: list[str] = []
    fit = sum(run.role == "fit" for run in runs)
    if fit < (FEWEST_FIT_RUNS if fit == len(runs) else FEWEST_BESIDE_HELD_OUT):
        result.append(
            f"only {fit} fit {'run' if fit == 1 else 'runs'}: how far the fitted values differ from run to run cannot be seen; "
            "give at least three of different kinds"
        )
    if fit == len(runs):
        result.append("no run is held out: the error after is shown on no run that the fit never saw")
    return result
