"""What lies between a plant and its controller, and where it comes from, in words."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence

from smajax.control.loop_settings import LIMIT_PARAMETER, OPTIONS, PERIOD, LoopSettings
from smajax.control.run_notes import (
    GainsOfFile,
    InputLagLeftOut,
    LimitOfFitRuns,
    NoiseOfModelFile,
    PresetGains,
    Source,
    VoltagesOfLimit,
)
from smajax.core.display_units import digits, display
from smajax.core.wording import and_listed, counted

SAY_ANOTHER = and_listed([*OPTIONS.values(), "--noise"])  # options of what a loop takes from a file of gains


def limit_words(loop: LoopSettings, largest: float | None = None) -> str:
    """Up to which command the loop goes, and by which of its two limits. largest: the controller's own, in the command's unit; None or infinite where it says none."""
    largest = None if largest is None or math.isinf(largest) else largest
    limits = {"controller": largest, "drive": loop.command_limit}
    known = {of: f"{digits(one, 4)} {loop.command_unit}" for of, one in limits.items() if one is not None}
    if largest is None or loop.command_limit is None or known["controller"] == known["drive"]:
        return f"up to {next(iter(known.values()))}" if known else "no limit"
    least, other = ("controller", "drive") if largest < loop.command_limit else ("drive", "controller")
    return f"up to {known[least]}, the limit of the {least}; that of the {other} is {known[other]}"


def loop_rows(loop: LoopSettings, largest: float | None = None) -> list[list[str]]:
    """A row a setting: limit of the command, period, delay, filter, sensor. largest: as `limit_words`'."""
    return [
        ["limit of the command", limit_words(loop, largest)],
        ["control period", "not known" if loop.period is None else f"{1e3 * loop.period:g} ms"],
        ["delay of the command", counted(loop.delay, "control period") if loop.delay else "no delay"],
        [
            "what the controller reads",
            f"the state from the filter {loop.estimator}" if loop.estimator else "the true state",
        ],
        ["sensor of the position", noise_words(loop)],
    ]


def loop_words(loop: LoopSettings, largest: float | None = None) -> str:
    """`the drive's limit of 6 V, a control period of 10 ms and no delay`; "" of nothing known. The sensor is the plant's, and left out.

    largest: the controller's own, in the command's unit, which holds where it is the lower one.
    """
    parts = []
    if loop.command_limit is not None:
        of_drive = f"{digits(loop.command_limit, 4)} {loop.command_unit}"
        of_controller = of_drive if largest is None else f"{digits(largest, 4)} {loop.command_unit}"
        lower = largest is not None and largest < loop.command_limit and of_controller != of_drive
        parts.append(
            f"the controller's limit of {of_controller} (the drive's is {of_drive})"
            if lower
            else f"the drive's limit of {of_drive}"
        )
    if loop.period is not None:
        parts.append(f"a control period of {1e3 * loop.period:g} ms")
    if loop.delay is not None:
        parts.append(f"a delay of {counted(loop.delay, 'period')}" if loop.delay else "no delay")
    if loop.estimator is not None:
        parts.append(f"the filter `{loop.estimator}`" if loop.estimator else "the true state without a filter")
    return and_listed(parts) if parts else ""


def noise_words(loop: LoopSettings) -> str:
    """`0.1 mm of noise, in steps of 0.02 mm`, or `no noise`."""
    shown = display(loop.position_unit)
    said = f"{shown.with_unit(loop.noise, 3)} of noise" if loop.noise else "no noise"
    return said + (f", in steps of {shown.with_unit(loop.quantum, 3)}" if loop.quantum else "")


def source_sentences(sources: Iterable[Source]) -> tuple[str, ...]:
    """Where a loop's settings come from; nothing of a file of which the loop takes nothing beside the gains."""
    return tuple(text for one in sources if (text := source_sentence(one)))


def source_sentence(source: Source | None) -> str:
    """Of one source; "" of none."""
    match source:
        case LimitOfFitRuns(command, unit, largest):
            return (
                f"The {command} is limited to {digits(largest, 4)} {unit}, the largest of the runs that the model was fitted to; give "
                f"{LIMIT_PARAMETER} in the model file or with --set for another limit."
            )
        case NoiseOfModelFile(noise, reading, unit, of_sample):
            shown = display(unit, reading)
            said, sample = (shown.with_unit(one or 0.0, 3) for one in (noise, of_sample))
            single = f" of a single reading (a sample of its fit has {sample})" if of_sample else ""
            return f"The sensor has the noise of the model file, {said} (1 sigma){single}; --noise gives another one, --noise 0 none."
        case PresetGains(controller, scaled):
            how = ", scaled from the arm to this load's stroke, force and time" if scaled else ""
            return (
                f"No gains file: the gains are those of the preset of {controller}{how}, and not tuned on this plant; `smajax tune {controller}` "
                "tunes them, and --gains takes its gains.json."
            )
        case VoltagesOfLimit(limit, preset):
            low = "; low levels of a switch stay" if limit > preset else ""
            return (
                f"The drive's limit is {digits(limit, 4)} V and was {digits(preset, 4)} V where the gains of the presets were searched: their voltages are "
                f"{digits(limit / preset, 3)} times as large{low}."
            )
        case InputLagLeftOut():
            return _input_lag_sentence(source)
        case GainsOfFile():
            return _gains_sentence(source)
    return ""


def _input_lag_sentence(source: InputLagLeftOut) -> str:
    """What the model has of its logs and the loop has not, and the option for a command that is late on the bench too."""
    if source.delay is None:
        return f"The model's {source.effect} is of the clocks of its logs, and left out of the loop."
    what = f"The model's {source.effect} of {digits(1e3 * source.delay, 3)} ms is of its logs, and left out of the loop"
    if source.delay <= 0.0:
        return f"{what}: below zero it is a clock of the logs, and no delay of the bench."
    periods = max(1, math.ceil(source.delay / PERIOD - 1e-9))
    return (
        f"{what}. Where commands are late on the bench too, not only in the logs, give the loop its delay in control periods: --delay {periods} at "
        f"{1e3 * PERIOD:g} ms each."
    )


def _gains_sentence(source: GainsOfFile) -> str:
    """What the loop takes from a file of gains, and what it means where the file is older and says nothing."""
    if source.older:
        return (
            f"The gains of {source.controller} are from a file that says neither limit, filter nor control period (an older version, or written "
            f"by hand): those of this plant and of the options hold, {loop_words(source.own, source.largest)}."
        )
    others = [f"{name} {digits(value, 4)}" for name, value in source.fixed.items()]
    words = [one for one in (loop_words(source.taken, source.largest), *others) if one]
    if set(source.compared) - {source.controller}:
        return _of_all_sentence(source, others)
    return f"As in the file of the gains of {source.controller}: {', '.join(words)}." if words else ""


def _of_all_sentence(source: GainsOfFile, others: Sequence[str]) -> str:
    """Of a sweep of several controllers: what they all take from the file of one of them, and what is of that one alone."""
    # The largest command is each controller's own; the drive is of all.
    shared = loop_words(source.taken)
    sensor = f", {noise_words(source.own)}" if source.taken.estimator == "" else ""
    lower = "" if source.taken.command_limit is None else " (a controller's own limit holds where it is lower)"
    said = ""
    if shared:
        said = (
            f"As in the file of the gains of {source.controller}, for all controllers of this sweep ({and_listed(source.compared)}), which are "
            f"compared in one loop: {shared}{sensor}{lower}; {SAY_ANOTHER} say another."
        )
    own = f"For {source.controller} alone, as in its file: {', '.join(others)}." if others else ""
    return " ".join(one for one in (said, own) if one)
