"""Plots of the runs of an attribution: output, residual and inputs over time, and the residual's autocorrelation."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from smajax.attribution.findings import Findings, RunFinding
from smajax.attribution.run_finding import BesideModels
from smajax.core.display_units import Display, display, label
from smajax.model.channels import channel
from smajax.report.pictures import autocorrelation, nothing_added
from smajax.report.series_plot import Band, Line, Panel, SeriesPlot

STRIPS = 3  # input channels drawn under one run
STRIP, RESIDUAL, OUTPUT = 56, 110, 200  # px
FIRST, FIRST_OF_TWO = 230, 170  # px: the plot of the first screen, alone and above the residual


def measured_line(values: np.ndarray) -> Line:
    """The measured curve, wide, under those of models."""
    return Line("measured", values, "measured", 2.4, 0.55)


def run_plot(
    about: str,
    time: np.ndarray,
    inputs: Mapping[str, np.ndarray],
    output: Panel,
    residual: Panel,
    spans: Sequence[tuple[float, float]] = (),
    more: Sequence[Panel] = (),
) -> SeriesPlot:
    """One run: output, residual, `more` panels, and the first inputs that vary."""
    varying = [name for name, values in inputs.items() if np.ptp(values) > 0.0][:STRIPS]
    strips = tuple(
        Panel(
            label(name),
            channel(name).unit,
            (Line(label(name), np.asarray(channel(name).of(inputs[name])), "input", 1.0, silent=True),),
            height=STRIP,
        )
        for name in varying
    )
    return SeriesPlot(about, time, (output, residual, *more, *strips), spans=tuple(spans))


def output_panel(name: str, shown: Display, lines: Sequence[Line], bands: Sequence[Band] = ()) -> Panel:
    """What is measured and what models say of it."""
    return Panel(label(name), shown.unit, tuple(lines), tuple(bands), OUTPUT)


def residual_panel(shown: Display, lines: Sequence[Line], bands: Sequence[Band]) -> Panel:
    """What models leave over."""
    return Panel("measured − model", shown.unit, tuple(lines), tuple(bands), RESIDUAL)


def output_alone(plot: SeriesPlot, about: str, of: str, height: int = FIRST) -> SeriesPlot:
    """The output of a run's plot without what stands below it. of: whose it is, after the output's name; height: px."""
    panel = plot.panels[0]
    alone = replace(panel, name=f"{panel.name} of {of}", height=height)
    return SeriesPlot(about, plot.at, (alone,), plot.axis, plot.spans)


def models_of(findings: Findings, run: BesideModels) -> list[tuple[str, np.ndarray, str]]:
    """The models to draw for one output of a run: name, values, colour. One only when nothing was added."""
    if nothing_added(findings):
        return [("base model", run.before, "after")]
    return [("before", run.before, "before"), ("after", run.after, "after")]


def _panels(
    findings: Findings, one: BesideModels, sensor: tuple[str, str, float], held_out: bool
) -> tuple[Panel, Panel]:
    """(an output measured and by the models, of a held-out run with the band of the average; what they leave). sensor: name, unit, noise."""
    name, unit, sigma = sensor
    shown = display(unit, name)
    models = models_of(findings, one)
    lines = [measured_line(shown.of(one.measured))]
    lines += [Line(model, shown.of(values), colour) for model, values, colour in models]
    bands = []
    if held_out and one.average is not None:
        middle, half = shown.of(one.average.reading), shown.of(one.average.half_width)
        bands = [Band("90 % band", middle - half, middle + half, "band", 0.22)]
    noise = np.full(len(one.measured), 2.0 * shown.of(sigma))
    left = [Line(model, shown.of(one.measured - values), colour, 1.0) for model, values, colour in models]
    residual = residual_panel(shown, left, [Band("noise, ± 2 σ", -noise, noise, "noise", 0.8)])
    return output_panel(name, shown, lines, bands), residual


def over_time(findings: Findings, run: RunFinding) -> SeriesPlot:
    """Output measured, before and after; the residuals with the noise band; the same of other outputs; the varying inputs on thin strips.

    Of a held-out run also the band of the averaged prediction.
    """
    held_out = run.role == "held-out"
    sensor = findings.output_name, findings.output_unit, findings.noise_sigma
    output, residual = _panels(findings, run, sensor, held_out)
    more: list[Panel] = []
    for one in run.others:
        its, left = _panels(findings, one, (one.name, one.unit, one.noise_sigma), held_out)
        more += [its, replace(left, name=f"{its.name}: {left.name}")]
    return run_plot(f"Run {run.name} over time", run.time, run.inputs, output, residual, more=more)


def first_plot(findings: Findings) -> SeriesPlot | None:
    """Before and after, for the first screen: the held-out run that the base model gets most wrong, of fit runs where none is held out."""
    held_out = [run for run in findings.runs if run.role == "held-out"]
    runs = held_out or list(findings.runs)
    if not runs:
        return None
    run = max(runs, key=lambda one: float(np.nan_to_num(one.rmse_before, nan=-1.0)))
    named = run.name + (" (held out)" if held_out else "")
    plot = over_time(findings, run)
    alone = output_alone(plot, f"Run {run.name}, before and after", named, FIRST_OF_TWO)
    # Where two models differ by a few noises, their curves lie on one another; what they leave does not.
    residual = plot.panels[1]
    lines = tuple(replace(line, silent=True) for line in residual.lines)
    return replace(alone, panels=(*alone.panels, replace(residual, lines=lines)))


def residual_correlation(findings: Findings) -> SeriesPlot | None:
    """Autocorrelation of the fit runs' residuals before and after, with the 95 % band of white noise."""
    runs = [run for run in findings.runs if run.role == "fit" and len(run.time) > 8]
    if not runs:
        return None
    lags = min(200, min(len(run.time) for run in runs) // 4)
    step = float(np.median(np.diff(runs[0].time)))
    band = np.full(lags, 1.96 / np.sqrt(sum(len(run.time) for run in runs)))
    lines = []
    for index, (name, _, colour) in enumerate(models_of(findings, runs[0])):
        models = [run.after if index or nothing_added(findings) else run.before for run in runs]
        curve = autocorrelation([run.measured - model for run, model in zip(runs, models, strict=True)], lags)
        lines.append(Line(name, curve[1:], colour, 1.4))
    white = (Band("95 % of white noise", -band, band, "noise", 0.8),)
    panel = Panel("autocorrelation of the residual", "", tuple(lines), white, 190)
    return SeriesPlot("Autocorrelation of the residual", step * np.arange(1, lags + 1), (panel,), ("lag", "s"))
