"""A single run in sentences and in rows of tables."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import xarray as xr

from smajax.control.figures_of_merit import STEADY_SHARE, SetPointMerit, band_of, merit_units
from smajax.control.loop_dataset import ESTIMATE, SAMPLED
from smajax.control.mismatch import in_words
from smajax.control.run_notes import NotResolved
from smajax.control.run_request import MEASURED
from smajax.control.run_result import RunResult
from smajax.core.display_units import axis_label, digits, display, label
from smajax.core.wording import and_listed
from smajax.model.load.base import AbstractMovingLoad
from smajax.report.measured_log import measured_of, measured_sentences

AT_STOP = 1e-3  # of the way moved: nearer is at a stop
STILL = 1e-3  # a smaller change of the martensite fraction is no transformation
ROUNDING = 1e-9  # of the way moved: nearer to zero is a rounding error
MISMATCH_HEAD = ("parameter", "the controller assumes", "the plant has", "unit", "difference")


def integration_error(data: xr.Dataset) -> dict[str, Any]:
    """What the integration leaves in the variables, as `IntegrationError.record`; empty where nothing is known of it."""
    return dict(json.loads(data.attrs.get("integration_error", "{}")))


def error_rows(data: xr.Dataset) -> dict[str, str]:
    """What the integration leaves in each variable of `summary_rows` by its label, root mean square, in the unit that is shown."""
    shown = {str(name): one.attrs for name, one in data.data_vars.items()}
    return {
        label(name): digits(display(of["units"], name).of(of["integration_error"]), 2)
        if "integration_error" in of
        else ""
        for name, of in shown.items()
    }


def units_of(result: RunResult) -> dict[str, str]:
    """Of the figures of merit, SI."""
    return merit_units(result.system.load.reading[1])


def figures_of(one: SetPointMerit) -> dict[str, float]:
    return {name: float(value) for name, value in vars(one.merit).items()}


def moves(data: xr.Dataset) -> bool:
    """Whether the load has a position; a coupon's has no unit, and is zero as its velocity is."""
    return bool(data["position"].attrs["units"] != "-")


def reads_force(data: xr.Dataset) -> bool:
    """Whether the load's own sensor is a load cell."""
    return "force" in data and np.array_equal(data["reading"], data["force"], equal_nan=True)


def path_of(data: xr.Dataset) -> str:
    """The variable that a run is about."""
    return "strain" if not moves(data) else "force" if reads_force(data) else "position"


def reading_of(data: xr.Dataset) -> np.ndarray:
    """(n,): what the load's own sensor shows; where that has the noise of a loop's sensor, the true position."""
    return np.asarray(data["position" if SAMPLED in data["reading"].attrs else "reading"].to_numpy())


def _redundant(data: xr.Dataset) -> set[str]:
    """Variables to leave out: the position of a coupon, and a sensor reading that equals the true value."""
    moving = moves(data)
    true = ("position", "force") if moving else ("strain", "stress")
    again = any(np.array_equal(data["reading"], data[name], equal_nan=True) for name in true)
    return {*(() if moving else ("position", "velocity")), *(("reading",) if again else ())}


def summary_rows(data: xr.Dataset) -> list[list[str]]:
    """A row a variable: least, greatest, last, in the units that a reader sees; the reading where it is not the true value."""
    rows = []
    logged = [f"{MEASURED}{name}" for name in measured_of(data)]
    logged += [str(name) for name in data.data_vars if str(name).startswith(ESTIMATE)]
    for name, one in data.drop_vars([*_redundant(data), *logged]).data_vars.items():
        unit, values = display(one.attrs["units"], str(name)), one.to_numpy()
        least, greatest, last = float(values.min()), float(values.max()), float(values[-1])
        # A zero with rounding errors.
        rounding = 1e-12 * max(abs(least), abs(greatest))
        cells = [digits(unit.of(0.0 if abs(value) < rounding else value)) for value in (least, greatest, last)]
        rows.append([label(str(name)), *cells, unit.unit])
    return rows


def merit_rows(result: RunResult) -> list[list[str]]:
    """A row a figure of merit; the steady ones with the time over which they are means, since a short run may still be moving.

    Of a reference that has none of these the tracking error.
    """
    if result.tracking_error:
        return [[f"tracking error (RMS, {part})", *cells] for part, cells in _tracking(result).items()]
    units = units_of(result)
    steady = f" (last {STEADY_SHARE:.0%} of the run)"
    return [
        [
            label(name) + steady * name.startswith("steady"),
            _cell(name, value, units, float(result.data["time"][-1] - result.data["time"][0])),
            "" if np.isinf(value) else display(units[name], name).unit,
        ]
        for name, value in result.merit.items()
    ]


def _tracking(result: RunResult) -> dict[str, tuple[str, str]]:
    """(the tracking error, its unit) as shown, over each part of the run in words."""
    of = display(result.system.load.reading[1])
    return {part.replace("_", " "): (digits(of.of(error), 3), of.unit) for part, error in result.tracking_error.items()}


def _cell(name: str, value: float, units: Mapping[str, str], seconds: float) -> str:
    """seconds: how long the set point holds, within which an infinite time is not reached."""
    return _late(seconds) if np.isinf(value) else digits(display(units[name], name).of(value), 3)


def _late(seconds: float) -> str:
    """Of a time that does not come while a set point holds: it may come later."""
    return f"not within {digits(seconds, 3)} s"


def merit_rule(result: RunResult) -> str:
    """By which rule the times and errors of a closed loop are found; "" where it has none."""
    if not (result.merit or result.by_set_point):
        return ""
    of = display(result.system.load.reading[1])
    # A band of 1 degree in rad has rounding errors.
    near, share = (
        f"±{digits(of.of(float(band_of(result.assumed or result.system))), 3)} {of.unit}",
        f"{STEADY_SHARE:.0%}",
    )
    return (
        f"Reach time: first within {near} of the set point, or beyond it. Settling time: within {near} from then on, and over at least the last {share} of "
        f"the set point's time; a loop that is there later has not settled. Steady error: mean over the last {share}."
    )


def set_point_rows(result: RunResult) -> tuple[list[str], list[list[str]]]:
    """(head, rows): a row a set point, from its start to the next one."""
    units = units_of(result)
    of = display(result.system.load.reading[1])
    head = [
        f"set point ({of.unit})",
        "from (s)",
        "to (s)",
        *(axis_label(name, display(unit, name)) for name, unit in units.items()),
    ]
    rows = [
        [
            digits(of.of(one.set_point)),
            digits(one.begin),
            digits(one.end),
            *(_cell(name, value, units, one.end - one.begin) for name, value in figures_of(one).items()),
        ]
        for one in result.by_set_point
    ]
    return head, rows


def mismatch_rows(result: RunResult) -> list[list[str]]:
    """A row a parameter, as `MISMATCH_HEAD`, in SI as the parameters are."""
    return [
        [
            one.name,
            "not in its model" if one.assumed is None else digits(one.assumed, 6),
            digits(one.true, 6),
            one.unit,
            in_words(one.assumed, one.true, one.unit),
        ]
        for one in result.mismatches
    ]


def _transforms(data: xr.Dataset) -> bool:
    return float(np.ptp(data["martensite_fraction"].to_numpy())) >= STILL


def run_sentences(result: RunResult) -> list[str]:
    """The run in sentences: temperature, transformation, stroke; none where it has values that are not finite."""
    data = result.data
    if result.notes and not np.isfinite(data["temperature"]).all():
        return []

    def at(name: str, value: float) -> str:
        unit = display(data[name].attrs["units"], name)
        return unit.with_unit(float(value), 3)

    degrees, reading = data["temperature"].to_numpy(), reading_of(data)
    hottest = int(degrees.argmax())
    sentences = [
        f"The wire is at most {at('temperature', degrees[hottest])}, {at('time', data['time'].to_numpy()[hottest])} in."
    ]
    fraction = data["martensite_fraction"]
    least, greatest, last = float(fraction.min()), float(fraction.max()), float(fraction[-1])
    if not _transforms(data):
        sentences.append(f"It does not transform: the martensite fraction stays at {digits(last, 3)}.")
    else:
        sentences.append(
            f"It transforms: the martensite fraction lies between {least:.2f} and {greatest:.2f}, at the end {last:.2f}."
        )
    name = result.system.load.reading[0]
    unit = display(data["reading"].attrs["units"], name)
    stroke = float(np.ptp(reading))

    def read(value: float) -> str:
        shown = 0.0 if abs(value) < ROUNDING * stroke else unit.of(float(value))
        return f"{digits(shown, 3)} {unit.unit}".strip()

    sentences.append(
        f"The {label(name)} starts at {read(reading[0])}, lies between {read(reading.min())} and "
        f"{read(reading.max())}, and ends at {read(reading[-1])}."
    )
    sentences += measured_sentences(result)
    sentences += _at_ends(result)
    return sentences


def conclusions(result: RunResult) -> list[str]:
    """The run in sentences, and whether a closed loop settles."""
    sentences = run_sentences(result)
    if not sentences:
        return []
    if result.merit:
        settles = result.merit["settling_time"]
        sentences.append(
            f"The loop settles after {digits(settles, 3)} s."
            if np.isfinite(settles)
            else f"The loop does not settle within {digits(float(result.data['time'][-1]), 3)} s."
        )
    if result.by_set_point:
        each, count = _each_set_point(result)
        sentences.append(f"The loop settles at {count} of {len(each)} set points: {', '.join(each)}.")
    return sentences


def _each_set_point(result: RunResult) -> tuple[list[str], int]:
    """("40 deg after 2.1 s" or "40 deg not within 5 s" of each set point; at how many the loop settles)."""
    of = display(result.system.load.reading[1])
    after = [float(one.merit.settling_time) for one in result.by_set_point]
    each = [
        f"{of.with_unit(one.set_point)} "
        + (f"after {digits(late, 3)} s" if np.isfinite(late) else _late(one.end - one.begin))
        for one, late in zip(result.by_set_point, after, strict=True)
    ]
    return each, int(np.isfinite(after).sum())


SEVERAL = 6  # set points that a headline names one by one


def answer(result: RunResult) -> str:
    """The run in one sentence, and in another one that its integration does not resolve it, where that is so."""
    share = next((one.share for one in result.notes if isinstance(one, NotResolved)), None)
    beyond = f" Not resolved: its integration leaves {digits(100.0 * (share or 0.0), 3)} % of a whole transformation."
    return _answer(result) + beyond * (share is not None)


def _answer(result: RunResult) -> str:
    """Settling time, overshoot and steady error of a closed loop or its tracking error, the way and the temperature of an open run."""
    data = result.data
    if not np.isfinite(data["temperature"]).all():
        return "The run has values that are not finite."
    name = data.attrs.get("controller", "")
    if result.merit:
        of = display(result.system.load.reading[1])
        at = of.with_unit(float(data["wanted"][-1]))
        errors = _errors(result, [result.merit])
        settles = result.merit["settling_time"]
        seconds = digits(float(data["time"][-1]), 3)
        if np.isfinite(settles):
            return f"{name} settles at {at} after {digits(settles, 3)} s, with {errors}."
        return f"{name} does not settle at {at} within {seconds} s: {errors}."
    if result.by_set_point:
        each, count = _each_set_point(result)
        where = f": {', '.join(each)}" if len(each) <= SEVERAL and count else ""
        errors = _errors(result, [figures_of(one) for one in result.by_set_point])
        return f"{name} settles at {count or 'none'} of {len(each)} set points{where}; {errors}."
    if result.tracking_error:
        parts = [f"{' '.join(cells)} over the {part}" for part, cells in _tracking(result).items()]
        return f"{name} follows the reference with an RMS tracking error of {and_listed(parts)}."
    log = measured_sentences(result)
    if log:
        return log[0]
    hottest, transforms, way = run_sentences(result)[:3]
    # Who looks at the position alone takes what is elastic for a stroke.
    said = way if _transforms(data) else f"{way} {hottest} {transforms}"
    return f"{name}: {said}" if name else said


def _errors(result: RunResult, figures: Sequence[Mapping[str, float]]) -> str:
    """`an overshoot of 0.1 mm and a steady error of 0.02 mm`; of several the largest."""
    of = display(result.system.load.reading[1])
    least = ROUNDING * max(float(np.ptp(reading_of(result.data))), 1e-12)
    shown = []
    for name in ("overshoot", "steady_error"):
        value = max(one[name] for one in figures)
        shown.append(of.with_unit(0.0 if value < least else value, 2))
    most = "at most " if len(figures) > 1 else ""
    return f"an overshoot of {most}{shown[0]} and a steady error of {most}{shown[1]}"


def _at_ends(result: RunResult) -> list[str]:
    """Whether the load reaches a stop, and whether its wire goes slack."""
    load, time = result.system.load, result.data["time"].to_numpy()
    if not isinstance(load, AbstractMovingLoad):
        return []
    reading, stress = reading_of(result.data), result.data["stress"].to_numpy()
    room = AT_STOP * max(float(np.ptp(reading)), 1e-12)
    sentences = []
    for word, stop, sign in zip(("lower", "upper"), load.limits(), (-1.0, 1.0), strict=True):
        there = sign * (reading - float(stop)) > -room
        if np.isfinite(float(stop)) and there.any() and not there[0]:
            first = time[int(there.argmax())]
            sentences.append(
                f"It runs into its {word} stop, first {first:.3g} s in, and is there for {there.mean() * time[-1]:.3g} s."
            )
    slack = stress <= 0.0
    if slack[1:].any():
        first = time[1 + int(slack[1:].argmax())]
        sentences.append(f"The wire goes slack, first {first:.3g} s in, for {slack.mean() * time[-1]:.3g} s in all.")
    return sentences
