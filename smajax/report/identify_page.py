"""An identification as one self-contained page, and the files it is written to."""

from __future__ import annotations

import html
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from smajax.core.display_units import correlation, digits, display, label
from smajax.core.files import json_text, replace
from smajax.fit.directions import weak
from smajax.fit.identify_result import Identified, IdentifiedOutput
from smajax.report import identify_pictures as draw
from smajax.report.csv_files import PARAMETERS, RUNS, identified_parameters, identified_runs
from smajax.report.embedded import picture
from smajax.report.identifiability_words import check_sentences, weak_combinations
from smajax.report.identify_record import record
from smajax.report.identify_words import answer, conclusions, estimate_rows, posterior_rows, prior_shown
from smajax.report.next_steps import Step, after_identify, section
from smajax.report.plain_page import breakable, bullets, folded, headline, table, whole
from smajax.report.run_plots import output_alone
from smajax.report.series_picture import COARSE, series, series_of_runs

KNOWN = "Every combination of the parameters is known to 5 % (temperatures: to 1 K) or better."
KNOWN_OF_THE_REST = "Of the parameters that are neither at a bound nor without effect, every combination is known to 5 % (temperatures: to 1 K)."


def _run_rows(result: Identified) -> tuple[list[str], list[list[str]]]:
    """(head, rows): each run's error by output."""

    def head(one: IdentifiedOutput) -> str:
        unit = display(one.unit, one.name).unit or "-"
        return f"rms error ({unit})" if len(result.outputs) == 1 else f"{label(one.name)}, rms error ({unit})"

    rows = []
    for run in result.runs:
        errors = [
            digits(display(one.unit, one.name).of(series.rmse), 3)
            for one, series in zip(result.outputs, run.series, strict=True)
        ]
        rows.append([run.name, run.role, str(len(run.time)), *errors])
    return ["run", "role", "samples", *(head(one) for one in result.outputs)], rows


def _what_to_do(result: Identified) -> str:
    """About parameters of which the runs see one combination; empty where there are none."""
    if not any(len(one.named) > 1 and not one.unbound for one in weak(result.directions)):
        return ""
    where = "such runs are ranked below" if result.suggestions else "<code>--design</code> ranks such runs"
    return (
        "<p>Of correlated parameters measure one by itself and give it under <code>[model.parameters]</code> in the place of "
        f"<code>[unknown]</code>, or add a run that separates them (another load, a slower or a hotter one): {where}.</p>"
    )


def _correlations(result: Identified) -> str:
    """The correlation matrix of the estimates as text that keeps its size on a telephone; nothing for fewer than two."""
    if len(result.correlated) < 2:
        return ""
    numbered = range(1, len(result.correlated) + 1)
    columns = "".join(f"<th class=n>{number}</th>" for number in numbered)
    rows = [
        f'<tr><td data-v="{number}">{number}&nbsp;{breakable(name)}</td>'
        + "".join(f'<td class=n style="background:{_colour(value)}">{correlation(value)}</td>' for value in line)
        + "</tr>"
        for number, name, line in zip(numbered, result.correlated, result.correlation.tolist(), strict=True)
    ]
    return (
        "<p class=quiet>Correlations of the estimates; a column is the parameter of its number.</p>"
        '<div class=scroll><table class=sortable style="width:auto"><thead><tr><th>parameter</th>'
        f"{columns}</tr></thead><tbody>{''.join(rows)}</tbody>"
        "</table></div>"
    )


def _colour(value: float) -> str:
    """Red of what rises together and blue of what does not, none stronger than what dark text is read on."""
    return f"rgb({'178 24 43' if value > 0.0 else '33 102 172'} / {0.7 * abs(value):.2f})"


def _run_parts(result: Identified) -> list[str]:
    """The plots of every run; those beyond ten are folded away."""
    plots = [
        [draw.run_plot_of(result, run, k) for k in range(len(result.outputs)) if np.isfinite(run.series[k].rmse)]
        for run in result.runs
    ]
    return folded(
        [
            f"<h3>{html.escape(run.name)} ({html.escape(run.role)})</h3>{shown}"
            for run, shown in zip(result.runs, series_of_runs(plots), strict=True)
        ],
        "runs",
    )


def _first_plot(result: Identified) -> str:
    """Measured and simulated of one run, held out where one is: that with the largest error over the noise."""
    runs = [run for run in result.runs if run.role == "held-out"] or list(result.runs)
    ratios = {
        (run.name, k): float(np.nan_to_num(run.series[k].rmse / one.noise_sigma, nan=-1.0, posinf=-1.0))
        for run in runs
        for k, one in enumerate(result.outputs)
    }
    name, k = max(ratios, key=lambda key: ratios[key])
    run = next(one for one in runs if one.name == name)
    if not np.isfinite(run.series[k].rmse):
        return ""
    plot = draw.run_plot_of(result, run, k)
    return str(series(output_alone(plot, f"{plot.about}, measured and simulated", f"{name} ({run.role})")))


def page(result: Identified, steps: Sequence[Step] = ()) -> str:
    """The whole page."""
    say = html.escape
    run_head, runs = _run_rows(result)
    interval = ["95 % (profile)"] if result.profiles else []
    head = ["parameter", "estimate ± standard error", "unit", *interval, "bounds", "start", "remark"]
    rows = estimate_rows(result)
    if any(one.prior for one in result.estimates):
        head.insert(-1, "known before")
        rows = [[*row[:-1], prior_shown(one), row[-1]] for row, one in zip(rows, result.estimates, strict=True)]
    parts = [
        f"<h1>{say(result.title or result.experiment)}: parameters</h1>",
        headline(answer(result)),
        _first_plot(result),
        bullets(conclusions(result)),
        section(steps),
        "<h2>Parameters</h2>",
        table(head, rows, [k for k, title in enumerate(head) if title not in ("parameter", "unit", "remark")]),
        "<h2>Which combinations are identifiable</h2>",
        bullets(weak_combinations(result.directions))
        or f"<p>{KNOWN if result.all_took_part else KNOWN_OF_THE_REST}</p>",
        _what_to_do(result),
        _correlations(result),
    ]
    if result.profiles:
        parts += [
            "<h2>Profile likelihood</h2><p class=quiet>Each parameter held, all others fitted again: the rise of the cost "
            "(blue), what the standard error stands for (grey), the 95 % line (red).</p>",
            picture(draw.profile_curves(result), "profiles", "panels", draw.profile_curves(result, upright=True)),
        ]
    if result.posterior is not None:
        chains = ["parameter", "mean ± standard deviation", "unit", "95 %", "R-hat", "independent draws"]
        parts += [
            "<h2>Posterior</h2><p class=quiet>Drawn by Markov chains, even within the bounds but for what was known before; "
            f"{100.0 * result.posterior.accepted:.0f} % of the jumps were taken; the samples count by 1/"
            f"{digits(result.posterior.inflation, 2)}, as in the standard errors. Histograms: draws; grey: what the standard "
            "error stands for.</p>",
            table(chains, posterior_rows(result), (1, 3, 4, 5)),
            picture(
                draw.posterior_histograms(result),
                "posterior",
                "panels",
                draw.posterior_histograms(result, upright=True),
            ),
        ]
    if result.suggestions:
        rows = [
            [
                str(number),
                one.what,
                digits(one.information, 3),
                ", ".join(f"{label(name)} × {digits(share, 2)}" for name, share in one.shrinks.items()),
            ]
            for number, one in enumerate(result.suggestions, start=1)
        ]
        parts += [
            "<h2>What to measure next</h2><p class=quiet>Courses of the input within what was applied already, ranked by "
            "what one such run would determine (D-optimal, at the fit).</p>",
            table(["rank", "run", "information, nats", "standard errors become"], rows, (0, 2)),
            *(series(plot, dpi=COARSE) for plot in draw.suggested_inputs(result)),
        ]
    parts += ["<h2>Runs</h2>", table(run_head, runs, range(2, len(run_head)))]
    parts += _run_parts(result)
    parts += [
        "<h2>Checks and provenance</h2>",
        bullets(check_sentences(result.warnings, result.checks)),
        table(["", ""], list(map(list, result.provenance.items()))),
        f"<p class=quiet>The same numbers: identify.json, {PARAMETERS}, {RUNS}.</p>",
    ]
    return whole(f"{result.title or result.experiment}", parts)


def write_identified(result: Identified, folder: Path, experiment: Path | None = None) -> Path:
    """`identify.html`, `identify.json` and its tables in `folder`, each whole or not at all; the path of the page.

    experiment: the experiment file, for the commands that the page suggests.
    """
    folder.mkdir(parents=True, exist_ok=True)
    replace(folder / "identify.json", json_text(record(result)))
    if result.model is not None:
        result.model.save(folder / "model.toml")
    replace(folder / PARAMETERS, identified_parameters(result))
    replace(folder / RUNS, identified_runs(result))
    return replace(
        folder / "identify.html", page(result, after_identify(result, folder, str(experiment or result.source)))
    )
