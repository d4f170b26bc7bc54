"""The report's pictures, each a function from the record to a PNG.

Figures are made through matplotlib's object interface: no backend is chosen and no state is shared, so a program that
plots on its own is not disturbed.
"""

from __future__ import annotations

import io
from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from smajax.attribution.findings import EffectFinding, Findings, ResidualDiagnostics, RunFinding
from smajax.core.display_units import Display, axis_label, display, label
from smajax.model.channels import channel

MEASURED, BEFORE, AFTER, NOISE, QUIET = "#1d1d1f", "#c8553d", "#1f6fb2", "#d9dce1", "#9aa0a8"
THICK: dict[str, Any] = {"color": MEASURED, "linewidth": 2.2, "alpha": 0.55}  # the measured curve, under the models
BAND_STYLE: Mapping[str, Any] = MappingProxyType({"color": AFTER, "alpha": 0.22, "label": "90 % band"})
WIDTH = 6.6  # inches; with the text size below still readable on a telephone
NARROW = 5.2  # for pictures of one simple panel
DPI = 150
SAMPLES_DRAWN = 3000  # per curve: more than the pixels across
LEAST_PROBABILITY = 0.01  # of an effect that is drawn
BANDS = 2  # held-out runs on the first screen
STRIPS = 3  # input channels drawn under one run


def as_png(figure: Figure) -> bytes:
    stream = io.BytesIO()
    figure.savefig(stream, format="png", dpi=DPI, facecolor="white", metadata={"Software": None})
    return stream.getvalue()


def new_figure(height: float, width: float = WIDTH) -> Figure:
    return Figure(figsize=(width, height), layout="constrained")


def tidy(axes: Axes) -> None:
    axes.spines[["top", "right"]].set_visible(False)
    axes.tick_params(labelsize=9, color=QUIET)
    axes.grid(True, color="#eceef1", linewidth=0.7)
    axes.set_axisbelow(True)


def _thinned(samples: int) -> slice:
    return slice(None, None, max(1, samples // SAMPLES_DRAWN))


def extremes(time: np.ndarray, values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """A long series by the lowest and highest sample of each bucket, so that no peak is lost; short ones unchanged."""
    size = -(-2 * len(time) // SAMPLES_DRAWN)
    if size <= 2:
        return time, values
    whole = len(time) // size * size
    # A bucket that holds a number is not drawn by a missing one: nan is neither lowest nor highest.
    buckets = values[:whole].reshape(-1, size)
    missing = np.isnan(buckets)
    rows = np.arange(len(buckets)) * size
    lowest, highest = (
        np.where(missing, np.inf, buckets).argmin(axis=1),
        np.where(missing, -np.inf, buckets).argmax(axis=1),
    )
    picked = np.sort(np.stack([rows + lowest, rows + highest]), axis=0).T.ravel()
    picked = np.append(picked, np.arange(whole, len(time)))
    return time[picked], values[picked]


def literal(text: str) -> str:
    """Text as it stands: a dollar sign would begin a formula."""
    return text.replace("$", r"\$")


def dots_of(measured: np.ndarray) -> dict[str, Any]:
    """The style of a measured curve that lacks samples: one whose neighbours are missing is on no line."""
    return {"marker": ".", "markersize": 3.0} if np.isnan(measured).any() else {}


def draw_predicted(
    axes: Axes, time: np.ndarray, measured: np.ndarray, predicted: np.ndarray, name: str = "predicted"
) -> None:
    """The measured curve and a model's, in the unit shown; `name` is that of the model's."""
    axes.plot(*extremes(time, measured), **THICK, **dots_of(measured), label="measured")
    axes.plot(*extremes(time, predicted), color=AFTER, linewidth=1.2, label=name)


def draw_residual(axes: Axes, time: np.ndarray, measured: np.ndarray, predicted: np.ndarray) -> None:
    """What is left of the measured curve, in the unit shown."""
    axes.plot(*extremes(time, measured - predicted), color=AFTER, linewidth=0.9, **dots_of(measured))


def draw_band(
    axes: Axes, time: np.ndarray, middle: np.ndarray | float, half: np.ndarray, style: Mapping[str, Any] = BAND_STYLE
) -> None:
    """A band of some half width about a curve, in the unit shown."""
    thin = _thinned(len(time))
    low, high = np.broadcast_arrays(middle - half, middle + half)
    axes.fill_between(time[thin], low[thin], high[thin], **{"linewidth": 0.0, **style})


def nothing_added(findings: Findings) -> bool:
    """Whether the model after is the model before."""
    return not any(effect.added for effect in findings.effects)


def _models(findings: Findings, run: RunFinding) -> list[tuple[str, np.ndarray, str]]:
    """The models to draw for one run: name, values, colour. One only when nothing was added."""
    if nothing_added(findings):
        return [("base model", run.before, AFTER)]
    return [("before: base model", run.before, BEFORE), ("after: extended model", run.after, AFTER)]


def _varying(inputs: dict[str, np.ndarray]) -> list[str]:
    return [name for name, values in inputs.items() if np.ptp(values) > 0.0][:STRIPS]


def run_panels(time: np.ndarray, inputs: dict[str, np.ndarray], name: str, shown: Display) -> tuple[Figure, list[Axes]]:
    """A figure of one run: output, residual, and the varying inputs, already drawn, on thin strips."""
    strips = _varying(inputs)
    figure = new_figure(4.7 + 0.75 * max(len(strips) - 1, 0))
    rows = list(figure.subplots(2 + len(strips), 1, sharex=True, height_ratios=[3.0, 1.5, *[0.7] * len(strips)]))
    rows[0].set_ylabel(axis_label(name, shown), fontsize=9)
    rows[1].set_ylabel("measured\n− model" + (f" ({shown.unit})" if shown.unit else ""), fontsize=9)
    for axes, strip in zip(rows[2:], strips, strict=True):
        unit = channel(strip)
        axes.plot(*extremes(time, unit.of(inputs[strip])), color="#5b6470", linewidth=0.9)
        axes.set_ylabel(f"{label(strip)}\n({unit.unit})" if unit.unit else label(strip), fontsize=8)
    rows[-1].set_xlabel("time (s)", fontsize=9)
    return figure, rows


def panels_done(figure: Figure, rows: list[Axes], columns: int) -> bytes:
    """The picture of `run_panels`, its legend in so many columns."""
    rows[1].axhline(0.0, color=QUIET, linewidth=0.6)
    for axes in rows:
        tidy(axes)
        axes.margins(x=0.01)
    figure.legend(loc="outside upper center", ncols=columns, frameon=False, fontsize=9)
    figure.align_ylabels(rows)
    return as_png(figure)


def run_over_time(findings: Findings, run: RunFinding) -> bytes:
    """Output measured, before and after; the residuals with the noise band; the varying inputs on thin strips.

    Of a held-out run also the band of the averaged prediction.
    """
    shown = display(findings.output_unit, findings.output_name)
    figure, rows = run_panels(run.time, run.inputs, findings.output_name, shown)
    output, residual = rows[:2]
    output.plot(*extremes(run.time, shown.of(run.measured)), **THICK, label="measured")
    for name, values, colour in _models(findings, run):
        output.plot(*extremes(run.time, shown.of(values)), color=colour, linewidth=1.2, label=name)
        residual.plot(*extremes(run.time, shown.of(run.measured - values)), color=colour, linewidth=0.9)
    if run.role == "held-out" and run.average is not None:
        draw_band(output, run.time, shown.of(run.average.reading), shown.of(run.average.half_width))
    band = 2.0 * shown.of(findings.noise_sigma)
    residual.axhspan(-band, band, color=NOISE, zorder=0, label="noise, ± 2 σ")
    return panels_done(figure, rows, 5)


def run_hysteresis(findings: Findings, run: RunFinding) -> bytes | None:
    """Output, and the martensite fraction, against the wire's temperature; None for a model without a temperature."""
    if "temperature" not in run.states:
        return None
    shown = display(findings.output_unit, findings.output_name)
    thin = _thinned(len(run.time))
    temperature = run.states["temperature"][thin]
    fraction = run.states.get("martensite_fraction")
    figure = new_figure(4.7, width=4.6)
    heights = [2.2] if fraction is None else [2.2, 1.0]
    rows = figure.subplots(len(heights), 1, sharex=True, squeeze=False, height_ratios=heights)[:, 0]
    rows[0].plot(temperature, shown.of(run.measured[thin]), color=MEASURED, linewidth=2.2, alpha=0.55, label="measured")
    rows[0].plot(
        temperature, shown.of(run.after[thin]), color=AFTER, linewidth=1.2, label=_models(findings, run)[-1][0]
    )
    rows[0].set_ylabel(axis_label(findings.output_name, shown), fontsize=9)
    figure.legend(loc="outside upper center", ncols=2, frameon=False, fontsize=9)
    if fraction is not None:
        rows[1].plot(temperature, fraction[thin], color="#6a4c93", linewidth=1.2)
        rows[1].set_ylim(-0.05, 1.05)
        rows[1].set_ylabel("martensite\nfraction", fontsize=9)
    rows[-1].set_xlabel("wire temperature of the model (°C)", fontsize=9)
    for axes in rows:
        tidy(axes)
    return as_png(figure)


def errors_by_run(findings: Findings) -> bytes:
    """Bars of each run's rms error before and after beside the noise; held-out runs are hatched and say so."""
    shown = display(findings.output_unit, findings.output_name)
    runs = findings.runs
    single = nothing_added(findings)
    figure = new_figure(0.9 + 0.42 * max(len(runs), 2), NARROW)
    axes = figure.subplots()
    places = np.arange(len(runs))[::-1]
    for row, run in zip(places, runs, strict=True):
        hatch = "////" if run.role == "held-out" else None
        bars = [(run.rmse_after, AFTER, 0.0)]
        if not single:
            bars = [(run.rmse_before, BEFORE, 0.2), (run.rmse_after, AFTER, -0.2)]
        for value, colour, shift in bars:
            axes.barh(row + shift, shown.of(value), 0.36, color=colour, hatch=hatch, edgecolor="white", linewidth=0.0)
    names = [f"{_short(run.name)}\n(held out)" if run.role == "held-out" else _short(run.name) for run in runs]
    axes.set_yticks(places, [literal(name) for name in names])
    for name, colour in [("base model", AFTER)] if single else [("before", BEFORE), ("after", AFTER)]:
        axes.barh(0.0, np.nan, color=colour, label=name)
    axes.axvline(shown.of(findings.noise_sigma), color=MEASURED, linestyle="--", linewidth=1.0, label="noise")
    axes.set_xlabel(f"rms error ({shown.unit})" if shown.unit else "rms error", fontsize=9)
    axes.set_xlim(left=0.0)
    axes.set_ylim(-0.6, len(runs) - 0.4)
    figure.legend(loc="outside upper center", ncols=3, frameon=False, fontsize=9)
    tidy(axes)
    axes.grid(False, axis="y")
    return as_png(figure)


def held_out_bands(findings: Findings) -> bytes | None:
    """The first held-out runs, measured, by the average of the likely models, and its 90 % band; None without any."""
    runs = [run for run in findings.runs if run.role == "held-out" and run.average is not None][:BANDS]
    if not runs:
        return None
    shown = display(findings.output_unit, findings.output_name)
    figure = new_figure(0.9 + 1.75 * len(runs), NARROW)
    for axes, run in zip(figure.subplots(len(runs), 1, squeeze=False)[:, 0], runs, strict=True):
        average = run.average
        assert average is not None
        draw_predicted(axes, run.time, shown.of(run.measured), shown.of(average.reading))
        draw_band(axes, run.time, shown.of(average.reading), shown.of(average.half_width))
        axes.set_title(f"{literal(_short(run.name))} (held out)", fontsize=9, loc="left")
        axes.set_ylabel(axis_label(findings.output_name, shown), fontsize=9)
        axes.margins(x=0.01)
        tidy(axes)
    axes.set_xlabel("time (s)", fontsize=9)
    figure.legend(*axes.get_legend_handles_labels(), loc="outside upper center", ncols=3, frameon=False, fontsize=9)
    return as_png(figure)


def _short(name: str, width: int = 26) -> str:
    return name if len(name) <= width else name[: width - 1] + "…"


def effect_probabilities(findings: Findings) -> bytes | None:
    """Posterior probability of each effect that has any, the likeliest first; None where no effect was in a fitted set."""
    shown = [
        (effect, probability(effect))
        for effect in ranked(findings.effects)
        if effect.added or probability(effect) >= LEAST_PROBABILITY
    ]
    if not any(np.isfinite(value) for _, value in shown):
        return None
    figure = new_figure(1.2 + 0.32 * max(len(shown), 3), NARROW)
    axes = figure.subplots()
    places = np.arange(len(shown))[::-1]
    axes.barh(
        places, [value for _, value in shown], 0.62, color=[AFTER if effect.added else QUIET for effect, _ in shown]
    )
    axes.set_yticks(places, [label(effect.name) for effect, _ in shown])
    for tick, (effect, _) in zip(axes.get_yticklabels(), shown, strict=True):
        tick.set_fontweight("bold" if effect.added else "normal")
    for name, colour in (("added", AFTER), ("not added", QUIET)):
        axes.barh(0.0, np.nan, color=colour, label=name)
    axes.set_xlabel("posterior probability", fontsize=9)
    axes.set_xlim(0.0, 1.0)
    axes.set_ylim(-0.6, len(shown) - 0.4)
    figure.legend(loc="outside upper center", ncols=2, frameon=False, fontsize=9)
    tidy(axes)
    axes.grid(False, axis="y")
    return as_png(figure)


def probability(effect: EffectFinding) -> float:
    """Posterior probability of an effect; NaN where it was in no fitted set."""
    return effect.evidence.get("posterior_probability", float("nan"))


def ranked(effects: Sequence[EffectFinding]) -> list[EffectFinding]:
    """The added effects first, then by posterior probability; those that were in no fitted set last."""
    return sorted(effects, key=lambda effect: (not effect.added, -float(np.nan_to_num(probability(effect), nan=-1.0))))


def residual_by_phase(findings: Findings) -> bytes | None:
    """By phase of the wire: where the squared error sits beside where the samples are, and the rms error itself."""
    diagnostics = [("before", findings.residual_before, BEFORE, 0.2), ("after", findings.residual_after, AFTER, -0.2)]
    if nothing_added(findings):
        diagnostics = [("base model", findings.residual_after, AFTER, 0.0)]
    phases = list(dict.fromkeys(phase for _, residual, _, _ in diagnostics for phase in residual.by_phase))
    if not phases:
        return None
    shown = display(findings.output_unit, findings.output_name)
    figure = new_figure(0.95 + 0.42 * max(len(phases), 2))
    share, error = figure.subplots(1, 2, sharey=True)
    places = np.arange(len(phases))[::-1]

    def column(residual: ResidualDiagnostics, key: str) -> np.ndarray:
        return np.array([residual.by_phase.get(phase, {}).get(key, np.nan) for phase in phases], dtype=float)

    for name, residual, colour, shift in diagnostics:
        share.barh(places + shift, 100.0 * column(residual, "share_of_squared_error"), 0.36, color=colour, label=name)
        error.barh(places + shift, shown.of(1.0) * column(residual, "rmse"), 0.36, color=colour)
    # A tick on each bar: the phases, and so the samples in one, are each model's own.
    for _, residual, _, shift in diagnostics:
        samples = column(residual, "samples")
        whole = np.nansum(samples)
        if whole > 0.0:
            share.plot(100.0 * samples / whole, places + shift, "|", color=MEASURED, markersize=11)
    share.plot([], [], "|", color=MEASURED, markersize=11, label="share of the samples")
    error.axvline(shown.of(findings.noise_sigma), color=MEASURED, linestyle="--", linewidth=1.0, label="noise")
    share.set_yticks(places, [literal(phase) for phase in phases])
    share.set_xlabel("share of the squared error (%)", fontsize=9)
    error.set_xlabel(f"rms error ({shown.unit})" if shown.unit else "rms error", fontsize=9)
    figure.legend(loc="outside upper center", ncols=4, frameon=False, fontsize=9)
    for axes in (share, error):
        axes.set_xlim(left=0.0)
        tidy(axes)
        axes.grid(False, axis="y")
    return as_png(figure)


def autocorrelation(series: Sequence[np.ndarray], lags: int) -> np.ndarray:
    """Autocorrelation of several series about zero, pooled; shape (lags + 1,), 1 at lag 0.

    About zero and not about the mean, because a lasting offset is as much an error as any other.
    """
    clean = [np.nan_to_num(np.asarray(values, dtype=float)) for values in series]
    power = sum(float(values @ values) for values in clean)
    if power == 0.0:
        return np.full(lags + 1, np.nan)
    return np.array([sum(float(v[: len(v) - k] @ v[k:]) for v in clean if k < len(v)) for k in range(lags + 1)]) / power


def residual_correlation(findings: Findings) -> bytes | None:
    """Autocorrelation of the fit runs' residuals before and after, with the 95 % band of white noise."""
    runs = [run for run in findings.runs if run.role == "fit" and len(run.time) > 8]
    if not runs:
        return None
    lags = min(200, min(len(run.time) for run in runs) // 4)
    step = float(np.median(np.diff(runs[0].time)))
    figure = new_figure(2.6)
    axes = figure.subplots()
    band = 1.96 / np.sqrt(sum(len(run.time) for run in runs))
    axes.axhspan(-band, band, color=NOISE, zorder=0, label="95 % of white noise")
    axes.axhline(0.0, color=QUIET, linewidth=0.6)
    for index, (name, _, colour) in enumerate(_models(findings, runs[0])):
        models = [run.after if index or nothing_added(findings) else run.before for run in runs]
        curve = autocorrelation([run.measured - model for run, model in zip(runs, models, strict=True)], lags)
        axes.plot(step * np.arange(1, lags + 1), curve[1:], color=colour, linewidth=1.4, label=name)
    axes.set_xlabel("lag (s)", fontsize=9)
    axes.set_ylabel("autocorrelation\nof the residual", fontsize=9)
    figure.legend(loc="outside upper center", ncols=3, frameon=False, fontsize=9)
    tidy(axes)
    return as_png(figure)
