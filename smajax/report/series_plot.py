"""Series over a common axis, as a plot that zooms, pans and shows values: what it holds, thinned to what a page has room for."""

from __future__ import annotations

import base64
import json
import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from markupsafe import Markup

POINTS = 1600  # samples of a plot: more than the pixels across
LEAST_POINTS = 160
NUMBERS = 60_000  # of all plots of a page; a number takes 2.7 bytes
TOOLS, KEY, AXIS = 30, 24, 52  # px: heights of what stands around the panels


@dataclass(frozen=True)
class Line:
    """A curve: its name in the key, values (n,) in the unit shown, and its colour by the name that look.css has it under."""

    name: str
    values: np.ndarray
    colour: str
    width: float = 1.3
    alpha: float = 1.0
    dash: bool = False
    silent: bool = False  # not in the key


def set_point_line(values: np.ndarray, silent: bool = False) -> Line:
    """Where the load is to be, dashed. silent: as of `Line`."""
    return Line("set point", values, "asked", 1.0, dash=True, silent=silent)


@dataclass(frozen=True)
class Band:
    """What lies between two curves (n,), in the unit shown."""

    name: str
    low: np.ndarray
    high: np.ndarray
    colour: str
    alpha: float = 0.25
    silent: bool = False


@dataclass(frozen=True)
class Panel:
    """Curves on one vertical axis. label: what is shown, with its unit; height: px."""

    name: str
    unit: str
    lines: tuple[Line, ...]
    bands: tuple[Band, ...] = ()
    height: int = 190
    range: tuple[float, float] | None = None

    @property
    def label(self) -> str:
        return f"{self.name} ({self.unit})" if self.unit else self.name

    @property
    def columns(self) -> list[np.ndarray]:
        return [one.values for one in self.lines] + [side for one in self.bands for side in (one.low, one.high)]


@dataclass(frozen=True)
class SeriesPlot:
    """Panels over one axis (n,), which rises. about: in words; spans: parts of the axis on tinted ground."""

    about: str
    at: np.ndarray
    panels: tuple[Panel, ...]
    axis: tuple[str, str] = ("time", "s")
    spans: tuple[tuple[float, float], ...] = ()

    @property
    def columns(self) -> list[np.ndarray]:
        """Every series of it."""
        return [one for panel in self.panels for one in panel.columns]

    @property
    def axis_label(self) -> str:
        return f"{self.axis[0]} ({self.axis[1]})" if self.axis[1] else self.axis[0]


def room(columns: int) -> int:
    """Samples that each of so many series on a page may have."""
    return int(np.clip(NUMBERS // max(columns, 1), LEAST_POINTS, POINTS))


def samples_of(plots: Iterable[SeriesPlot]) -> int:
    """Samples that each series of the plots of a page may have."""
    return room(sum(len(plot.columns) for plot in plots))


def kept_samples(columns: Sequence[np.ndarray], most: int = POINTS) -> np.ndarray:
    """Indices, rising, at most `most` and a few, of samples (n,) that hold every extreme of every column.

    The samples are cut into buckets, of each of which the least and the largest of each column stay, and its first; samples at equal distances fill the room that is left. A short series stays whole. A
    missing number is neither least nor largest; a bucket of none stays missing by its first.
    """
    count = len(columns[0])
    if count <= most:
        return np.arange(count)
    size = -(-count * (2 * len(columns) + 1) // most)
    whole = count // size * size
    rows = np.arange(0, whole, size)
    picked = [rows, np.asarray([count - 1])]
    if whole < count:
        picked.append(np.arange(whole, count)[:: max(1, (count - whole) // 8)])
    for values in columns:
        for sign in (1.0, -1.0):
            signed = np.where(np.isnan(values), np.inf, sign * values)
            picked.append(rows + signed[:whole].reshape(-1, size).argmin(axis=1))
            if whole < count:
                picked.append(np.asarray([whole + int(signed[whole:].argmin())]))
    extremes = np.unique(np.concatenate(picked))
    # Smooth series have their extremes at the ends of the buckets: what room is left goes to samples in between.
    between = np.linspace(0, count - 1, max(most - len(extremes), 0)).round().astype(int)
    return np.union1d(extremes, between)


def encoded(values: np.ndarray, bits: int = 16) -> dict[str, Any]:
    """Numbers (n,) as whole ones between the least and the largest, in base64; the last of them is a missing number."""
    values = np.where(np.isfinite(values), values, np.nan)
    if np.isnan(values).all():
        return {"low": None, "step": 0.0, "bits": bits, "data": ""}
    low, high = float(np.nanmin(values)), float(np.nanmax(values))
    if low == high and not np.isnan(values).any():
        return {"low": low, "step": 0.0, "bits": bits, "data": ""}
    none = 2**bits - 1
    step = (high - low) / (none - 1)
    whole = np.where(np.isnan(values), none, np.rint((np.nan_to_num(values, nan=low) - low) / (step or 1.0)))
    data = whole.astype("<u4" if bits == 32 else "<u2").tobytes()
    return {"low": low, "step": step, "bits": bits, "data": base64.b64encode(data).decode("ascii")}


def content(plot: SeriesPlot, most: int = POINTS) -> dict[str, Any]:
    """What series.js reads: the thinned columns, the axis first, and of each panel which column is what."""
    kept = kept_samples(plot.columns, most)
    columns = [encoded(plot.at[kept], 32)]

    def column(values: np.ndarray) -> int:
        columns.append(encoded(np.asarray(values, dtype=float)[kept]))
        return len(columns) - 1

    panels = []
    for panel in plot.panels:
        lines = [
            {
                "name": one.name,
                "colour": one.colour,
                "width": one.width,
                "alpha": one.alpha,
                "dash": one.dash,
                "silent": one.silent,
                "column": column(one.values),
            }
            for one in panel.lines
        ]
        bands = [
            {
                "name": one.name,
                "colour": one.colour,
                "alpha": one.alpha,
                "silent": one.silent,
                "low": column(one.low),
                "high": column(one.high),
            }
            for one in panel.bands
        ]
        shown = {"name": panel.name, "unit": panel.unit, "label": panel.label, "height": panel.height}
        panels.append({**shown, "range": panel.range, "lines": lines, "bands": bands})
    return {
        "file": re.sub(r"\W+", "_", plot.about).strip("_") or "plot",
        "length": len(kept),
        "x": {"name": plot.axis[0], "unit": plot.axis[1], "label": plot.axis_label},
        "spans": [list(span) for span in plot.spans],
        "columns": columns,
        "panels": panels,
    }


def moving(plot: SeriesPlot, still: Markup, most: int = POINTS) -> Markup:
    """The plot beside its picture, which stays for print and for readers without scripts."""
    text = json.dumps(content(plot, most), ensure_ascii=False, separators=(",", ":")).replace("<", "\\u003c")
    height = TOOLS + AXIS + sum(panel.height + KEY for panel in plot.panels)
    return Markup(
        '<figure class="series" data-about="{}" data-height="{}"><div class="pictures still">{}</div>'
        '<script type="application/json">{}</script></figure>'
    ).format(plot.about, height, still, Markup(text))
