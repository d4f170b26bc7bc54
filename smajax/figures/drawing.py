"""Shared look of the figures: axes with units, one colour a law."""

from __future__ import annotations

from collections.abc import Sequence

from matplotlib.axes import Axes
from matplotlib.figure import Figure

LAW_COLOURS = {"tanaka": "#8a8f98", "liang": "#c8553d", "brinson": "#d9a441", "enhanced": "#1f6fb2"}
# Laws often agree: the one drawn first is the widest, so that every one is seen.
LAW_STYLES = {"tanaka": ":", "liang": "-", "brinson": "--", "enhanced": "-"}
BLUE, RED, GREEN, GREY, BLACK = "#1f6fb2", "#c8553d", "#3f8f5b", "#9aa0a8", "#1d1d1f"


def panels(figure: Figure, rows: int, columns: int = 1, share: bool = False) -> list[Axes]:
    """Axes in reading order, in one style; `share` ties the horizontal axes."""
    figure.set_layout_engine("constrained")
    return styled(*figure.subplots(rows, columns, sharex=share, squeeze=False).flat)


def styled(*several: Axes) -> list[Axes]:
    """The same axes in the one style."""
    for axes in several:
        axes.spines[["top", "right"]].set_visible(False)
        axes.tick_params(labelsize=9)
        axes.grid(True, color="#eceef1", linewidth=0.7)
        axes.set_axisbelow(True)
    return list(several)


def named(axes: Axes, horizontal: str, vertical: str, title: str = "") -> None:
    """Labels with units, and a small title."""
    axes.set_xlabel(horizontal, fontsize=9)
    axes.set_ylabel(vertical, fontsize=9)
    if title:
        axes.set_title(title, fontsize=9.5, loc="left")


def keyed(axes: Axes, entries: Sequence[str] | None = None) -> None:
    """A legend without a frame."""
    axes.legend(entries, frameon=False, fontsize=8) if entries else axes.legend(frameon=False, fontsize=8)
