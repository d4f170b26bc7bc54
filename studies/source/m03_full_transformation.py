"""M3: the arm at 7.3 V passes the angle of greatest stress and transforms to the end (Fig. 3.5, 3.6)."""

from __future__ import annotations

import numpy as np

from smajax.model.rigs import arm

from .rigs import austenite_range
from .row import Result, Row
from .voltage_step import draw_step, stepped


def work(fast: bool) -> Result:
    """30 s at 7.3 V."""
    run = stepped(7.3, fast)
    _, finish = austenite_range(arm(), run.stress)
    top = int(np.argmax(run.stress))
    passed = float(run.temperature[-1] - finish[-1])
    fallen = float(finish[top] - finish[-1])
    xi = float(run.martensite_fraction[-1])
    return Result(
        holds=xi == 0.0 and 0 < top < len(finish) - 1 and fallen > 0.0 and passed > 0.0,
        found=f"xi ends at {xi:.0f}; the stress is greatest at {np.degrees(run.position[top]):.1f}°, beyond it A_f' falls "
        f"by {fallen:.1f} °C and T ends {passed:.1f} °C above it; the arm ends at {np.degrees(run.position[-1]):.1f}°",
        numbers={
            "end_fraction": xi,
            "angle_of_greatest_stress_deg": float(np.degrees(run.position[top])),
            "fall_of_austenite_finish_C": fallen,
            "end_temperature_above_finish_C": passed,
        },
        draw=lambda figure: draw_step(figure, run),
        caveat="rate form of the constitutive law; under the integrated form the arm goes on to its end stop.",
    )


ROW = Row(
    "M3",
    "Fig. 3.5, 3.6",
    "arm, 7.3 V step",
    "full transformation: past the angle of maximum stress the transformation temperatures fall, T passes A_f'",
    work,
)
