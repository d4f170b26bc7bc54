"""M2: the arm at 7.2 V stops inside the transformation range (Fig. 3.4)."""

from __future__ import annotations

import numpy as np

from smajax.model.rigs import arm

from .rigs import austenite_range
from .row import Result, Row
from .voltage_step import draw_step, stepped


def work(fast: bool) -> Result:
    """30 s at 7.2 V."""
    run = stepped(7.2, fast)
    start, finish = austenite_range(arm(), run.stress)
    early = float(np.abs(run.martensite_fraction[run.temperature < start] - 1.0).max())
    inside = bool(start[-1] < run.temperature[-1] < finish[-1])
    settled = float(np.ptp(run.temperature[run.time > 25.0]))
    xi = float(run.martensite_fraction[-1])
    return Result(
        holds=early == 0.0 and inside and settled < 0.05 and 0.1 < xi < 0.9,
        found=f"xi = 1 as long as T < A_s'; steady T = {run.temperature[-1]:.2f} °C lies between A_s' = {start[-1]:.2f} "
        f"and A_f' = {finish[-1]:.2f} °C; xi ends at {xi:.2f}, the arm at {np.degrees(run.position[-1]):.1f}°",
        numbers={
            "fraction_lost_below_range": early,
            "end_temperature_C": float(run.temperature[-1]),
            "end_austenite_start_C": float(start[-1]),
            "end_austenite_finish_C": float(finish[-1]),
            "end_fraction": xi,
        },
        draw=lambda figure: draw_step(figure, run),
        caveat="the amplifier gain (2 on V²/R of one metre), the arm's length and the spring's lever are chosen here.",
    )


ROW = Row(
    "M2",
    "Fig. 3.4",
    "arm, 7.2 V step",
    "no transformation before T passes A_s'; steady T between A_s' and A_f'; partial transformation",
    work,
)
