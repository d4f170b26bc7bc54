"""A prediction as a page, pictures, JSON and CSV."""

from __future__ import annotations

import html
from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType
from typing import Any

from matplotlib.axes import Axes

from smajax.attribution.findings import ResidualDiagnostics
from smajax.core.display_units import axis_label, digits, display, label
from smajax.core.files import json_text, replace
from smajax.core.provenance import made_with
from smajax.fit.predict import BAND, PredictedRun, Prediction
from smajax.report.csv_files import RUNS, predicted_runs
from smajax.report.drawing import UPRIGHT
from smajax.report.html import picture
from smajax.report.integration_words import integration_sentence
from smajax.report.pictures import (
    as_png,
    draw_band,
    draw_predicted,
    draw_residual,
    literal,
    new_figure,
    panels_done,
    run_panels,
    tidy,
)
from smajax.report.plain_page import bullets, table, whole
from smajax.report.predict_words import HEAD, band_sentence, conclusions, diagnostics, pooled, run_rows

FILES = ("predict.html", "predict.json", RUNS)
SHOWN = 6  # runs in the first picture
BAND_STYLE: Mapping[str, Any] = MappingProxyType({"color": "#9fc5b8", "alpha": 0.6, "label": "90 % band"})


def _tint(run: PredictedRun, *several: Axes) -> None:
    """The ground where the run leaves what the model was fitted to."""
    for start, end in (span for one in run.extrapolation for span in one.spans):
        for axes in several:
            axes.axvspan(start, end, color="#f1dcc0", alpha=0.35, zorder=0, linewidth=0)


def run_picture(run: PredictedRun, k: int = 0) -> bytes:
    """Of the k-th output: measured, predicted with its band, residual with the same band, varying inputs."""
    one = run.series[k]
    shown = display(one.unit, one.output)
    figure, rows = run_panels(run.time, run.inputs, one.output, shown)
    output, residual = rows[:2]
    measured, middle, half = shown.of(one.measured), shown.of(one.reading), shown.of(one.half_width)
    draw_predicted(output, run.time, measured, middle)
    draw_band(output, run.time, middle, half, {**BAND_STYLE, "alpha": 0.45})
    draw_band(residual, run.time, 0.0, half, {"color": BAND_STYLE["color"], "alpha": 0.45})
    draw_residual(residual, run.time, measured, middle)
    _tint(run, output, residual)
    return panels_done(figure, rows, 3)


def overview(result: Prediction, upright: bool = False) -> bytes:
    """The first output of the first runs, measured, predicted and its band; where a run extrapolates the ground is tinted."""
    runs = result.runs[:SHOWN]
    columns = 1 if upright or len(runs) == 1 else 2
    rows = -(-len(runs) // columns)
    figure = new_figure(0.9 + (2.0 if upright else 2.4) * rows, *([UPRIGHT] if upright else []))
    panels = figure.subplots(rows, columns, squeeze=False).ravel()
    shown = display(runs[0].series[0].unit, runs[0].series[0].output)
    for axes, run in zip(panels, runs, strict=False):
        one = run.series[0]
        middle, half = shown.of(one.reading), shown.of(one.half_width)
        draw_predicted(axes, run.time, shown.of(one.measured), middle)
        draw_band(axes, run.time, middle, half, BAND_STYLE)
        _tint(run, axes)
        axes.set_title(literal(run.name) + " (extrapolation)" * bool(run.extrapolation), fontsize=9, loc="left")
        axes.set_ylabel(axis_label(one.output, shown), fontsize=9)
        axes.margins(x=0.01)
        tidy(axes)
    for axes in panels[len(runs) :]:
        axes.set_visible(False)
    for axes in panels[max(len(runs) - columns, 0) : len(runs)]:
        axes.set_xlabel("time (s)", fontsize=9)
    figure.legend(
        *panels[0].get_legend_handles_labels(), loc="outside upper center", ncols=3, frameon=False, fontsize=9
    )
    return as_png(figure)


def record(result: Prediction, command: str = "") -> dict[str, Any]:
    """The numbers, SI, temperatures in degrees Celsius, for a program; the series are in runs.csv."""
    model = result.model
    outputs = {}
    for k, one in enumerate(result.runs[0].series):
        error, share = pooled(result, k)
        outputs[one.output] = {
            "unit": one.unit,
            "rmse": error,
            "noise_sigma": one.noise,
            "band_coverage": share,
            "residual": _diagnostics(diagnostics(result, k)),
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


def page(result: Prediction, command: str = "") -> str:
    """The whole page: the answer, the picture that proves it, then the rest."""
    model = result.model
    title = f"Prediction by {model.title}" if model.title else "Prediction"
    parts = [
        f"<h1>{html.escape(title)}</h1>",
        bullets(conclusions(result)),
        str(picture(overview(result), "measured and predicted runs", "panels", overview(result, upright=True))),
        f"<p class=quiet>{html.escape(band_sentence(result))}</p>",
        "<h2>Runs</h2>",
        table(HEAD, run_rows(result), (2, 3, 4, 5)),
    ]
    for run in result.runs:
        parts.append(f"<h3>{html.escape(run.name)}</h3>")
        for k, one in enumerate(run.series):
            parts.append(str(picture(run_picture(run, k), f"{run.name}, {label(one.output)}")))
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


def write_prediction(result: Prediction, folder: Path, command: str = "") -> Path:
    """`predict.html`, `predict.json` and `runs.csv` in `folder`, each whole or not at all; the path of the page."""
    folder.mkdir(parents=True, exist_ok=True)
    replace(folder / "predict.json", json_text(record(result, command)))
    replace(folder / RUNS, predicted_runs(result))
    return replace(folder / "predict.html", page(result, command))
