"""A sweep as one page that compares controllers, and as a table of every closed loop."""

from __future__ import annotations

import html
from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import NamedTuple

import numpy as np

from smajax.control.least_time import Distance
from smajax.control.position_unit import DEGREES, PositionUnit
from smajax.control.presets import CONTROLLERS, with_printed_law
from smajax.control.sweep.grid import Grid
from smajax.control.sweep.least_times import LeastTimes
from smajax.control.sweep.run_sweep import ControllerSweep, SweepResults
from smajax.core.provenance import made_with
from smajax.core.wording import and_listed, counted
from smajax.report.embedded import picture
from smajax.report.integration_words import integration_sentence
from smajax.report.next_steps import ARM, PlantWords, Step, section
from smajax.report.plain_page import bullets, folded, headline, table, whole
from smajax.report.series_plot import SeriesPlot, moving, samples_of
from smajax.report.sweep_batch_picture import ACROSS
from smajax.report.sweep_numbers import SHOWN, merit_values, nominal_gain, shown_in
from smajax.report.sweep_pictures import ROUNDING
from smajax.report.sweep_plants import batch_part, differing

Pictures = Mapping[str, tuple[bytes, bytes]]  # file name -> the picture, and the one for a telephone


class Remarks(NamedTuple):
    """Sentences beside the results. notes: what a reader has to know first; settings: where these come from.

    plant, and gains (controller: file): as the commands that the page suggests name them.
    """

    notes: tuple[str, ...] = ()
    settings: tuple[str, ...] = ()
    plant: PlantWords = ARM
    gains: Mapping[str, str] = MappingProxyType({})


NO_REMARKS = Remarks()
NO_PLOTS: Mapping[str, SeriesPlot] = MappingProxyType({})
NAMED = 3  # controllers of a headline


def perturbed_sentence(grid: Grid, sweep: ControllerSweep) -> str:
    """The results of a controller on all the perturbed plants of the grid, in a sentence."""
    at = nominal_gain(grid)
    found, unit = sweep.distance_at(at, sweep.least), grid.plants.unit
    overshoot = float(np.nanmax(merit_values(sweep.merits, "overshoot", unit)[..., at]))
    beyond = 0 if found is None else found.unreachable
    runs = (
        f"the runs whose set point its plant can reach ({counted(beyond, 'other')} not counted)"
        if beyond
        else "the runs"
    )
    return (
        f"On all {grid_in_words(grid)} it settles in {100 * settled_share(grid, sweep, sweep.least):.0f} % of {runs} at "
        f"{grid.gains[at]:g} times its main gain{_soon(grid, sweep)}{_times_the_least(found)}; overshoot up to {overshoot:.3g}{unit.symbol}."
        f"{_beyond_own_limit(grid, sweep)}"
    )


def _unsettled(grid: Grid, sweep: ControllerSweep) -> tuple[int, int]:
    """(runs in reach of the largest command of all in which it does not settle, those of them that its own does not reach)."""
    found, own = (sweep.distance_at(nominal_gain(grid), least) for least in (sweep.least, sweep.own_least))
    return (0, 0) if found is None or own is None else (found.never, found.never - own.never)


def _beyond_own_limit(grid: Grid, sweep: ControllerSweep) -> str:
    failed, beyond = _unsettled(grid, sweep)
    if not beyond:
        return ""
    one, several = (
        "The one run in which it does not settle is",
        f"Of the {failed} runs in which it does not settle {beyond} are",
    )
    limit = f"{sweep.own_least.limit:.4g} {grid.plants.unit.command}"
    return f" {one if failed == 1 else several} out of reach of its own largest command, {limit}."


def _soon(grid: Grid, sweep: ControllerSweep) -> str:
    """` (half of these within 1.2 s, nine tenths within 3.4 s)`; "" where it never settles."""
    times = merit_values(sweep.merits, "settling_time")[..., nominal_gain(grid)]
    settled = times[np.isfinite(times)]
    if not settled.size:
        return ""
    half, most = np.quantile(settled, [0.5, 0.9], method="inverted_cdf")  # times of runs, between which none is made up
    return f" (half of these within {half:.3g} s, nine tenths within {most:.3g} s)"


def settled_share(grid: Grid, sweep: ControllerSweep, least: LeastTimes) -> float:
    """Of the runs on perturbed plants at the nominal gain whose set point the plant can reach, with the command of these least times, those in which it settles; NaN of none."""
    at = nominal_gain(grid)
    found = sweep.distance_at(at, least)
    if found is None:
        return float(np.isfinite(merit_values(sweep.merits, "settling_time")[..., at]).mean())
    in_reach = found.settled + found.never
    return found.settled / in_reach if in_reach else float("nan")


def _times_the_least(found: Distance | None) -> str:
    """`, in 1.9 times the least time in the median and 2.6 at worst`; "" where that is not known."""
    if found is None or np.isnan(found.median):
        return ""
    return f", in {found.median:.3g} times the least time in the median and {found.worst:.3g} at worst"


def grid_in_words(grid: Grid) -> str:
    """What differs between its plants."""
    return (
        f"{counted(len(grid.ratios), 'plant')} of the batch"
        if grid.numbered
        else f"mismatches of {and_listed(grid.mismatches)}"
    )


def _cell(value: float) -> str:
    if np.isnan(value):
        return "no number"
    return "never" if np.isinf(value) else f"{value if abs(value) > ROUNDING else 0.0:.3g}"


def comparison_rows(results: SweepResults) -> list[list[str]]:
    """A row a controller: set points at which it settles, distance to the least time with the largest command of all and with its own, then median and worst of each figure of merit."""
    rows = []
    for sweep in results.sweeps:
        settles = int(np.isfinite(merit_values(sweep.nominal, "settling_time")).sum())
        found, own = (sweep.nominal_distance(least) for least in (sweep.least, sweep.own_least))
        beyond = f", {found.unreachable} out of reach" if found is not None and found.unreachable else ""
        cells = [sweep.name, f"{settles} of {len(results.settings.set_points)}{beyond}", _distance_cell(found)]
        cells += ["no limit" if own is None else f"{sweep.own_least.limit:.4g}", _distance_cell(own)]
        for merit_name in SHOWN:
            values = merit_values(sweep.nominal, merit_name, results.unit)
            cells.append(" / ".join(_cell(float(of(values))) for of in (np.median, np.max)))
        rows.append(cells)
    return rows


def _distance_cell(found: Distance | None) -> str:
    """Median / worst of the set points at which it settles."""
    if found is None:
        return "no least time"
    if not np.isfinite(found.median):
        return "never" if found.never else "no number"
    return f"{found.median:.3g} / {found.worst:.3g}"


LEAST_TIME = (
    "The least time is that in which the largest command of all controllers here that say theirs is first there, at the same set point on the same plant; none of them is "
    "there earlier. Set points that it does not reach are out of reach of the plant, which is no failure of a controller. Settling time over least time: median / "
    "worst of the set points at which the controller settles; 1 is the best that is possible. Once more with the largest command of the controller itself."
)


def _panels(pictures: Pictures, name: str, alt: str) -> str:
    wide, narrow = pictures[name]
    return str(picture(wide, alt, "panels", narrow))


def _controller_part(
    results: SweepResults, sweep: ControllerSweep, pictures: Pictures, plot: SeriesPlot | None, samples: int
) -> str:
    """The section of one controller: failures, what it reads, maps and lines."""
    say, settings = html.escape, results.settings
    still = f"{sweep.name}_lines.png"
    lines = "" if plot is None else str(moving(plot, picture(pictures[still][0], plot.about, "panels"), samples))
    return (
        f"<h3>{say(sweep.name)}</h3><p>{counted(results.grid.size, 'closed loop')} of {settings.seconds:g} s; {failures(sweep)}. "
        f"{say(description(sweep.name, results.unit))} {say(integration_sentence(sweep.integration_error))} "
        f'<a href="{sweep.name}.csv">every loop as CSV</a></p>'
        + _panels(pictures, f"{sweep.name}_maps.png", f"maps of {sweep.name}")
        + (batch_part(results.grid, sweep) if results.grid.numbered else "")
        + lines
    )


def page(
    results: SweepResults,
    pictures: Pictures,
    command: str = "",
    remarks: Remarks = NO_REMARKS,
    plots: Mapping[str, SeriesPlot] = NO_PLOTS,
    steps: Sequence[Step] = (),
) -> str:
    """One page for a browser, with the pictures inside; the rows as CSV are beside it.

    plots: of each controller's lines over time. steps: what a reader may do next.
    """
    samples = samples_of(plots.values())
    say, settings, grid, unit = html.escape, results.settings, results.grid, results.unit
    low, high = min(settings.set_points), max(settings.set_points)
    precision = ".0f" if unit.is_angle else ".3g"
    arrived = (
        "The angle has arrived when it is within 1°."
        if unit.is_angle
        else "The position has arrived when it is within a hundredth of the stroke."
    )
    drawn_as = _drawn_as(grid)
    head = [
        "controller",
        "settles at",
        "settling over least time",
        f"own largest command ({unit.command})",
        "settling over least time with it",
        *(f"{label} ({symbol})" for label, symbol, _ in shown_in(unit).values()),
    ]
    parts = [
        f"<h1>Controllers compared</h1>{headline(answer(results))}{bullets(remarks.notes)}",
        _panels(pictures, "comparison.png", "figures of merit over the set point"),
        f"{bullets(conclusions(results))}<p>The unperturbed plant, "
        f"{len(settings.set_points)} set points from {low:{precision}}{unit.symbol} to {high:{precision}}{unit.symbol}; "
        f"median / worst over the set points. {arrived} {say(settings.between)}</p><p>{say(LEAST_TIME)}</p>{bullets([*limit_sentences(results), *remarks.settings])}",
        table(head, comparison_rows(results)),
        section(steps),
        _what_differs(results, drawn_as),
        *folded(
            [_controller_part(results, one, pictures, plots.get(one.name), samples) for one in results.sweeps],
            "controllers",
        ),
        "<h2>Provenance</h2>",
        table(["", ""], [["command", command], *map(list, made_with().items())]),
        "<p class=quiet>The same numbers: sweep.json, sweep.nc (every loop, with named axes and units), and a CSV file for each controller.</p>",
    ]
    return whole("Controllers compared", [str(part) for part in parts])


def _drawn_as(grid: Grid) -> str:
    """What the pictures of a controller show."""
    if grid.numbered:
        fewer = ", of those parameters on which they hang most" if len(grid.plants.columns) > ACROSS else ""
        return (
            "A point is a plant: median over the set points that it can reach, a ring the worst of them, over the value of each parameter"
            f"{fewer}; dashed what the controller assumes. Below it the plants that the controller bears worst"
        )
    if grid.second:
        return "Maps: median over the set points that the plant can reach, and the worst of them beside it"
    return "Lines: median over the set points that the plant can reach; bands: their range, where all have a value"


def _what_differs(results: SweepResults, drawn_as: str) -> str:
    """The head of the part on perturbed plants."""
    say, grid = html.escape, results.grid
    if grid.numbered:
        return (
            f"<h2>Batch of {counted(len(grid.ratios), 'plant')}</h2><p>They differ in {say(differing(grid.plants))}. {drawn_as}, at the gain ratio "
            "nearest to 1.</p>"
        )
    return (
        f"<h2>Mismatch of {say(and_listed(grid.mismatches))}</h2><p>The plant's value over the one that the "
        f"controller assumes, where it assumes one. {drawn_as}, at the gain ratio nearest to 1. "
        f"{say(air_sentence(grid, results.air))}</p>"
    )


def air_sentence(grid: Grid, air: float) -> str:
    """The ratios of the air's temperature in kelvins: degrees Celsius have no natural zero."""
    low, high = float(grid.ratios[0]), float(grid.ratios[-1])
    offsets = " to ".join(f"{air * (ratio - 1.0):+.3g}" for ratio in (low, high))
    return f"Ambient: {low:.3g} to {high:.3g} times the assumed {air:g} °C is an error of {offsets} K."


def conclusions(results: SweepResults) -> list[str]:
    """A sentence a controller: where it settles on the unperturbed plant, and on the perturbed ones."""
    sentences = []
    for one in results.sweeps:
        settles = int(np.isfinite(merit_values(one.nominal, "settling_time")).sum())
        points = counted(len(results.settings.set_points), "set point")
        found = one.nominal_distance(one.least)
        beyond = f", {found.unreachable} out of reach" if found is not None and found.unreachable else ""
        nominal = (
            f"{one.name} settles at {settles} of {points}{beyond} on the unperturbed plant{_times_the_least(found)}."
        )
        sentences.append(f"{nominal} {perturbed_sentence(results.grid, one)}")
    return sentences


def limit_sentences(results: SweepResults) -> tuple[str, ...]:
    """Of each controller that does not say its largest command: its times over the least ones are not those of the others."""
    sentences = []
    for one in results.sweeps:
        if one.says_limit:
            continue
        limit = one.own_least.limit
        times = (
            f"its least times are with the drive's limit of {limit:.4g} {results.unit.command}, and its settling times over these are not to be "
            "compared with those of the others"
            if np.isfinite(limit)
            else "nor has the drive a limit, so that it has no least times"
        )
        sentences.append(
            f"{one.name} does not say its largest command: {times}. Give the parameter that limits it `limits_command=True`, or the controller "
            "the method `largest_command`."
        )
    return tuple(sentences)


class Ranked(NamedTuple):
    """A controller on the perturbed plants at its nominal gain, in the order in which they are ranked."""

    unsettled: float  # share of the runs in reach in which it does not settle; infinite where none is in reach
    times_least: (
        float  # median settling time over the least time with the largest command of all; infinite where there is none
    )
    seconds: float  # median settling time, infinite where it never settles
    name: str
    overshoot: float  # the largest, in the unit shown
    own_reach: float  # share of the runs in reach of its own largest command in which it settles; NaN where that is the reach of all
    limit: float  # its own largest command


def ranked(results: SweepResults) -> list[Ranked]:
    """The best controller first: by the share of the runs in reach in which it settles, then by its distance to the least time."""
    at, unit = nominal_gain(results.grid), results.unit
    rows = []
    for one in results.sweeps:
        times, found = merit_values(one.merits, "settling_time")[..., at], one.distance_at(at, one.least)
        settled, share = np.isfinite(times), settled_share(results.grid, one, one.least)
        own_limit = _unsettled(results.grid, one)[1] > 0
        rows.append(
            Ranked(
                np.inf if np.isnan(share) else 1.0 - share,
                np.inf if found is None or np.isnan(found.median) else found.median,
                float(np.quantile(times[settled], 0.5, method="inverted_cdf")) if settled.any() else np.inf,
                one.name,
                float(np.nanmax(merit_values(one.merits, "overshoot", unit)[..., at])),
                settled_share(results.grid, one, one.own_least) if own_limit else np.nan,
                one.own_least.limit,
            )
        )
    return sorted(rows)


def answer(results: SweepResults) -> str:
    """The controllers by the share of the runs on perturbed plants in which they settle; then those nearer to the least time first."""

    def words(one: Ranked) -> str:
        if not np.isfinite(one.unsettled):
            return f"{one.name} has no set point within reach"
        more, unit = [], results.unit
        if not np.isnan(one.own_reach):
            more.append(f"{100 * one.own_reach:.0f} % of those that its own {one.limit:.3g} {unit.command} reach")
        if np.isfinite(one.seconds):
            least = f", {one.times_least:.3g} times the least time" if np.isfinite(one.times_least) else ""
            more.append(
                f"after {one.seconds:.3g} s in the median{least}, overshoot up to {one.overshoot:.2g}{unit.symbol}"
            )
        return f"{one.name} settles in {100 * (1.0 - one.unsettled):.0f} %" + (f" ({'; '.join(more)})" if more else "")

    each = [words(one) for one in ranked(results)]
    rest = f"; then {counted(len(each) - NAMED, 'other')}" if len(each) > NAMED else ""
    plants = (
        f"the {counted(len(results.grid.ratios), 'plant')} of the batch"
        if results.grid.numbered
        else "perturbed plants"
    )
    at = nominal_gain(results.grid)
    if any(
        found is not None and found.unreachable for found in (one.distance_at(at, one.least) for one in results.sweeps)
    ):
        plants += " with a set point within reach"
    return f"Of the runs on {plants} {', '.join(each[:NAMED])}{rest}."


def description(name: str, unit: PositionUnit = DEGREES) -> str:
    """What a controller reads, and of which plant: that of a section is an arm."""
    preset = CONTROLLERS[name]
    own = preset.section is with_printed_law and unit.is_angle
    plant = " Plant: the integrated law without a thermal term (eq. 4.51)." if own else ""
    reads = preset.reads if unit.is_angle else preset.reads.replace("angle", "position")
    return f"It reads {reads}.{plant}"


def failures(sweep: ControllerSweep) -> str:
    """The number of loops in which the controller failed, in words."""
    bad = int(np.isfinite(sweep.failed_at).sum())
    return (
        "none failed"
        if bad == 0
        else f"{bad} failed: the controller's output was no finite voltage, or a gain is out of its bounds"
    )
