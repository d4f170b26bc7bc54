"""An identification as one self-contained page, and as a record for machines."""

from __future__ import annotations

import html
import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from smajax.experiment.record import Prior
from smajax.identified import Estimate, Identified, IdentifiedOutput
from smajax.report import identify_pictures as draw
from smajax.report.display import digits, display, label, p_value, with_error
from smajax.report.files import json_text, replace
from smajax.report.html import picture
from smajax.residual.noise_like import WHITE
from smajax.words import and_listed

OFF = 1.25  # ratio of residual to noise that is worth a sentence
KNOWN = "Every combination of the parameters is known to 5 % or better."
KNOWN_OF_THE_REST = (
    "Of the parameters that are neither at a bound nor without effect, every combination is known to 5 %."
)
STYLE = (
    "body{font:15px/1.5 system-ui,sans-serif;max-width:1080px;margin:2em auto;padding:0 1em;color:#1d1d1f;background:#fff}"
    "td,th{text-align:left;vertical-align:top;padding:.35em .7em;border-bottom:1px solid #e3e5e9}"
    "table{border-collapse:collapse;font-size:14px;display:block;overflow-x:auto;margin:0 0 1em}"
    "td.n,th.n{text-align:right;font-variant-numeric:tabular-nums;white-space:nowrap}"
    "img{max-width:100%;display:block;margin:0 0 1em}.quiet{color:#626973}h2{margin-top:1.6em}"
    "p,ul{max-width:62em}"
)


def conclusions(found: Identified) -> list[str]:
    """What was found, in sentences that say no more than the numbers."""
    told = [found.stopped, *(_error(found, k) for k in range(len(found.outputs)))]
    given = [one.noise_before is None for one in found.outputs]
    if found.whiteness_p < WHITE:
        told.append(
            f"The residual is {_times(found)} the noise and has a memory ({p_value(found.whiteness_p)}; one "
            f"sample in {found.independent:.0f} is independent): the model lacks something, and the standard errors allow "
            "for the memory but not for what that does to the values. `smajax close-loop` looks for what it is."
        )
    else:
        told.append(
            f"The residual is {_times(found)} the noise, and no memory was found in it "
            f"({p_value(found.whiteness_p)}): nothing in these runs speaks against the model."
        )
        wrong = [
            one for one, told_ in zip(found.outputs, given, strict=True) if told_ and not 1.0 / OFF < one.ratio < OFF
        ]
        if wrong and len(found.outputs) == 1:
            told.append("The noise is not what was declared: errors were taken from the residual.")
        elif wrong:
            told.append(
                f"The noise of {and_listed([one.name for one in wrong])} is not what was declared, so the outputs do not "
                "have the weights they deserve: write noise = 'estimate' for it."
            )
    larger = [one for one in found.outputs if one.noise_before and one.noise_sigma > OFF * one.noise_before]
    if larger:
        told.append(
            f"What the fit leaves of {and_listed([one.name for one in larger])} is more than the noise that the signal "
            "itself shows: part of it is what the model lacks, and was given the weight of noise."
        )
    if found.normality_p < WHITE and not found.robust:
        told.append(
            f"It is not normally distributed ({p_value(found.normality_p)}): if single samples are far off, fit by Huber's "
            "loss (`--robust`)."
        )
    edge = [one.name for one in found.estimates if "bound" in one.remark and one.standard_error is None]
    silent = [one.name for one in found.estimates if one.standard_error is None and one.name not in edge]
    if edge:
        told.append(
            f"Held by a bound, which the truth may lie beyond: {', '.join(edge)}; the others are told with it held."
        )
    if silent:
        told.append(f"The runs do not tell {', '.join(silent)}: see the remarks.")
    if better := [one.name for one in found.profiles if one.better]:
        told.append(f"The profile of {', '.join(better)} found a better fit than this one: ask for more `--starts`.")
    if found.robust:
        told.append("Huber's loss: samples far off count less, and errors are those of that estimate.")
    return told


def _times(found: Identified) -> str:
    """`1.1 times`, or by output where the fit did not make it one."""
    if len(found.outputs) == 1:
        return f"{found.ratio:.2g} times"
    return and_listed([f"{one.ratio:.2g} times ({one.name})" for one in found.outputs])


def rms_by_role(found: Identified, output: int) -> dict[str, float]:
    """Error of one output over all runs of a role, SI."""
    by_role = {}
    for role in dict.fromkeys(run.role for run in found.runs):
        errors = [run.series[output].rmse for run in found.runs if run.role == role]
        known = [error for error in errors if np.isfinite(error)]
        if known:
            by_role[role] = float(np.sqrt(np.mean(np.square(known))))
    return by_role


def _error(found: Identified, output: int) -> str:
    """Error of one output and its noise, in its own unit."""
    one = found.outputs[output]
    unit = display(one.unit, one.name)
    errors = "; ".join(
        f"{role} runs {digits(unit.of(error), 3)} {unit.unit}".strip()
        for role, error in rms_by_role(found, output).items()
    )
    whose = f"Error of the {label(one.name)} (rms)" if len(found.outputs) > 1 else "Error (rms)"
    noise = f"noise {digits(unit.of(one.noise_sigma), 3)} {unit.unit}, {one.noise_how}"
    if one.noise_before is not None:
        noise += f" (its differences show {digits(unit.of(one.noise_before), 3)} {unit.unit})".replace(" )", ")")
    return f"{whose}: {errors}; {noise}.".replace(" ,", ",")


def _table(head: Sequence[str], rows: Sequence[Sequence[str]], numbers: Sequence[int] = ()) -> str:
    def cells(kind: str, row: Sequence[str]) -> str:
        return "".join(
            f"<{kind}{' class=n' if k in numbers else ''}>{html.escape(cell)}</{kind}>" for k, cell in enumerate(row)
        )

    body = "".join(f"<tr>{cells('td', row)}</tr>" for row in rows)
    return f"<table><tr>{cells('th', head)}</tr>{body}</table>"


def _bullets(sentences: Sequence[str]) -> str:
    return f"<ul>{''.join(f'<li>{html.escape(one)}</li>' for one in sentences)}</ul>" if sentences else ""


def estimate_rows(found: Identified) -> list[list[str]]:
    """Parameter, estimate with standard error, unit, bounds, start, 95 % interval of the profile, remark."""
    profiled = {one.name: one for one in found.profiles}

    def interval(one: Estimate) -> str:
        if one.name not in profiled:
            return ""
        unit, known = display(one.unit, one.name), profiled[one.name]
        last = (known.values[0], known.values[-1])
        ends = [
            digits(unit.of(end)) if end is not None else f"beyond {digits(unit.of(float(reached)))}"
            for end, reached in zip((known.low, known.high), last, strict=True)
        ]
        return " … ".join(ends)

    rows = []
    for one in found.estimates:
        unit = display(one.unit, one.name)
        error = None if one.standard_error is None else unit.of(one.standard_error)
        bounds = f"{digits(unit.of(one.lower))} … {digits(unit.of(one.upper))}"
        rows.append(
            [
                one.name,
                with_error(unit.of(one.value), error),
                unit.unit,
                interval(one),
                bounds,
                digits(unit.of(one.start)),
                one.remark,
            ]
        )
    return rows


def _prior(estimate: Estimate) -> str:
    """What was known before the runs: `80 ± 10`, or `80 × or / 1.22`."""
    known: Prior | None = estimate.prior
    if known is None:
        return ""
    unit = display(estimate.unit, estimate.name)
    if known.logarithmic:
        return f"{digits(unit.of(known.mean))} × or / {digits(math.exp(known.sigma), 3)}"
    return f"{digits(unit.of(known.mean))} ± {digits(unit.of(known.sigma), 2)}"


def _run_rows(found: Identified) -> tuple[list[str], list[list[str]]]:
    """(head, rows): each run's error by output."""

    def head(one: IdentifiedOutput) -> str:
        unit = display(one.unit, one.name).unit or "-"
        return f"rms error ({unit})" if len(found.outputs) == 1 else f"{label(one.name)}, rms error ({unit})"

    rows = []
    for run in found.runs:
        errors = [
            digits(display(one.unit, one.name).of(series.rmse), 3)
            for one, series in zip(found.outputs, run.series, strict=True)
        ]
        rows.append([run.name, run.role, str(len(run.time)), *errors])
    return ["run", "role", "samples", *(head(one) for one in found.outputs)], rows


def page(found: Identified) -> str:
    """The whole page."""
    say = html.escape
    run_head, runs = _run_rows(found)
    head = ["parameter", "estimate ± standard error", "unit", "95 % (profile)", "bounds", "start", "remark"]
    rows = estimate_rows(found)
    if any(one.prior for one in found.estimates):
        head.insert(-1, "known before")
        rows = [[*row[:-1], _prior(one), row[-1]] for row, one in zip(rows, found.estimates, strict=True)]
    parts = [
        f"<h1>{say(found.title or found.experiment)}: parameters</h1>",
        _bullets(conclusions(found)),
        "<h2>Parameters</h2>",
        _table(head, rows, (1,)),
        "<h2>What the runs tell apart</h2>",
        _bullets(found.weak) or f"<p>{KNOWN if found.all_took_part else KNOWN_OF_THE_REST}</p>",
        picture(draw.correlations(found), "correlations of the estimates"),
    ]
    if found.profiles:
        parts += [
            "<h2>Profile likelihood</h2><p class=quiet>Each parameter held, all others fitted again: the rise of the cost "
            "(blue), what the standard error stands for (grey), the 95 % line (red).</p>",
            picture(draw.profile_curves(found), "profiles"),
        ]
    if found.suggestions:
        rows = [
            [
                str(number),
                one.what,
                digits(one.information, 3),
                ", ".join(f"{name} × {digits(share, 2)}" for name, share in one.shrinks.items()),
            ]
            for number, one in enumerate(found.suggestions, start=1)
        ]
        parts += [
            "<h2>What to measure next</h2><p class=quiet>Courses of the input within what was applied already, ranked by "
            "what one such run would tell (D-optimal, at the fit).</p>",
            _table(["", "run", "information, nats", "standard errors become"], rows, (2,)),
            picture(draw.suggested_inputs(found), "suggested inputs"),
        ]
    parts += ["<h2>Runs</h2>", _table(run_head, runs, range(2, len(run_head)))]
    if found.own_of_held_out:
        units = {one.name.split("[")[0]: display(one.unit, one.name) for one in found.estimates}
        own = [
            f"{name} {digits(units[name.split('[')[0]].of(value))} {units[name.split('[')[0]].unit}".strip()
            for name, value in found.own_of_held_out.items()
        ]
        parts.append(
            f"<p class=quiet>What is each run's own was found for the held-out runs from themselves, all else held: "
            f"{say('; '.join(own))}.</p>"
        )
    for run in found.runs:
        pictures = [
            picture(draw.run_with_band(found, run, k), f"{label(run.name)}, {label(one.name)}")
            for k, one in enumerate(found.outputs)
            if np.isfinite(run.series[k].rmse)
        ]
        parts.append(f"<h3>{say(run.name)} ({say(run.role)})</h3>{''.join(pictures)}")
    parts += [
        "<h2>Checks and provenance</h2>",
        _bullets(found.check),
        _table(["", ""], list(map(list, found.provenance.items()))),
    ]
    return (
        '<!doctype html><html lang="en"><meta charset="utf-8"><meta name="viewport" content="width=device-width, '
        f'initial-scale=1"><link rel="icon" href="data:,"><title>{say(found.title or found.experiment)}</title>'
        f"<style>{STYLE}</style>{''.join(parts)}</html>\n"
    )


def record(found: Identified) -> dict[str, Any]:
    """Everything but the series, in the program's own units; a number that is none is null."""
    profiled = {one.name: one for one in found.profiles}
    return {
        "experiment": found.experiment,
        "title": found.title,
        "conclusions": conclusions(found),
        "parameters": {
            one.name: {
                "value": one.value,
                "standard_error": one.standard_error,
                "unit": one.unit,
                "bounds": [one.lower, one.upper],
                "start": one.start,
                "remark": one.remark,
                **(
                    {"prior": {"mean": k.mean, "sigma": k.sigma, "of_the_logarithm": k.logarithmic}}
                    if (k := one.prior)
                    else {}
                ),
                **(
                    {"profile": {"values": p.values.tolist(), "rise": p.rise.tolist(), "interval": [p.low, p.high]}}
                    if (p := profiled.get(one.name))
                    else {}
                ),
            }
            for one in found.estimates
        },
        "correlation": {"parameters": list(found.correlated), "matrix": found.correlation.tolist()},
        "weak_combinations": list(found.weak),
        "fits": {"mean_square_over_noise": list(found.start_costs), "stopped": found.stopped, "robust": found.robust},
        "residual": {
            "rms_over_noise": found.ratio,
            "whiteness_p_value": found.whiteness_p,
            "normality_p_value": found.normality_p,
            "samples_an_independent_one": found.independent,
        },
        "noise_sigma": found.outputs[0].noise_sigma,
        "output": {"name": found.outputs[0].name, "unit": found.outputs[0].unit},
        "outputs": {
            one.name: {
                "unit": one.unit,
                "noise_sigma": one.noise_sigma,
                "noise_how": one.noise_how,
                "rms_over_noise": one.ratio,
                "rmse": rms_by_role(found, k),
            }
            for k, one in enumerate(found.outputs)
        },
        "runs": {
            run.name: {
                "role": run.role,
                "rmse": run.rmse,
                "samples": len(run.time),
                "outputs": {
                    one.output: {"rmse": one.rmse, "samples": int(np.isfinite(one.measured).sum())}
                    for one in run.series
                },
            }
            for run in found.runs
        },
        "own_of_held_out_runs": found.own_of_held_out,
        "suggestions": [
            {"run": one.what, "information_nats": one.information, "standard_errors_become": one.shrinks}
            for one in found.suggestions
        ],
        "check": list(found.check),
        "provenance": found.provenance,
    }


def write_identified(found: Identified, folder: Path) -> Path:
    """`identify.html` and `identify.json` in `folder`, each whole or not at all; the path of the page."""
    folder.mkdir(parents=True, exist_ok=True)
    replace(folder / "identify.json", json_text(record(found)))
    return replace(folder / "identify.html", page(found))
