"""Maps of a sweep: one scale of colours for all controllers, and the number of each cell in it."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
from matplotlib.collections import QuadMesh
from matplotlib.figure import Figure

from smajax.control.position_unit import DEGREES
from smajax.report.sweep_pictures import MAPPED, SHOWN, common_limits, draw_maps

RATIOS = np.geomspace(0.5, 2.0, 5)


def a_sweep(least: float) -> Any:
    """Figures of 5 x 5 plants, two set points and one gain; in one corner no loop settles."""
    merits = {name: np.full((5, 5, 2, 1), least) + np.arange(25.0).reshape(5, 5, 1, 1) for name in SHOWN}
    merits["settling_time"][4, 4] = np.inf
    return SimpleNamespace(merits=SimpleNamespace(**merits))


def test_maps_have_one_scale_and_their_numbers() -> None:
    grid: Any = SimpleNamespace(
        ratios=RATIOS,
        gains=np.ones(1),
        plants=SimpleNamespace(unit=DEGREES),
        first="convection",
        second="damping",
        numbered=False,
    )
    sweeps = [a_sweep(1.0), a_sweep(100.0)]
    limits = common_limits(grid, sweeps)
    assert limits["settling_time"] == (1.0, 123.0)  # the 124 of the corner is none: it never settles
    for sweep in sweeps:
        figure = Figure(figsize=(10.0, 7.6))
        draw_maps(figure, grid, sweep, limits)
        maps = [one for axes in figure.axes for one in axes.collections if isinstance(one, QuadMesh) and axes.texts]
        assert [one.get_clim() for one in maps] == [limits[name] for name in MAPPED]
        numbers = [text.get_text() for text in figure.axes[0].texts]
        assert len(numbers) == 24
        assert numbers[0] == f"{float(sweep.merits.settling_time[0, 0, 0, 0]):.2g}".replace("1e+02", "100")
