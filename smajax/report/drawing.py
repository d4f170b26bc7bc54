"""Shared look of the figures: axes with units, one colour a law."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence
from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure

LAW_COLOURS = {"tanaka": "#8a8f98", "liang": "#c8553d", "brinson": "#d9a441", "enhanced": "#1f6fb2"}
# Laws often agree: the one drawn first is the widest, so that every one is seen.
LAW_STYLES = {"tanaka": ":", "liang": "-", "brinson": "--", "enhanced": "-"}
BLUE, RED, GREEN, GREY, BLACK = "#1f6fb2", "#c8553d", "#3f8f5b", "#9aa0a8", "#1d1d1f"


UPRIGHT = 4.6  # inches: a figure as narrow as this is for a telephone
PANEL, LEAST = 2.5, 3.4  # inches: height of a panel of an upright figure, and of a figure with one
ACROSS, UP = 40, 28  # characters in a line of a label there
FEW = 3  # entries of a key beyond which it has two columns there


def panels(figure: Figure, rows: int, columns: int = 1, share: bool = False) -> list[Axes]:
    """Axes in reading order, in one style; `share` ties the horizontal axes. In an upright figure one below the other."""
    figure.set_layout_engine("constrained")
    if is_upright(figure):
        rows, columns = rows * columns, 1
        figure.set_figheight(max(LEAST, PANEL * rows))
    return styled(*figure.subplots(rows, columns, sharex=share, squeeze=False).flat)


def is_upright(figure: Figure) -> bool:
    """Whether it is for a telephone."""
    return bool(figure.get_figwidth() <= UPRIGHT)


def _in_upright(axes: Axes) -> bool:
    return isinstance(axes.figure, Figure) and is_upright(axes.figure)


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
    if _in_upright(axes):
        horizontal, title = (textwrap.fill(text, ACROSS) for text in (horizontal, title))
        vertical = textwrap.fill(vertical, UP)
    axes.set_xlabel(horizontal, fontsize=9)
    axes.set_ylabel(vertical, fontsize=9)
    if title:
        axes.set_title(title, fontsize=9.5, loc="left")


def keyed(axes: Axes, entries: Sequence[str] | None = None) -> None:
    """A legend without a frame."""
    count = len(entries) if entries else len(axes.get_legend_handles_labels()[1])
    columns = 2 if _in_upright(axes) and count > FEW else 1
    look: Any = {"frameon": False, "fontsize": 8, "ncols": columns}
    if columns > 1 and not axes.get_title(loc="left"):
        look |= {"loc": "lower left", "bbox_to_anchor": (0.0, 1.0)}  # above the panel, which has no room inside
    axes.legend(entries, **look) if entries else axes.legend(**look)
