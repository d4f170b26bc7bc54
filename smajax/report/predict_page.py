"""A prediction as a page, pictures, JSON and CSV."""

from __future__ import annotations

import html
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from smajax.core.display_units import digits, display, label
from smajax.core.files import json_text, replace
from smajax.core.provenance import made_with
from smajax.fit.prediction import PredictedRun, Prediction
from smajax.fit.prediction_band import BAND
from smajax.fit.residual_diagnostics import ResidualDiagnostics
from smajax.report.csv_files import RUNS, predicted_runs
from smajax.report.integration_words import integration_sentence
from smajax.report.next_steps import Step, section
from smajax.report.plain_page import bullets, folded, headline, table, whole
from smajax.report.predict_words import HEAD, MOVES, band_sentence, conclusions, run_rows
from smajax.report.run_plots import measured_line, output_alone, output_panel, residual_panel, run_plot
from smajax.report.series_picture import COARSE, series, series_of_runs
from smajax.report.series_plot import Band, Line, SeriesPlot, samples_of

FILES = ("predict.html", "predict.json", RUNS)
SHOWN = 4  # runs of the first plots
OVERVIEW = 200  # px: their height


def _spans(run: PredictedRun) -> list[tuple[float, float]]:
    """Where the run leaves what the model was fitted to."""
    return [(float(start), float(end)) for one in run.extrapolation for start, end in one.spans]


def run_plot_of(run: PredictedRun, k: int = 0) -> SeriesPlot:
    """Of the k-th output: measured, predicted with its band, residual with the same band, varying inputs."""
    one = run.series[k]
    shown = display(one.unit, one.output)
    measured, middle = shown.of(one.measured), shown.of(one.reading)
    half = np.broadcast_to(shown.of(one.half_width), middle.shape)
    lines = [measured_line(measured), Line("predicted", middle, "after")]
    output = output_panel(one.output, shown, lines, [Band("90 % band", middle - half, middle + half, "predicted", 0.6)])
    left = [Line("residual", measured - middle, "after", 1.0)]
    residual = residual_panel(shown, left, [Band("the same band", -half, half, "predicted", 0.6, silent=True)])
    return run_plot(f"{run.name}, {label(one.output)}", run.time, run.inputs, output, residual, _spans(run))


def overview(result: Prediction) -> list[SeriesPlot]:
    """The first output of the first runs, measured, predicted and its band; where a run extrapolates the ground is tinted."""
    return [
        output_alone(
            run_plot_of(run),
            f"{run.name}, measured and predicted",
            run.name + " (extrapolation)" * bool(run.extrapolation),
            OVERVIEW,
        )
        for run in result.runs[:SHOWN]
    ]


def record(result: Prediction, command: str = "") -> dict[str, Any]:
    """The numbers, SI, temperatures in degrees Celsius, for a program; the series are in runs.csv."""
    model = result.model
    outputs = {}
    for one, errors in zip(result.runs[0].series, result.errors, strict=True):
        outputs[one.output] = {
            "unit": one.unit,
            "rmse": errors.rmse,
            "noise_sigma": one.noise,
            "band_coverage": errors.coverage,
            "band_coverage_moving": errors.moving_coverage,
            "residual": _diagnostics(errors.residual),
        }
    return {
        "command": command,
        "model": {
            "title": model.title,
            "wire": model.wire,
            "load": model.load,
            "drive": model.drive,
            "law": model.law,
            "effects": list(model.effects),
            "parameters": model.values,
            "averaged_models": [{"effects": list(one.effects), "weight": one.probability} for one in model.likely],
        },
        "conclusions": conclusions(result),
        "warnings": list(result.warnings),
        "band": BAND,
        "step": result.step,
        "integration_error": result.integration.record(),
        "outputs": outputs,
        "runs": [_run(run) for run in result.runs],
        "provenance": {**made_with(), **{f"sha256 of {run.name}": run.sha256 for run in result.runs}},
    }


def _diagnostics(found: ResidualDiagnostics | None) -> dict[str, Any] | None:
    if found is None:
        return None
    return {
        "ratio": found.ratio,
        "white": found.white,
        "whiteness_p_value": found.whiteness_p_value,
        "by_phase": found.by_phase,
        "correlation": found.correlation,
    }


def _run(run: PredictedRun) -> dict[str, Any]:
    return {
        "name": run.name,
        "fitted": run.fitted,
        "outputs": {
            one.output: {
                "unit": one.unit,
                "rmse": one.rmse,
                "ratio": one.rmse / one.noise,
                "band_coverage": one.coverage,
                "band_coverage_moving": one.moving_coverage,
                "offset": one.offset,
            }
            for one in run.series
        },
        "extrapolation": [
            {
                "quantity": one.quantity,
                "unit": one.unit,
                "fitted_range": list(one.fitted),
                "reached": list(one.reached),
                "share_of_samples": one.share,
                "spans_s": [list(span) for span in one.spans],
            }
            for one in run.extrapolation
        ],
    }


def page(result: Prediction, command: str = "", steps: Sequence[Step] = ()) -> str:
    """The whole page: the answer, the picture that proves it, then the rest."""
    model = result.model
    title = f"Prediction by {model.title}" if model.title else "Prediction"
    said = conclusions(result)
    first, plots = overview(result), [[run_plot_of(run, k) for k in range(len(run.series))] for run in result.runs]
    samples = samples_of([*first, *(plot for several in plots for plot in several)])
    parts = [
        f"<h1>{html.escape(title)}</h1>",
        headline(said[0]) if said else "",
        f'<div class="{"pair" if len(first) > 1 else ""}">{"".join(series(plot, samples, dpi=COARSE) for plot in first)}</div>',
        bullets(said[1:]),
        f"<p class=quiet>{html.escape(band_sentence(result))} {html.escape(MOVES)}</p>",
        section(steps),
        "<h2>Runs</h2>",
        table(HEAD, run_rows(result), (2, 3, 4, 5, 6, 7)),
    ]
    parts += folded(
        [
            f"<h3>{html.escape(run.name)}</h3>{shown}"
            for run, shown in zip(result.runs, series_of_runs(plots, samples), strict=True)
        ],
        "runs",
    )
    likely = [[" + ".join(one.effects) or "base model", f"{one.probability:.1%}"] for one in model.likely]
    values = [
        [name, digits(one.value, 6), digits(one.standard_error, 2), model.table[name].unit, one.origin]
        for name, one in model.parameters.items()
    ]
    parts += [
        "<h2>The model</h2>",
        table(["effects", "probability"], likely, (1,)) if len(likely) > 1 else "",
        table(["parameter", "value", "standard error", "unit", "origin"], values, (1, 2)),
        "<h2>Checks and provenance</h2>",
        bullets([*result.warnings, integration_sentence(result.integration.record())]),
        table(["", ""], [["command", command], *map(list, made_with().items())]),
        f"<p class=quiet>The same numbers: predict.json, {RUNS}.</p>",
    ]
    return whole(title, parts)


def write_prediction(result: Prediction, folder: Path, command: str = "", steps: Sequence[Step] = ()) -> Path:
    """`predict.html`, `predict.json` and `runs.csv` in `folder`, each whole or not at all; the path of the page. steps: what a reader may do next."""
    folder.mkdir(parents=True, exist_ok=True)
    replace(folder / "predict.json", json_text(record(result, command)))
    replace(folder / RUNS, predicted_runs(result))
    return replace(folder / "predict.html", page(result, command, steps))
