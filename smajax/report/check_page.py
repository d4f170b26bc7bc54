"""The check of an experiment as a page and as JSON: measured runs and the model at the initial guess, side by side."""

from __future__ import annotations

import html
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from smajax.core.display_units import display, label
from smajax.core.files import json_text, replace
from smajax.core.provenance import made_with
from smajax.fit.experiment_check import CheckedRun, CheckedSeries, ExperimentCheck
from smajax.report.check_words import UNKNOWNS_HEAD, answer, at_the_guess, conclusions, run_rows, unknown_rows, warnings
from smajax.report.next_steps import Step, section
from smajax.report.plain_page import bullets, folded, headline, table, whole
from smajax.report.run_plots import measured_line, output_alone, output_panel, residual_panel, run_plot
from smajax.report.series_picture import COARSE, series, series_of_runs
from smajax.report.series_plot import Band, Line, SeriesPlot, samples_of

FILES = ("check.html", "check.json")
FIRST = 4  # runs of the first plots
HEIGHT = 200  # px, of these


def run_plot_of(run: CheckedRun, k: int = 0) -> SeriesPlot:
    """Of the k-th output: measured, simulated at the initial guess, what is left with the band of the noise, and the inputs that vary."""
    one = run.series[k]
    shown = display(one.unit, one.output)
    measured, simulated = shown.of(one.measured), shown.of(one.simulated)
    noise = np.full(measured.shape, 2.0 * shown.of(one.noise))
    output = output_panel(one.output, shown, [measured_line(measured), Line("initial guess", simulated, "after")])
    left = [Line("residual", measured - simulated, "after", 1.0)]
    residual = residual_panel(shown, left, [Band("noise, ± 2 σ", -noise, noise, "noise", 0.8)])
    return run_plot(f"{run.name}, {label(one.output)}", run.time, run.inputs, output, residual)


def record(found: ExperimentCheck, command: str = "") -> dict[str, Any]:
    """The numbers, SI, temperatures in degrees Celsius, for a program."""
    identifiable = found.checks.identifiable
    return {
        "command": command,
        "title": found.title,
        "experiment": found.source,
        "conclusions": [answer(found), *conclusions(found)],
        "warnings": warnings(found),
        "step": found.step,
        "unknowns": {
            name: {"unit": one.unit, "start": one.start, "low": one.low, "high": one.high, "per_run": one.per_run}
            for name, one in found.unknowns.items()
        },
        "identifiable": {
            "rank": identifiable.rank,
            "without_effect": list(identifiable.without_effect),
            "undetermined": list(identifiable.undetermined),
        },
        "held_presets": list(found.checks.held_presets),
        "runs": [_run(run) for run in found.runs],
        "provenance": made_with(),
    }


def _run(run: CheckedRun) -> dict[str, Any]:
    def span(values: np.ndarray) -> list[float] | None:
        there = values[np.isfinite(values)]
        return [float(there.min()), float(there.max())] if there.size else None

    def output(one: CheckedSeries) -> dict[str, Any]:
        missing = int(np.sum(~np.isfinite(one.measured)))
        return {
            "unit": one.unit,
            "range": span(one.measured),
            "missing": missing,
            "noise_sigma": one.noise,
            "offset": one.offset,
            "rmse": one.rmse,
        }

    return {
        "name": run.name,
        "role": run.role,
        "seconds": float(run.time[-1] - run.time[0]),
        "samples": len(run.time),
        "inputs": {name: span(np.asarray(values)) for name, values in run.inputs.items()},
        "states": {name: span(values) for name, values in run.states.items()},
        "outputs": {one.output: output(one) for one in run.series},
    }


def page(found: ExperimentCheck, command: str = "", steps: Sequence[Step] = ()) -> str:
    """The whole page: the answer, the first runs, then the rest."""
    title = f"Check of {found.title or found.source}"
    plots = [[run_plot_of(run, k) for k in range(len(run.series))] for run in found.runs]
    first = [
        output_alone(several[0], f"{run.name}, measured and at the initial guess", run.name, HEIGHT)
        for run, several in zip(found.runs[:FIRST], plots, strict=False)
    ]
    samples = samples_of([*first, *(plot for several in plots for plot in several)])
    head, rows = run_rows(found)
    parts = [
        f"<h1>{html.escape(title)}</h1>",
        headline(answer(found)),
        bullets([f"Warning: {one}" for one in warnings(found)]),
        f'<div class="{"pair" if len(first) > 1 else ""}">{"".join(series(plot, samples, dpi=COARSE) for plot in first)}</div>',
        bullets(at_the_guess(found)),
        section(steps),
        "<h2>Runs</h2>",
        "<p class=quiet>Nothing was fitted: errors (rms), zeros and what is simulated are those at the initial guess.</p>",
        table(head, rows, range(2, len(head))),
        *folded(
            [
                f"<h3>{html.escape(run.name)}</h3>{shown}"
                for run, shown in zip(found.runs, series_of_runs(plots, samples), strict=True)
            ],
            "runs",
        ),
        "<h2>Unknowns</h2>",
        table(UNKNOWNS_HEAD, unknown_rows(found), (1, 2, 3)) if found.unknowns else "<p>None.</p>",
        "<h2>Provenance</h2>",
        table(["", ""], [["command", command], *map(list, made_with().items())]),
        "<p class=quiet>The same numbers: check.json.</p>",
    ]
    return whole(title, parts, "fair" if warnings(found) else "")


def write_check(found: ExperimentCheck, folder: Path, command: str = "", steps: Sequence[Step] = ()) -> Path:
    """`check.html` and `check.json` in `folder`, each whole or not at all; the path of the page."""
    folder.mkdir(parents=True, exist_ok=True)
    replace(folder / "check.json", json_text(record(found, command)))
    return replace(folder / "check.html", page(found, command, steps))
