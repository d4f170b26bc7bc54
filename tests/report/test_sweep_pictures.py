"""Maps of a sweep: one scale of colours for all controllers, and the number of each cell in it."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from matplotlib.collections import QuadMesh
from matplotlib.figure import Figure

from smajax.control.position_unit import DEGREES
from smajax.report.sweep_numbers import MAPPED, SHOWN, map_numbers
from smajax.report.sweep_page import perturbed_sentence
from smajax.report.sweep_pictures import common_limits, draw_comparison, draw_maps

RATIOS = np.geomspace(0.5, 2.0, 5)


def a_sweep(least: float) -> Any:
    """Figures of 5 x 5 plants, two set points and one gain; in one corner no loop settles."""
    merits = {name: np.full((5, 5, 2, 1), least) + np.arange(25.0).reshape(5, 5, 1, 1) for name in SHOWN}
    merits["settling_time"][4, 4] = np.inf
    merits["settling_time"][0, 1, 1] = np.inf  # at one of two set points: no worst case
    merits["overshoot"][..., 1, :] += 2.0
    beyond = np.zeros((5, 5, 2))
    beyond[0, 0, 1] = np.inf  # out of reach: not counted
    least_times = SimpleNamespace(grid=beyond)
    return SimpleNamespace(merits=SimpleNamespace(**merits), least=least_times, own_least=least_times)


GRID: Any = SimpleNamespace(
    ratios=RATIOS,
    gains=np.ones(1),
    plants=SimpleNamespace(unit=DEGREES),
    first="inertia",
    second="ambient",
    numbered=False,
)


def test_the_worst_case_is_of_the_set_points_in_reach_beside_their_median() -> None:
    numbers = map_numbers(GRID, a_sweep(1.0))
    degree = 180.0 / np.pi
    assert numbers["overshoot"]["median"][1][0] == pytest.approx(7.0 * degree, rel=1e-3)
    assert numbers["overshoot"]["worst"][1][0] == pytest.approx(8.0 * degree, rel=1e-3)
    assert numbers["overshoot"]["worst"][0][0] == pytest.approx(1.0 * degree, rel=1e-3)
    assert (numbers["settling_time"]["worst"][0][1], numbers["settling_time"]["median"][4][4]) == (None, None)


def test_it_is_said_within_what_time_half_of_the_loops_settle_and_most() -> None:
    sweep = a_sweep(1.0)
    sweep.distance_at = lambda at, least: None
    grid: Any = SimpleNamespace(**{**vars(GRID), "mismatches": ("inertia", "ambient")})
    # 47 of 50: two each at 1 to 24 s, but for one at 2 s.
    assert "(half of these within 13 s, nine tenths within 22 s)" in perturbed_sentence(grid, sweep)
    sweep.merits.settling_time[:] = np.inf
    assert "half of these" not in perturbed_sentence(grid, sweep)


def test_the_legend_of_the_least_time_covers_no_line() -> None:
    """It stood inside, over the line of a controller that is slow at large set points."""
    figure = Figure(figsize=(10.0, 14.0), layout="constrained")
    merits = {name: np.asarray([1.0, 2.0, 3.0]) for name in SHOWN}
    sweep: Any = SimpleNamespace(
        name="pid", nominal=SimpleNamespace(**merits), least=SimpleNamespace(nominal=np.asarray([0.8, 0.9, 1.0]))
    )
    draw_comparison(figure, np.radians([-20.0, 20.0, 60.0]), [sweep])
    figure.canvas.draw()
    keys = [(axes, legend) for axes in figure.axes if (legend := axes.get_legend()) is not None]
    assert len(keys) == 2
    for axes, legend in keys:
        assert legend.get_window_extent().y0 >= axes.get_window_extent().y1 - 1.0


def test_axes_say_plant_over_model_and_an_error_of_the_ambient_in_kelvins() -> None:
    figure = Figure(figsize=(10.0, 14.0))
    draw_maps(figure, GRID, a_sweep(1.0), air=20.0)
    axes = figure.axes[0]
    assert axes.get_xlabel() == "moment of inertia, plant over model"
    assert axes.get_ylabel() == "ambient temperature, plant minus model (K)"
    figure.canvas.draw()
    assert [text.get_text() for text in axes.get_xticklabels()] == ["0.5", "0.7", "1", "1.4", "2"]
    assert [text.get_text() for text in axes.get_yticklabels()] == ["-10", "-6", "0", "+8", "+20"]
    titles = [one.get_title(loc="left") for one in figure.axes if one.get_title(loc="left")]
    assert titles[:2] == ["settling time, median", "settling time, worst"]


def test_maps_have_one_scale_and_their_numbers() -> None:
    grid = GRID
    sweeps = [a_sweep(1.0), a_sweep(100.0)]
    limits = common_limits(grid, sweeps)
    assert limits["settling_time"] == (1.0, 123.0)  # the 124 of the corner is none: it never settles
    assert limits["overshoot"][1] == pytest.approx(126.0 * 180.0 / np.pi)  # of the worst case
    for sweep in sweeps:
        figure = Figure(figsize=(10.0, 7.6))
        draw_maps(figure, grid, sweep, limits)
        maps = [one for axes in figure.axes for one in axes.collections if isinstance(one, QuadMesh) and axes.texts]
        assert [one.get_clim() for one in maps] == [limits[name] for name in MAPPED for _ in range(2)]
        numbers = [text.get_text() for text in figure.axes[0].texts]
        assert len(numbers) == 23  # of 25: in one no loop settles, in another half of them
        assert numbers[0] == f"{float(sweep.merits.settling_time[0, 0, 0, 0]):.2g}".replace("1e+02", "100")
