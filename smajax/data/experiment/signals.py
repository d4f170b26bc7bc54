"""The measured files of one run, brought to the experiment's clock."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Collection, Mapping
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from smajax.core.units import convert, parse_quantity
from smajax.data.experiment.bench_mass import parse_mass
from smajax.data.experiment.column_guess import TIME
from smajax.data.experiment.column_overrides import own_columns
from smajax.data.experiment.errors import ExperimentError, at_key
from smajax.data.experiment.reading_limits import check_readings
from smajax.data.experiment.record import Run
from smajax.data.experiment.schema import ChannelSection, RunSection, TimeSection, is_counted
from smajax.data.readers.duplicate_times import once
from smajax.data.readers.noise import detect_quantum
from smajax.data.readers.resample import resample_input, resample_output, resample_with_gaps, uniform_clock
from smajax.data.readers.table import Array, MeasuredDataError, NoColumnError, Table, check_time

MOST_SAMPLES = 2_000_000


@dataclass(frozen=True)
class Signal:
    """One channel as measured, in the program's own unit: time and values, both (n,); nan where one is missing.

    repeated: how many samples at a time that another one has were taken out. unit: the log's own, which sentences about the log have; own: the
    program's.
    """

    time: Array
    values: Array
    repeated: int = 0
    unit: str = ""
    own: str = ""

    @property
    def measured(self) -> Array:
        """The values that are there."""
        return self.values[np.isfinite(self.values)]

    def as_logged(self, value: float, difference: bool = False) -> str:
        """A value in the program's unit, in the log's: `0.1 deg`."""
        if not self.unit:
            return f"{value:.4g}"
        shown = "" if self.unit in ("-", "1") else self.unit
        return f"{float(convert(value, self.own, self.unit, difference)):.4g} {shown}".rstrip()


@dataclass(frozen=True)
class ReadRun:
    """A run on the clock, and what of its raw signals the noise estimate and the warnings need.

    signals: channel -> as measured. By output, noise_gain: sigma of its white noise on the clock over that of the sensor;
    quantum: the sensor's increment, 0.0 when none shows. skipping: outputs of which samples may be missing.
    """

    run: Run
    signals: Mapping[str, Signal]
    noise_gain: Mapping[str, float]
    quantum: Mapping[str, float]
    skipping: frozenset[str]


@dataclass(frozen=True)
class Reading:
    """What is common to the runs of one experiment file: where to look and what to turn it into.

    units: channel or input -> the program's own unit. inputs_sampled, inputs_squared: see ModelDescription. tables: reads a file, once however often it is asked for.
    timed: whether samples have times. others: whether logs of other runs have these columns.
    """

    path: Path
    folder: Path
    channels: Mapping[str, ChannelSection]
    time: TimeSection | None
    units: Mapping[str, str]
    output_names: tuple[str, ...]
    inputs_sampled: frozenset[str]
    inputs_squared: frozenset[str]
    step: float
    timed: bool
    tables: Callable[[Path], Table]
    others: bool = False


def _inside(reading: Reading, key: str, name: str) -> Path:
    """A measured file, which lies in the data folder, also once links are followed: what a file asks for is read from nowhere else."""
    try:
        file, folder = reading.folder / name, reading.folder.resolve()
        with suppress(FileNotFoundError):
            file.stat()  # since Python 3.13 it is not `resolve` that finds a link which leads to itself
        if not Path(name).is_absolute() and file.resolve().is_relative_to(folder):
            return file
    except (
        OSError,
        RuntimeError,
        ValueError,
    ) as error:  # a link that leads to itself, a character that no name may have
        raise ExperimentError(reading.path, key, f"got {name!r}, which is no file's name ({error})") from None
    raise ExperimentError(
        reading.path,
        key,
        f"got {name!r}, which leads out of the data folder {folder}; expected a file inside of it: put it there, or say under "
        "[data] folder where the files are",
    )


def _channel_file(reading: Reading, run: RunSection, name: str) -> tuple[str, Path]:
    """(key path, file) of one channel in one run."""
    if run.file is not None:
        return f"runs.{run.name}.file", _inside(reading, f"runs.{run.name}.file", run.file)
    files = run.files or {}
    if name not in files:
        raise ExperimentError(
            reading.path, f"runs.{run.name}.files", f"gives no file for channel {name!r}; add {name} = '...'"
        )
    key = f"runs.{run.name}.files.{name}"
    return key, _inside(reading, key, files[name])


def _signal(
    table: Table,
    name: str,
    key: str | int,
    channel: ChannelSection,
    own_unit: str,
    time: TimeSection | None,
    taken: Collection[str | int],
    step: float | None,
) -> Signal:
    """One channel from its table. taken: the columns of the time and the other channels. step: s between samples that are counted; None where nothing says it. Raises MeasuredDataError."""
    try:
        written = table.column(key, taken, gaps=channel.missing == "skip")
        values = convert(written, channel.unit, own_unit)
    except MeasuredDataError as error:
        if channel.role == "input" or channel.missing == "skip" or not table.has_gaps(key):
            raise
        raise MeasuredDataError(f"{error}; or write missing = 'skip' for this output, which leaves them out") from None
    column = f"{table.path}: column {table.name_of(key, taken)!r}"
    check_readings(
        name,
        channel.role == "input",
        values,
        lambda at: f"{column} is {written[at]:g} {channel.unit} in {table.place(at)}",
    )
    values = -values if channel.reversed else values
    clock = table.clock(key)
    where, unit = f"{table.path}: the time of {key!r}", "s"
    if is_counted(time) and (clock is None or step is None):
        clock = (step or 1.0) * np.arange(values.size, dtype=np.float64)
    elif clock is None:
        if time is None or time.column is None:
            raise MeasuredDataError(
                f"{table.path}: {key!r} carries no time; add [time] with column = '...', or kind = 'sample'"
            )
        clock, unit = table.column(time.column, {*taken, key}), time.unit
        if unit != "s" and table.name_of(time.column) in table.moments:
            raise MeasuredDataError(
                f"{table.path}: column {time.column!r} holds clock times, which are read as seconds from the first one, and [time] "
                f"says unit = {unit!r}; write unit = 's'"
            )
        where = f"{table.path}: time column {table.name_of(time.column)!r}"
    if clock.size != values.size:
        raise MeasuredDataError(f"{table.path}: {key!r} has {values.size} values and its time has {clock.size}")
    how = "refuse" if time is None else time.repeated
    # Before the conversion, so that an error shows what is written in the file.
    if np.isfinite(clock).all():
        clock, values, repeated = once(clock, values, how)
    else:
        repeated = 0
    try:
        check_time(clock, where, unit, table.place if not repeated else lambda index: f"sample {index + 1}")
    except MeasuredDataError as error:
        if how == "refuse" and time is not None and np.all(np.diff(clock) >= 0.0) and clock.size > 1:
            raise MeasuredDataError(f"{error}; or write repeated = 'mean' (or 'last') under [time]") from None
        raise
    return Signal(convert(clock, unit, "s"), values, repeated, channel.unit, own_unit)


def _taken(reading: Reading, name: str) -> frozenset[str | int]:
    """The columns and variables that the experiment file gives to the time and to the channels other than `name`."""
    others = [channel for other, channel in reading.channels.items() if other != name]
    keys = [key for channel in others for key in (channel.column, channel.variable)]
    keys.append(reading.time.column if reading.time is not None else None)
    return frozenset(key for key in keys if key is not None)


def _read_signals(reading: Reading, run: RunSection) -> tuple[dict[str, Signal], tuple[Path, ...]]:
    """Every channel of the run that is not a constant, and the files they are from."""
    signals: dict[str, Signal] = {}
    used: dict[Path, None] = {}
    first: dict[str, int] = {}  # ns, by the file's clock, since when the channel's times count
    for name, channel in reading.channels.items():
        if name in run.inputs:
            continue
        key = channel.variable if channel.variable is not None else channel.column
        if key is None:
            raise ExperimentError(
                reading.path,
                f"channels.{name}",
                f"has no column or variable and run {run.name!r} gives no constant; give one of the three "
                f"(the constant as {name} = 'number unit' in the run's [runs.inputs])",
            )
        where, file = _channel_file(reading, run, name)
        with at_key(reading.path, where):
            table = reading.tables(file)
            try:
                own_unit, taken = reading.units[name], _taken(reading, name)
                signals[name] = _signal(
                    table, name, key, channel, own_unit, reading.time, taken, reading.step if reading.timed else None
                )
            except NoColumnError as error:
                own = TIME if reading.time is not None and error.key == reading.time.column else name
                hint = f"; where this log alone has another one, write columns = {{ {own} = '...' }} under its [[runs]] in the experiment file"
                raise MeasuredDataError(f"{error}{hint if reading.others else ''}") from None
            if table.clock(key) is None and reading.time is not None and reading.time.column is not None:
                moment = table.moments.get(table.name_of(reading.time.column))
                first |= {} if moment is None else {name: moment}
        used[file] = None
    if first.keys() == signals.keys():  # files that began at different times of one clock
        begun = min(first.values())
        signals = {name: replace(one, time=one.time + (first[name] - begun) / 1e9) for name, one in signals.items()}
    return signals, tuple(used)


def _digest(files: tuple[Path, ...]) -> str:
    digest = hashlib.sha256()
    for file in files:
        with file.open("rb") as opened:
            while part := opened.read(1 << 20):
                digest.update(part)
    return digest.hexdigest()


def time_unit(time: TimeSection | None) -> str:
    """What a file's times are in, and with them what a bare number in the experiment file is meant in."""
    return "s" if time is None or is_counted(time) else time.unit


def _kept(path: Path, run: RunSection, start: float, end: float, unit: str) -> tuple[float, float]:
    """The part of a log, `start` to `end` in s, that the run's own `start` and `end` leave. unit: of a bare number, in a message."""
    where = f"runs.{run.name}"
    for key, given in (("start", run.start), ("end", run.end)):
        if given is None:
            continue
        with at_key(path, f"{where}.{key}"):
            at = parse_quantity(given, "s", offered=unit)
        if not start < at < end and at != (start if key == "start" else end):
            raise ExperimentError(
                path, f"{where}.{key}", f"got {given!r}, expected a time of the log between {start:g} s and {end:g} s"
            )
        start, end = (at, end) if key == "start" else (start, at)
    return start, end


def _constant(name: str, value: str | float, unit: str) -> float:
    """An input that a run holds. Raises UnitError, and MeasuredDataError for what it cannot be."""
    result = parse_mass(value) if unit == "kg" else parse_quantity(value, unit)
    check_readings(name, True, np.asarray([result]), lambda _: f"got {value!r}")
    return result


def read_run(reading: Reading, run: RunSection, parameters: dict[str, float]) -> ReadRun:
    """Reads one run. Its clock covers the time that all its signals have in common. Raises ExperimentError."""
    where = f"runs.{run.name}"
    channels, time = own_columns(reading.path, run, reading.channels, reading.time)
    reading = replace(reading, channels=channels, time=time)
    for name, unit in run.units.items():
        with at_key(reading.path, f"{where}.units.{name}"):
            convert(0.0, unit, "s" if name == TIME else reading.units[name])
    signals, files = _read_signals(reading, run)
    start = max(signal.time[0] for signal in signals.values())
    end = min(signal.time[-1] for signal in signals.values())
    start, end = _kept(reading.path, run, start, end, time_unit(reading.time))
    if end <= start:
        spans = ", ".join(f"{name} {s.time[0]:g}..{s.time[-1]:g} s" for name, s in signals.items())
        raise ExperimentError(
            reading.path, where, f"its signals have no time in common ({spans}); check files and units"
        )
    if (end - start) / reading.step > MOST_SAMPLES:
        raise ExperimentError(
            reading.path,
            "sampling.step",
            f"{reading.step:g} s cuts run {run.name!r} into over {MOST_SAMPLES} samples; take a longer step",
        )
    clock = uniform_clock(start, end, reading.step)
    if clock.size < 2:
        raise ExperimentError(
            reading.path,
            "sampling.step",
            f"run {run.name!r} lasts {end - start:g} s, less than a step of {reading.step:g} s; take a shorter step, or correct "
            "the unit of the time",
        )
    inputs: dict[str, Array] = {}
    for name, signal in signals.items():
        if name in reading.inputs_sampled:
            inputs[name] = resample_output(signal.time, signal.values, clock, reading.step).values
        elif name not in reading.output_names:
            inputs[name] = resample_input(
                signal.time, signal.values, clock, reading.step, squared=name in reading.inputs_squared
            )
    for name, value in run.inputs.items():
        with at_key(reading.path, f"{where}.inputs.{name}"):
            inputs[name] = np.full(clock.size, _constant(name, value, reading.units[name]))
    skipping = frozenset(name for name in reading.output_names if reading.channels[name].missing == "skip")
    outputs = {
        name: (resample_with_gaps if name in skipping else resample_output)(
            signals[name].time, signals[name].values, clock, reading.step
        )
        for name in reading.output_names
    }
    return ReadRun(
        run=Run(
            name=run.name,
            role=run.role,
            time=clock,
            inputs=inputs,
            outputs={name: output.values for name, output in outputs.items()},
            parameters=parameters,
            files=files,
            sha256=_digest(files),
        ),
        signals=signals,
        noise_gain={name: output.noise_gain for name, output in outputs.items()},
        quantum={name: detect_quantum(signals[name].measured) for name in outputs},
        skipping=skipping,
    )
