"""C18: approach II that believes in a wrong inertia (Fig. 4.23)."""

from __future__ import annotations

import numpy as np

from smajax.control_presets import backstepping_two
from smajax.figures.backstepping_runs import ON_ITS_PLANT, draw_sweep, draw_voltages, plant, runs
from smajax.figures.row import Result, Row
from smajax.parameters import set_parameters

RATIOS = (0.5, 0.7, 0.85, 1.0, 1.4, 2.0)
TARGET = 20.0


def work(fast: bool) -> Result:
    """One batch over the inertia believed in."""
    system = plant()
    tuned = backstepping_two(system)
    swept = [set_parameters(tuned, {"inertia_ratio": ratio}) for ratio in RATIOS]
    loops, merits = runs([system] * len(RATIOS), swept, [TARGET] * len(RATIOS), fast)
    overshoot, settling = np.degrees(merits.overshoot), merits.settling_time
    error = np.degrees(merits.steady_error)
    names = [f"{ratio:g} I" for ratio in RATIOS]
    return Result(
        holds=bool(error.max() < 0.5 and overshoot.max() < 5.0 and np.isfinite(settling).all()),
        found=f"with half to twice the inertia the arm settles in {settling.min():.1f} to {settling.max():.1f} s ({settling[3]:.1f} s with the "
        f"true one), the overshoot is {overshoot.min():.1f}° to {overshoot.max():.1f}°, the steady error {error.max():.2f}° at most",
        numbers={
            **{f"settling_{r:g}_I_s": float(s) for r, s in zip(RATIOS, settling, strict=True)},
            **{f"overshoot_{r:g}_I_deg": float(o) for r, o in zip(RATIOS, overshoot, strict=True)},
            "largest_steady_error_deg": float(error.max()),
        },
        draw=lambda figure: draw_sweep(figure, loops, names, TARGET, draw_voltages(loops, names)),
        caveat=f"{ON_ITS_PLANT}. With half the inertia the time to stay within a degree grows to {settling.max():.1f} s all the same: after an "
        "overshoot the wire has to cool through its hysteresis. The source prints no values of inertia.",
    )


ROW = Row(
    "C18",
    "Fig. 4.23",
    "arm, approach II, the controller's inertia wrong",
    "little effect",
    work,
)
