"""A tuning as one self-contained page, and as a record for machines."""

from __future__ import annotations

import html
import itertools
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from smajax.control.tune.moves import Moves
from smajax.control.tune.scenarios import BEYOND
from smajax.control.tune.terms import TERMS, Term, terms_in
from smajax.control.tune.tuning import Check, TuningResult
from smajax.core.display_units import digits
from smajax.core.files import csv_text, heading
from smajax.core.provenance import made_with
from smajax.core.wording import and_listed, counted
from smajax.report.embedded import picture
from smajax.report.integration_words import integration_sentence
from smajax.report.loop_words import loop_rows
from smajax.report.next_steps import Step, section
from smajax.report.plain_page import bullets, headline, table, whole
from smajax.report.series_picture import series
from smajax.report.tune_answer import answer, set_point_rows
from smajax.report.tune_pictures import merits_picture, positions_plot
from smajax.report.tune_words import goal_sentence, held_out_sentence, plants_sentence

SCALED = "The preset's gains and the box are those of the arm, scaled to this load's stroke, force and time and to the drive's limit."
EDGE = 0.02  # of the box, by logarithm
GROWN = 1.5  # times as much as before
LEAST_PRICE = 0.1  # J, V/s, 1/s: what is less is nothing, however it grew
UNITS = {"°": "deg", "°C": "degC"}  # as a file has them


def terms_of(result: TuningResult) -> dict[str, Term]:
    """The terms as the load's unit shows them."""
    return terms_in(result.settings.shown)


def checked_on(result: TuningResult, name: str) -> str:
    """The plants and set points of a check, in words; a share of the air's temperature in kelvins."""
    if name == "tuned on":
        return name
    if name == "inside":
        return f"never seen: {held_out_sentence(result.settings)}"
    air = "" if "ambient" in result.settings.variation else f" (the air by {BEYOND * abs(result.air):.3g} K)"
    return f"never seen: another parameter wrong by {100 * BEYOND:g} %{air}, set points tuned"


def gains_of(result: TuningResult) -> dict[str, dict[str, Any]]:
    """Of each gain its value before and after, unit, and box, as the record has them."""
    return {
        name: {
            "before": result.before[name],
            "after": result.after.values[name],
            "unit": result.units[name],
            "box": list(box),
        }
        for name, box in result.box.items()
    }


def at_the_edge(gains: Mapping[str, Mapping[str, Any]]) -> list[str]:
    """Those of `gains_of` that ended at a bound of their box."""
    edge = []
    for name, one in gains.items():
        value, (low, high) = one["after"], one["box"]
        if min(value / low, high / value) < (high / low) ** EDGE:
            edge.append(name)
    return edge


def broken(result: TuningResult, check: Check) -> list[str]:
    """Which limits the tuned gains do not meet: by how much, where, in how many loops."""
    sentences = []
    for name, limit in result.settings.limits.items():
        term, values = terms_of(result)[name], check.seen.exact[1, :, list(TERMS).index(name)]
        over = values > limit
        if over.any():
            at = int(np.argmax(values))
            never = name == "settling_time" and values[at] >= 2.0 * result.settings.seconds
            worst = "never reached" if never else f"{digits(float(values[at]), 3)} {term.unit}"
            sentences.append(
                f"{term.label} {worst} at {result.settings.shown.of(check.scenarios.targets[at]):.3g}{result.settings.shown.symbol} where {limit:g} {term.unit} are "
                f"asked ({int(over.sum())} of {len(values)} loops)"
            )
    return sentences


def met(result: TuningResult, check: Check, where: str) -> str:
    """That every limit is met, and where that says little: a loop that stays short of its set point overshoots nothing."""
    sentence = f"Every limit is met in all {check.scenarios.size} closed loops {where}"
    settled = np.isfinite(np.asarray(check.seen.merits.settling_time)).sum(axis=1)
    if "settling_time" in result.settings.limits or (settled[1] >= settled[0] and settled[1] > 0):
        return f"{sentence}."
    after = (
        "none of them settles"
        if settled[1] == 0
        else f"only {settled[1]} of them {'settles' if settled[1] == 1 else 'settle'}"
    )
    return (
        f"{sentence}, but {after} ({settled[0]} with the preset's gains): what never comes to rest at its set point can keep such "
        "a limit; limit settling_time as well."
    )


def price(result: TuningResult) -> list[str]:
    """What the tuned gains cost: energy, chatter or switching whose median or worst, as the table has them, grew by over half."""
    seen = result.checks["tuned on"].seen
    figures = [
        (TERMS[name].label, TERMS[name].unit, seen.exact[..., list(TERMS).index(name)])
        for name in ("energy", "chatter")
    ]
    figures.append(("switches of the command", "a second", np.asarray(seen.merits.switches_per_second)))
    grown = []
    for label, unit, values in figures:
        for whose, of in (("median", np.median), ("worst", np.max)):
            before, after = (float(of(one)) for one in values)
            if after > GROWN * before and after > LEAST_PRICE:
                grown.append(f"{label} from {digits(before, 3)} to {digits(after, 3)} {unit} in the {whose} loop")
                break
    return [f"The tuned gains have their price, where they were tuned: {'; '.join(grown)}."] if grown else []


def in_moves(result: TuningResult) -> list[str]:
    """How every loop begins, and what the gains do from one set point to another, which nothing was tuned on."""
    cold = "Each of these loops is one step from the start, cold and at rest"
    if result.moves is None:
        return [f"{cold}: moves from one set point to another were not tried."]
    moves = result.moves
    unit = result.settings.shown
    ends = [f"{low:g}{unit.symbol} to {high:g}{unit.symbol}" for low, high in itertools.pairwise(moves.asked)]
    overshoot, at = float(moves.overshoot[1].max()), ends[int(np.argmax(moves.overshoot[1]))]
    never = int((~np.isfinite(moves.settling_time[1])).sum())
    slowest = float(np.max(moves.settling_time[1], where=np.isfinite(moves.settling_time[1]), initial=0.0))
    settled = (
        f"{never} of {len(ends)} never {'settles' if never == 1 else 'settle'}"
        if never
        else f"all settle, in {digits(slowest, 3)} s at most"
    )
    limits = result.settings.limits
    missed = [
        word
        for word, over in (
            ("overshoot", overshoot > limits.get("overshoot", np.inf)),
            ("settling time", (slowest if not never else np.inf) > limits.get("settling_time", np.inf)),
            ("steady error", float(moves.steady_error[1].max()) > limits.get("steady_error", np.inf)),
        )
        if over
    ]
    broken_there = f": beyond the limit of {and_listed(missed)}" if missed else ""
    return [
        f"{cold}. In {counted(len(ends), 'move')} from one set point to another on the plant as believed, which nothing was "
        f"tuned on, {settled}, and the largest overshoot is {digits(overshoot, 3)}{unit.symbol} ({at}; "
        f"{digits(float(moves.overshoot[0].max()), 3)}{unit.symbol} "
        f"with the preset's gains){broken_there}."
    ]


def conclusions(result: TuningResult) -> list[str]:
    """What came out, in sentences that say no more than the numbers."""
    before, after = result.costs
    tuned, inside = result.checks["tuned on"], result.checks["inside"]
    sentences = [f"The cost is {digits(after, 3)} with the tuned gains and {digits(before, 3)} with the preset's."]
    if dict(result.before) == dict(result.after.values) or (
        after >= before and result.excesses["tuned on"][1] >= result.excesses["tuned on"][0]
    ):
        sentences = ["Nothing better than the preset's gains was found."]
    if result.settings.limits:
        missed = broken(result, tuned)
        sentences.append(f"Not every limit is met: {'; '.join(missed)}." if missed else met(result, tuned, "tuned on"))
        missed = broken(result, inside)
        sentences.append(
            f"Of what was never seen ({held_out_sentence(result.settings)}): {'; '.join(missed)}."
            if missed
            else met(result, inside, f"that were never seen ({held_out_sentence(result.settings)})")
        )
        if "beyond" in result.checks and (missed := broken(result, result.checks["beyond"])):
            sentences.append(f"With a parameter wrong that was not varied: {'; '.join(missed)}.")
    for name, check in result.checks.items():
        settled = np.isfinite(np.asarray(check.seen.merits.settling_time)).mean(axis=1)
        if settled.min() < 1.0:
            sentences.append(
                f"Loops that settle, {checked_on(result, name)}: {100 * settled[0]:.0f} % before, {100 * settled[1]:.0f} % after."
            )
    sentences += in_moves(result)
    sentences += price(result)
    if edge := at_the_edge(gains_of(result)):
        sentences.append(f"At a bound of the box, beyond which better gains may lie: {', '.join(edge)}.")
    descent, evolution = result.descent, result.evolution
    if evolution.generations:
        # It begins with where slopes have ended.
        sentences.append(
            f"Slopes ended at a cost of {_ended(evolution.costs[0, 0], evolution.excesses[0, 0])}, the search without them at "
            f"{_ended(result.costs[1], result.excesses['tuned on'][1])}."
        )
    sentences.append(
        f"It took {counted(result.simulations, 'closed loop')} in {counted(descent.round, 'round')} by slopes"
        + (f" and {counted(evolution.generations, 'generation')} without" if evolution.generations else "")
        + (
            f"; {descent.unusable:,} loops had slopes of no use (a limit cycle multiplies every difference)"
            if descent.unusable
            else ""
        )
        + (f"; {descent.non_finite:,} gave numbers that are none" if descent.non_finite else "")
        + "."
    )
    return sentences


def _ended(cost: float, excess: float) -> str:
    return digits(cost, 3) + (f" (a limit exceeded by {100.0 * excess:.2g} %)" if excess > 0.0 else "")


def gain_rows(gains: Mapping[str, Mapping[str, Any]]) -> list[list[str]]:
    """Of `gains_of`: gain, before, after, unit, box, remark."""
    edge = at_the_edge(gains)
    return [
        [
            name,
            digits(one["before"]),
            digits(one["after"]),
            one["unit"],
            " … ".join(digits(bound) for bound in one["box"]),
            "at the bound" if name in edge else "",
        ]
        for name, one in gains.items()
    ]


def _figures(result: TuningResult, check: Check) -> list[list[str]]:
    """A row a term: median and worst before and after, and the limits where there are some."""
    rows = []
    for column, (name, term) in enumerate(terms_of(result).items()):
        cells = []
        for which in (0, 1):
            values = check.seen.exact[which, :, column]
            never = 2.0 * result.settings.seconds if name == "settling_time" else np.inf
            for value in (float(np.median(values)), float(np.max(values))):
                cells.append("never" if value >= never else digits(0.0 if abs(value) < 1e-6 else value, 3))
        if result.settings.limits:
            limit = result.settings.limits.get(name)
            cells.append("" if limit is None else f"{limit:g}")
        rows.append([f"{term.label} ({term.unit})", *cells])
    return rows


def settings_rows(result: TuningResult) -> list[list[str]]:
    """What shapes the gains and was not tuned: the loop that they were tuned in, and the controller's other parameters."""
    fixed = [[name, f"{digits(one, 4)} {result.units[name]}"] for name, one in result.after.fixed.items()]
    return [*loop_rows(result.after.loop, result.largest), *fixed]


def page(result: TuningResult, pictures: Mapping[str, bytes], command: str, steps: Sequence[Step] = ()) -> str:
    """The whole page, pictures inside. steps: what a reader may do next."""
    say, settings = html.escape, result.settings
    head = ["figure", "median before", "worst before", "median after", "worst after"]
    head += ["limit"] if settings.limits else []
    points, rows = set_point_rows(result)
    parts = [
        f"<h1>Gains of {say(settings.controller)}, tuned</h1>",
        headline(answer(result)),
        series(positions_plot(result)),
        picture(
            merits_picture(result), "figures of merit before and after", "panels", merits_picture(result, upright=True)
        ),
        "<p class=quiet>From the least to the largest over the plants at each set point; squares were tuned on, circles never "
        "seen.</p>",
        table(points, rows, range(len(points))),
        bullets(conclusions(result)),
        f"<p>Tuned on {say(plants_sentence(settings, result.air))}. {say(goal_sentence(settings))}.</p>",
        section(steps),
        "<h2>Gains</h2>",
        "" if settings.shown.is_angle else f"<p class=quiet>{SCALED}</p>",
        table(["gain", "before", "after", "unit", "box", "remark"], gain_rows(gains_of(result)), (1, 2)),
        "<h2>What the gains were tuned with</h2>",
        table(["", ""], settings_rows(result)),
    ]
    for name, check in result.checks.items():
        what = checked_on(result, name)
        parts += [
            f"<h2>{say(what[0].upper() + what[1:])}</h2><p class=quiet>"
            f"{counted(check.scenarios.size, 'closed loop')} of {settings.seconds:g} s.</p>",
            table(head, _figures(result, check), range(1, len(head))),
        ]
    parts += [
        "<h2>The search</h2>",
        picture(pictures["descent.png"], "cost over closed loops"),
        f"<p class=quiet>{say(settings.between_in_words())} {say(integration_sentence(result.integration.record()))}</p>",
        "<h2>Provenance</h2>",
        table(["", ""], [["command", command], *map(list, made_with().items())]),
        "<p class=quiet>The same numbers: tune.json, and loops.csv with every closed loop before and after.</p>",
    ]
    return whole(f"Gains of {settings.controller}", [str(part) for part in parts])


def loops(result: TuningResult) -> str:
    """CSV, a row a closed loop: which check, whose gains, plant over what is believed, set point, figures (none: never)."""
    rows, unit, plants = [], result.settings.shown, result.plants
    for name, check in result.checks.items():
        for which, when in enumerate(("before", "after")):
            for plant, figures in zip(check.scenarios.rows.tolist(), check.seen.exact[which], strict=True):
                merits = [_plain(result, term, value) for term, value in zip(TERMS, figures, strict=True)]
                rows.append([name, when, *plant[:-1], float(unit.of(plant[-1])), *merits])
    terms = [heading(name, UNITS.get(term.unit, term.unit)) for name, term in terms_of(result).items()]
    columns = [name if plants.batch is not None else f"{name} ratio" for name in plants.columns]
    return csv_text(["check", "gains", *columns, heading("set point", unit.shown), *terms], rows)


def record(result: TuningResult, command: str) -> dict[str, Any]:
    """Everything but the lines; a settling time that is never is null."""
    descent = result.descent
    return {
        "controller": result.settings.controller,
        "headline": answer(result),
        "conclusions": conclusions(result),
        "price": price(result),
        "settings": result.settings.record(),
        "gains": gains_of(result),
        "fixed": {name: {"value": one, "unit": result.units[name]} for name, one in result.after.fixed.items()},
        "loop": result.after.loop.record(),
        "cost": {"before": result.costs[0], "after": result.costs[1]},
        "limits_met": result.within_limits if result.settings.limits else None,
        "checks": {
            name: {
                "what": checked_on(result, name),
                "loops": one.scenarios.size,
                "limit_exceeded_by_share": {"before": result.excesses[name][0], "after": result.excesses[name][1]},
                **{
                    when: {
                        term: {
                            "unit": terms_of(result)[term].unit,
                            "median": _plain(result, term, np.median(one.seen.exact[which, :, column])),
                            "worst": _plain(result, term, np.max(one.seen.exact[which, :, column])),
                        }
                        for column, term in enumerate(TERMS)
                    }
                    for which, when in ((0, "before"), (1, "after"))
                },
            }
            for name, one in result.checks.items()
        },
        "integration_error": result.integration.record(),
        "moves": _moves(result.moves, result.settings.unit),
        "search": {
            "closed_loops": result.simulations,
            "rounds": descent.round,
            "slopes_of_no_use": descent.unusable,
            "no_numbers": descent.non_finite,
            "best_cost_within_limits_by_round": _best_so_far(
                descent.costs[: descent.round], descent.excesses[: descent.round]
            ),
            "closed_loops_by_round": descent.ran[: descent.round].tolist(),
            "generations_without_slopes": result.evolution.generations,
            "closed_loops_by_generation": result.evolution.ran.tolist(),
            "best_cost_within_limits_by_generation": _best_so_far(result.evolution.costs, result.evolution.excesses),
        },
        "command": command,
        "made_with": made_with(),
    }


def _moves(moves: Moves | None, unit: str) -> dict[str, Any] | None:
    if moves is None:
        return None
    settled = np.where(np.isfinite(moves.settling_time), moves.settling_time, np.nan)
    return {
        f"set_points_{unit}": moves.asked.tolist(),
        **{
            when: {
                f"overshoot_{unit}": moves.overshoot[k].tolist(),
                "settling_time_s": settled[k].tolist(),
                f"steady_error_{unit}": moves.steady_error[k].tolist(),
            }
            for k, when in enumerate(("before", "after"))
        },
    }


def _best_so_far(costs: np.ndarray, excesses: np.ndarray) -> list[float]:
    """Of candidates (steps, several) within the limits, after each step; infinite before there is one."""
    return np.minimum.accumulate(np.nanmin(np.where(excesses <= 0.0, costs, np.inf), axis=1)).tolist()


def _plain(result: TuningResult, term: str, value: float) -> float | None:
    never = term == "settling_time" and value >= 2.0 * result.settings.seconds
    return None if never else float(value)
