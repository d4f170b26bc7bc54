"""The study's picture: the best cost of every search over the closed loops that it has run."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from smajax.report.pictures import as_png, new_figure, tidy

COLOURS = {
    "trust-region": "#1f6fb2",
    "adam": "#2aa5a0",
    "cma-es": "#c8553d",
    "nelder-mead": "#d9a441",
    "grid": "#8a8f98",
}
COLUMNS = 2


def draw(results: Mapping[str, Any]) -> bytes:
    """A panel a problem, a line a search; a fifth of the loops marked."""
    courses: dict[str, list[tuple[str, np.ndarray, int]]] = {}
    for name, result in results["peers"].items():
        problem, way, _ = name.split("; ")
        courses.setdefault(problem, []).append((way, np.asarray(result["course"], dtype=float), result["closed_loops"]))
    rows = -(-len(courses) // COLUMNS)
    figure = new_figure(3.0 * rows + 0.4, width=10.0)
    panels = figure.subplots(rows, COLUMNS, squeeze=False).ravel()
    for axes, (problem, several) in zip(panels, courses.items(), strict=False):
        most = max(loops for *_, loops in several)
        for way, course, loops in several:
            finite = course[np.isfinite(course[:, 1])]
            if not len(finite):
                continue
            over = np.append(finite[:, 0], loops)
            axes.step(over, np.append(finite[:, 1], finite[-1, 1]), where="post", color=COLOURS[way], linewidth=1.3)
        axes.axvline(most / 5.0, color="#1d1d1f", linewidth=0.8, linestyle=":")
        axes.set(xscale="log", yscale="log")
        lowest = min(course[:, 1].min() for _, course, _ in several)
        highest = max(course[0, 1] for _, course, _ in several)
        ticks = [tick for tick in (1, 2, 3, 5, 7, 10, 15, 20, 30, 50, 100, 200, 300) if lowest < tick < highest]
        axes.set_yticks(ticks, [f"{tick:g}" for tick in ticks])
        axes.minorticks_off()
        axes.set_title(problem, fontsize=9, loc="left")
        axes.set_xlabel("closed loops run", fontsize=8.5)
        axes.set_ylabel("best cost so far", fontsize=8.5)
        tidy(axes)
    for axes in panels[len(courses) :]:
        axes.axis("off")
    handles = [panels[0].plot([], [], color=colour, label=way)[0] for way, colour in COLOURS.items()]
    handles.append(panels[0].plot([], [], color="#1d1d1f", linestyle=":", label="a fifth of the loops")[0])
    figure.legend(handles=handles, loc="outside lower center", ncols=len(handles), frameon=False, fontsize=8.5)
    return as_png(figure)
