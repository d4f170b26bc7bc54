"""An identification as one self-contained page, and as a record for machines."""

from __future__ import annotations

import html
from pathlib import Path
from typing import Any

import numpy as np

from smajax.identify import Estimate, Identified
from smajax.report import identify_pictures as draw
from smajax.report.display import digits, display, label, p_value, with_error
from smajax.report.files import json_text, replace
from smajax.report.html import picture
from smajax.report.plain_page import bullets, table, whole
from smajax.residual.noise_like import WHITE

OFF = 1.25  # ratio of residual to noise that is worth a sentence
KNOWN = "Every combination of the parameters is known to 5 % or better."
KNOWN_OF_THE_REST = (
    "Of the parameters that are neither at a bound nor without effect, every combination is known to 5 %."
)


def conclusions(found: Identified) -> list[str]:
    """What was found, in sentences that say no more than the numbers."""
    unit = display(found.output_unit, found.output_name)
    told = [found.stopped]
    by_role = {
        role: [one.rmse for one in found.runs if one.role == role] for role in dict.fromkeys(r.role for r in found.runs)
    }
    errors = "; ".join(
        f"{role} runs {digits(unit.of(float(np.sqrt(np.mean(np.square(values))))), 3)} {unit.unit}".strip()
        for role, values in by_role.items()
    )
    told.append(
        f"Error (rms): {errors}; noise {digits(unit.of(found.noise_sigma), 3)} {unit.unit}, {found.noise_how}.".replace(
            " ,", ","
        )
    )
    if found.whiteness_p < WHITE:
        told.append(
            f"The residual is {found.ratio:.2g} times the noise and has a memory ({p_value(found.whiteness_p)}; one "
            f"sample in {found.independent:.0f} is independent): the model lacks something, and the standard errors allow "
            "for the memory but not for what that does to the values. `smajax close-loop` looks for what it is."
        )
    else:
        told.append(
            f"The residual is {found.ratio:.2g} times the noise, and no memory was found in it "
            f"({p_value(found.whiteness_p)}): nothing in these runs speaks against the model."
        )
        if not 1.0 / OFF < found.ratio < OFF:
            told.append("The noise is not what was declared: errors were taken from the residual.")
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


def page(found: Identified) -> str:
    """The whole page."""
    unit = display(found.output_unit, found.output_name)
    say = html.escape
    runs = [[one.name, one.role, str(len(one.time)), digits(unit.of(one.rmse), 3)] for one in found.runs]
    head = ["parameter", "estimate ± standard error", "unit", "95 % (profile)", "bounds", "start", "remark"]
    parts = [
        f"<h1>{say(found.title or found.experiment)}: parameters</h1>",
        bullets(conclusions(found)),
        "<h2>Parameters</h2>",
        table(head, estimate_rows(found), (1,)),
        "<h2>What the runs tell apart</h2>",
        bullets(found.weak) or f"<p>{KNOWN if found.all_took_part else KNOWN_OF_THE_REST}</p>",
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
            table(["", "run", "information, nats", "standard errors become"], rows, (2,)),
            picture(draw.suggested_inputs(found), "suggested inputs"),
        ]
    parts += ["<h2>Runs</h2>", table(["run", "role", "samples", f"rms error ({unit.unit or '-'})"], runs, (2, 3))]
    for one in found.runs:
        parts.append(
            f"<h3>{say(one.name)} ({say(one.role)})</h3>{picture(draw.run_with_band(found, one), label(one.name))}"
        )
    parts += [
        "<h2>Checks and provenance</h2>",
        bullets(found.check),
        table(["", ""], list(map(list, found.provenance.items()))),
    ]
    return whole(f"{found.title or found.experiment}", parts)


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
                    {"profile": {"values": k.values.tolist(), "rise": k.rise.tolist(), "interval": [k.low, k.high]}}
                    if (k := profiled.get(one.name))
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
        "noise_sigma": found.noise_sigma,
        "output": {"name": found.output_name, "unit": found.output_unit},
        "runs": {one.name: {"role": one.role, "rmse": one.rmse, "samples": len(one.time)} for one in found.runs},
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
