"""The findings as one self-contained page: no file beside it and nothing fetched, so it can be sent by mail."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from markupsafe import Markup

from smajax.attribution.findings import (
    Findings,
    ParameterFinding,
    Remaining,
    Role,
    coverage,
    moving_coverage,
    pooled_rmse,
)
from smajax.attribution.verdict import unknowns_at_bounds
from smajax.core.display_units import chance, correlation, digits, display, label, p_value, with_error
from smajax.core.names_of_runs import is_of_run, of_run, parameter_of
from smajax.core.wording import and_listed, per_cent, verdict_text
from smajax.fit.uncertainty import RemarkKind
from smajax.report import pictures, run_plots
from smajax.report.embedded import drawn_pictures, picture
from smajax.report.formulas import typeset
from smajax.report.frame import environment, parts_of_frame
from smajax.report.identifiability_words import remark_text
from smajax.report.narrative import Narrative, narrate
from smajax.report.narrative.caveats import zero_so_far
from smajax.report.narrative.rounds import chosen_text
from smajax.report.narrative.unknown import units
from smajax.report.narrative.values import far_text
from smajax.report.narrative.verdict import doubt, headline
from smajax.report.next_steps import Step, section
from smajax.report.plain_page import MANY, breakable
from smajax.report.predict_words import MOVES
from smajax.report.series_picture import COARSE, series, series_of_runs
from smajax.report.unknown_pictures import function_learnt

# Headings of the evidence in the order of the stages; a number with no heading here is shown under its own name.
EVIDENCE = {
    "posterior_probability": "posterior probability",
    "alone_rmse_fit": "fit runs, with it alone",
    "score_p_value_at_the_end": "p-value at the end",
}
# No column: the summary says the gain of a trace that is to be minded.
RECORD_ONLY = {"score_gain_at_the_end"}
FIRST_POINTS = 800  # samples in the plot of the first screen, whose run is below with more
FOLDED = 60  # dots an inch of a picture that is folded away
LEAST_SHOWN = 0.001  # of a probability: what is less depends on the few sets that were fitted


@dataclass(frozen=True)
class Shown:
    """One number of a table: as text, in the unit shown, and as the record has it."""

    text: str
    value: float | None


def shown(value: float | None, unit: str, quantity: str = "", count: int = 4, zeros: bool = False) -> Shown:
    """`value` (SI) for a table cell, in the unit that a reader sees; the digits as `display.digits` has them."""
    return Shown(digits(None if value is None else display(unit, quantity).of(value), count, zeros), value)


def estimate(value: float, error: float | None, unit: str, quantity: str = "") -> Shown:
    """`value ± standard error` for a table cell; the value alone where the runs do not determine it."""
    seen = display(unit, quantity)
    return Shown(with_error(seen.of(value), None if error is None else seen.of(error)), value)


def _parameter_rows(findings: Findings) -> list[dict[str, Any]]:
    """One row a parameter, before and after side by side, in the order of the record."""
    before = {result.name: result for result in findings.before}
    after = {result.name: result for result in findings.after}
    correlated = {name for cluster in findings.correlated for name in cluster}
    rows = []
    for name in dict.fromkeys([*before, *after]):
        any_ = after.get(name) or before[name]
        rows.append(
            {
                "name": name,
                "unit": display(any_.unit, name).unit,
                "start": shown(any_.start, any_.unit, name),
                "before": _fitted(before.get(name)),
                "after": _fitted(after.get(name)),
                "bounds": f"{shown(any_.lower, any_.unit, name).text} … {shown(any_.upper, any_.unit, name).text}",
                "remark": _remarks(findings, before.get(name), after.get(name)),
                "entangled": name in correlated or any_.remark.kind is RemarkKind.COMBINATION,
            }
        )
    return _with_held_out_runs(findings, rows)


def _with_held_out_runs(findings: Findings, rows: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """The rows, and below a parameter's values of fit runs those of the held-out runs."""
    known = {parameter_of(one.name): one for one in findings.after if is_of_run(one.name)}
    for parameter, any_ in known.items():
        unit = display(any_.unit, parameter).unit
        last = max(number for number, row in enumerate(rows) if parameter_of(row["name"]) == parameter)
        rows[last + 1 : last + 1] = [
            {
                "name": of_run(parameter, run.name),
                "unit": unit,
                "start": shown(any_.start, any_.unit, parameter),
                "before": shown(run.own_before.get(parameter), any_.unit, parameter),
                "after": shown(run.own_after[parameter], any_.unit, parameter),
                "bounds": f"{shown(any_.lower, any_.unit, parameter).text} … {shown(any_.upper, any_.unit, parameter).text}",
                "remark": "fitted to the held-out run alone, all else held",
                "entangled": False,
            }
            for run in findings.runs
            if parameter in run.own_after
        ]
    return rows


def _fitted(result: ParameterFinding | None) -> Shown:
    if result is None:
        return Shown("–", None)
    return estimate(result.value, result.standard_error, result.unit, result.name)


def _remarks(findings: Findings, before: ParameterFinding | None, after: ParameterFinding | None) -> str:
    def remark(one: ParameterFinding | None) -> str:
        return "; ".join(part for part in (remark_text(one.remark), far_text(findings, one)) if part) if one else ""

    first, second = remark(before), remark(after)
    if first == second or not first or not before or not after:
        return second or first
    return f"before: {first}" + (f"; after: {second}" if second else "")


def _evidence(findings: Findings) -> list[str]:
    """The columns of evidence: those known, in a fixed order, then whatever else the record holds."""
    held = dict.fromkeys(
        name
        for effect in findings.effects
        for name, value in effect.evidence.items()
        if name not in RECORD_ONLY and not math.isnan(value)
    )
    return [name for name in EVIDENCE if name in held] + [name for name in held if name not in EVIDENCE]


def _evidence_cell(findings: Findings, name: str, value: float) -> Shown:
    if "rmse" in name:
        return shown(value, findings.output_unit, findings.output_name, 3, zeros=True)
    if name == "posterior_probability" and value < LEAST_SHOWN:
        return Shown(f"< {LEAST_SHOWN}", value)
    return Shown(chance(value) if "p_value" in name else digits(value, 3, zeros=True), value)


def _evidence_unit(findings: Findings, name: str) -> str:
    return display(findings.output_unit, findings.output_name).unit if "rmse" in name else ""


def _phase_rows(findings: Findings) -> list[dict[str, Any]]:
    before, after = findings.residual_before.by_phase, findings.residual_after.by_phase
    return [
        {
            "phase": phase,
            "before": before.get(phase, {}),
            "after": after.get(phase, {}),
            "samples_before": _samples(before, phase),
            "samples_after": _samples(after, phase),
        }
        for phase in dict.fromkeys([*before, *after])
    ]


def _samples(by_phase: Mapping[str, Mapping[str, float]], phase: str) -> Shown:
    """Number of samples in a phase and their share, the one that the sentences and the picture give."""
    count = by_phase.get(phase, {}).get("samples", 0.0)
    whole = sum(entry["samples"] for entry in by_phase.values())
    return Shown(f"{count:.0f}" + (f" ({count / whole:.0%})" if whole else ""), count)


def _correlations(findings: Findings) -> list[dict[str, Any]]:
    before, after = findings.residual_before.correlation, findings.residual_after.correlation

    def cell(held: Mapping[str, float], name: str) -> Shown:
        return Shown(correlation(held.get(name)), held.get(name))

    return [
        {"with": label(name), "before": cell(before, name), "after": cell(after, name)}
        for name in dict.fromkeys([*before, *after])
    ]


def _figures(findings: Findings, output: Callable[[float | None], Shown]) -> list[dict[str, str]]:
    """The numbers of the first screen: the error before and after, times the noise, the verdict, and how the band does."""
    unit = display(findings.output_unit, findings.output_name).unit
    single = pictures.nothing_added(findings)
    figures = []
    roles: tuple[Role, ...] = ("fit", "held-out")
    for role in roles:
        before, after = (pooled_rmse(findings.runs, role, which) for which in ("before", "after"))
        if math.isfinite(after):
            text = output(after).text if single else f"{output(before).text} → {output(after).text}"
            figures.append({"caption": f"error on the {role} runs", "text": f"{text} {unit}".strip()})
    if findings.noise_sigma > 0.0:
        ratio = pooled_rmse(findings.runs, "fit", "after") / findings.noise_sigma
        figures.append({"caption": "times the noise", "text": digits(ratio, 3)})
    figures.append(
        {
            "caption": "verdict",
            "text": verdict_text(
                findings.verdict, findings.coefficients_at_bounds, unknowns_at_bounds(findings), doubt(findings)
            ),
            "kind": "verdict",
        }
    )
    inside = coverage(findings)
    if inside is not None:
        figures.append({"caption": "held-out samples in the 90 % band", "text": per_cent(inside)})
        moving = moving_coverage(findings)
        if moving is not None:
            figures.append({"caption": "of those at which the output moves", "text": per_cent(moving)})
    return figures


def _runs(findings: Findings) -> list[dict[str, Any]]:
    """Every run with its numbers, its plot and its picture over the temperature."""
    finished = not findings.remaining
    plots = series_of_runs([[run_plots.over_time(findings, run)] for run in findings.runs], drawn=finished)
    many = len(plots) > MANY
    # Drawing takes seconds, in which the search would stand still: what unfinished pages show without it is enough for them.
    drawn = findings.remaining is not Remaining.SEARCH
    # Each goes to another process with what it draws: without the other runs.
    rest = dataclasses.replace(findings, runs=())
    asked = [(rest, run, _hysteresis_dpi(number, many)) for number, run in enumerate(findings.runs)]
    drawings = drawn_pictures([(pictures.run_hysteresis, one) for one in asked]) if drawn else [None] * len(asked)
    return [
        {
            "run": run,
            "noise_ratio": run.rmse_after / findings.noise_sigma if findings.noise_sigma > 0.0 else float("nan"),
            "over_time": plot,
            "hysteresis": picture(drawing, f"Run {run.name} against the wire's temperature"),
        }
        for run, plot, drawing in zip(findings.runs, plots, drawings, strict=True)
    ]


def _own_values(findings: Findings) -> list[str]:
    """Parameters with a value of each run's own; how wrong the record of one run is, no other run has."""
    single = {one.coefficient for one in findings.record_errors}
    names = dict.fromkeys(parameter_of(one.name) for one in findings.after if is_of_run(one.name))
    return [name for name in names if name not in single]


def _other_outputs(findings: Findings) -> list[dict[str, Any]]:
    """One row for each output beside the first, and run."""
    rows = []
    for run in findings.runs:
        for one in run.others:
            inside = None if one.average is None or not one.samples else one.average.coverage
            rows.append(
                {
                    "output": label(one.name),
                    "run": run.name,
                    "role": run.role,
                    "before": shown(one.rmse_before, one.unit, one.name, 3, zeros=True),
                    "after": shown(one.rmse_after, one.unit, one.name, 3, zeros=True),
                    "unit": display(one.unit, one.name).unit,
                    "noise_ratio": Shown(
                        digits(one.rmse_after / one.noise_sigma, 3, zeros=True), one.rmse_after / one.noise_sigma
                    ),
                    "inside": Shown("–" if inside is None else per_cent(inside), inside),
                    "moving": _share(None if one.average is None else one.average.moving_coverage),
                    "samples": one.samples,
                }
            )
    return rows


def _share(value: float | None) -> Shown:
    known = value is not None and math.isfinite(value)
    return Shown(per_cent(value) if known and value is not None else "–", value if known else None)


def _hysteresis_dpi(number: int, many: bool) -> int:
    """Dots an inch; those that are folded away have the fewest."""
    return pictures.HYSTERESIS if not many else COARSE if number < MANY else FOLDED


def _contents(findings: Findings, steps: Sequence[Step]) -> list[tuple[str, str]]:
    """(id, words) of the sections."""
    entries = [
        ("answer", "Answer"),
        ("next", "What next" if steps else ""),
        ("runs", "Errors"),
        ("pictures", "Runs"),
        ("added", "What was added"),
        ("confounders", "Mistaken for it" if findings.confounders else ""),
        ("candidates", "Candidates"),
        ("unknown", "Not in the library" if findings.unknown else ""),
        ("parameters", "Parameters"),
        ("residual", "What is left over"),
        ("search", "Search"),
        ("unexplained", "Unexplained"),
        ("cannot-know", "What the runs do not determine"),
        ("check", "Check"),
        ("provenance", "Provenance"),
    ]
    return [(place, words) for place, words in entries if words]


def _unknown(findings: Findings) -> list[dict[str, Any]]:
    """The terms, with a picture of the one that is named and of those that are not distinguished from it."""
    drawn = {name for term in findings.unknown if term.named for name in (term.name, *term.indistinguishable)}
    return [
        {
            "term": term,
            "picture": picture(function_learnt(term) if term.name in drawn else None, term.title, "narrow"),
        }
        for term in findings.unknown
    ]


def findings_to_html(findings: Findings, narrative: Narrative | None = None, steps: Sequence[Step] = ()) -> str:
    """The whole page, as text. Names and sentences of the record are escaped; numbers are those of the record. steps: what a reader may do next."""
    words = narrative or narrate(findings)
    title, tone = headline(findings)

    def output(value: float | None) -> Shown:
        return shown(value, findings.output_unit, findings.output_name, 3, zeros=True)

    unnamed, finished = zero_so_far(findings), not findings.remaining
    first, correlation_of = run_plots.first_plot(findings), run_plots.residual_correlation(findings)
    runs = _runs(findings)
    errors, probabilities, phases, upright = drawn_pictures(
        [
            (pictures.errors_by_run, (findings,)),
            (pictures.effect_probabilities, (findings,)),
            (pictures.residual_by_phase, (findings,)),
            (pictures.residual_by_phase, (findings, True)),
        ]
    )
    return (
        environment()
        .get_template("findings.html")
        .render(
            **parts_of_frame(True),
            contents=_contents(findings, steps),
            following=Markup(section(steps)),
            typeset=typeset,
            many=MANY,
            f=findings,
            words=words,
            rounds=[(entry, chosen_text(entry), why) for entry, why in zip(findings.rounds, words.rounds, strict=True)],
            verdict_title=title,
            tone=tone,
            unit=display(findings.output_unit, findings.output_name).unit,
            output=output,
            number=lambda value, count=3: Shown(digits(value, count, zeros=True), value),
            estimate=estimate,
            p_value=p_value,
            unit_of=lambda unit, name="": display(unit, name).unit,
            label=label,
            breakable=lambda text: Markup(breakable(text)),
            single=pictures.nothing_added(findings),
            # Without offsets in the fit they are exactly zero.
            offsets=any(run.offset_before or run.offset_after for run in findings.runs),
            own_values=and_listed(own) if (own := [label(one) for one in _own_values(findings)]) else "",
            averaged=findings.averaged and all(run.average is not None for run in findings.runs),
            held_out=any(run.role == "held-out" for run in findings.runs),
            added=findings.added,
            named=[one for one in findings.added if one not in unnamed],
            unnamed=unnamed,
            ranked=pictures.ranked(findings.effects),
            evidence=_evidence(findings),
            share=_share,
            moves=MOVES,
            known=lambda value: value is not None and math.isfinite(value),
            evidence_title=lambda name: EVIDENCE.get(name, label(name)),
            evidence_unit=lambda name: _evidence_unit(findings, name),
            evidence_cell=lambda name, value: _evidence_cell(findings, name, value),
            parameters=_parameter_rows(findings),
            runs=runs,
            other_outputs=_other_outputs(findings),
            phases=_phase_rows(findings),
            correlations=_correlations(findings),
            unknown=_unknown(findings),
            units=units,
            figures=_figures(findings, output),
            picture_first="" if first is None else series(first, FIRST_POINTS, drawn=finished),
            picture_errors=picture(errors, "Error of each run before and after", "narrow"),
            picture_candidates=picture(probabilities, "Candidates by posterior probability", "narrow"),
            picture_phases=picture(phases, "Residual by phase of the wire", upright=upright),
            picture_correlation="" if correlation_of is None else series(correlation_of, drawn=finished),
        )
    )
