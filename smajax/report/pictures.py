"""The report's pictures, each a function from the record to a PNG.

Figures are made through matplotlib's object interface: no backend is chosen and no state is shared, so a program that
plots on its own is not disturbed.
"""

from __future__ import annotations

import io
from collections.abc import Mapping, Sequence
from types import MappingProxyType

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from smajax.attribution.findings import EffectFinding, Findings, ResidualDiagnostics, RunFinding
from smajax.core.display_units import axis_label, display, label

MEASURED, BEFORE, AFTER, NOISE, QUIET = "#1d1d1f", "#c8553d", "#1f6fb2", "#d9dce1", "#9aa0a8"
WIDTH = 6.6  # inches; with the text size below still readable on a telephone
NARROW = 4.2  # for pictures of one simple panel: as wide as a telephone, where text must not shrink
DPI = 150
HYSTERESIS = 110  # dots an inch: a report has one for each run
SAMPLES_DRAWN = 3000  # per curve: more than the pixels across
LEAST_PROBABILITY = 0.01  # of an effect that is drawn


def as_png(
    figure: Figure, dpi: int = DPI, texts: Mapping[str, str | None] = MappingProxyType({"Software": None})
) -> bytes:
    """texts: what the file says of itself, by keyword; None leaves one out."""
    stream = io.BytesIO()
    figure.savefig(stream, format="png", dpi=dpi, facecolor="white", metadata=dict(texts))
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


def nothing_added(findings: Findings) -> bool:
    """Whether the model after is the model before."""
    return not any(effect.added for effect in findings.effects)


def run_hysteresis(findings: Findings, run: RunFinding, dpi: int = HYSTERESIS) -> bytes | None:
    """Output, and the martensite fraction, against the wire's temperature; None for a model without a temperature."""
    if "temperature" not in run.states:
        return None
    shown = display(findings.output_unit, findings.output_name)
    thin = _thinned(len(run.time))
    temperature = run.states["temperature"][thin]
    fraction = run.states.get("martensite_fraction")
    figure = new_figure(4.4, NARROW)
    heights = [2.2] if fraction is None else [2.2, 1.0]
    rows = figure.subplots(len(heights), 1, sharex=True, squeeze=False, height_ratios=heights)[:, 0]
    rows[0].plot(temperature, shown.of(run.measured[thin]), color=MEASURED, linewidth=2.2, alpha=0.55, label="measured")
    name = "base model" if nothing_added(findings) else "after: extended model"
    rows[0].plot(temperature, shown.of(run.after[thin]), color=AFTER, linewidth=1.2, label=name)
    rows[0].set_ylabel(axis_label(findings.output_name, shown), fontsize=9)
    figure.legend(loc="outside upper center", ncols=2, frameon=False, fontsize=9)
    if fraction is not None:
        rows[1].plot(temperature, fraction[thin], color="#6a4c93", linewidth=1.2)
        rows[1].set_ylim(-0.05, 1.05)
        rows[1].set_ylabel("martensite\nfraction", fontsize=9)
    rows[-1].set_xlabel("wire temperature of the model (°C)", fontsize=9)
    for axes in rows:
        tidy(axes)
    return as_png(figure, dpi)


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
    axes.xaxis.set_major_locator(MaxNLocator(5))
    axes.set_ylim(-0.6, len(runs) - 0.4)
    figure.legend(loc="outside upper center", ncols=3, frameon=False, fontsize=9)
    tidy(axes)
    axes.grid(False, axis="y")
    return as_png(figure)


def _short(name: str, width: int = 26) -> str:
    return name if len(name) <= width else name[: width - 1] + "…"


def effect_probabilities(findings: Findings) -> bytes | None:
    """Posterior probability of each effect that has any, the likeliest first; None where no effect was in a fitted set."""
    shown = [
        (effect, effect.probability)
        for effect in ranked(findings.effects)
        if effect.added or effect.probability >= LEAST_PROBABILITY
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


def ranked(effects: Sequence[EffectFinding]) -> list[EffectFinding]:
    """The added effects first, then by posterior probability; those that were in no fitted set last."""
    return sorted(effects, key=lambda effect: (not effect.added, -float(np.nan_to_num(effect.probability, nan=-1.0))))


def residual_by_phase(findings: Findings, upright: bool = False) -> bytes | None:
    """By phase of the wire: where the squared error sits beside where the samples are, and the rms error itself; upright: below."""
    diagnostics = [("before", findings.residual_before, BEFORE, 0.2), ("after", findings.residual_after, AFTER, -0.2)]
    if nothing_added(findings):
        diagnostics = [("base model", findings.residual_after, AFTER, 0.0)]
    phases = list(dict.fromkeys(phase for _, residual, _, _ in diagnostics for phase in residual.by_phase))
    if not phases:
        return None
    shown = display(findings.output_unit, findings.output_name)
    height = 0.95 + 0.42 * max(len(phases), 2)
    figure = new_figure(2.0 * height, NARROW) if upright else new_figure(height)
    share, error = figure.subplots(*((2, 1) if upright else (1, 2)), sharey=True)
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
    figure.legend(loc="outside upper center", ncols=2 if upright else 4, frameon=False, fontsize=9)
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
