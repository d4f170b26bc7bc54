"""C20: approach II that believes in a wrong coefficient of convection (Fig. 4.25)."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from smajax.control.controllers.backstepping_two import BacksteppingTwo
from smajax.core.parameters import set_parameters

from .backstepping_runs import ON_ITS_PLANT, degrees, draw_sweep, draw_voltages, plant, runs
from .rigs import Recorded, austenite_range
from .row import Result, Row
from .unprinted import backstepping

RATIOS = (0.9, 0.95, 0.98, 1.0, 1.05, 1.1)
TARGET = 20.0


def judged(numbers: Mapping[str, float]) -> bool:
    """The more h_c is believed in, the further the arm moves; 5 % miss by 5 degrees, and too much heats the wire further."""
    end = np.array([numbers[f"end_{ratio:g}_hc_deg"] for ratio in RATIOS])
    checked = (np.diff(end) > 0.0).all() and abs(end[RATIOS.index(1.0)] - TARGET) < 0.5
    checked &= end[RATIOS.index(0.95)] < TARGET - 5.0 and end[RATIOS.index(1.05)] > TARGET + 5.0
    return bool(checked and numbers["hottest_above_start_1.1_hc_C"] > numbers["hottest_above_start_true_C"] + 0.5)


def believed(tuned: BacksteppingTwo, fast: bool) -> tuple[Recorded, dict[str, float]]:
    """(the runs of one controller over the coefficient believed in, and their numbers)."""
    system = plant()
    true = float(system.wire.heat.convection_coefficient)
    swept = [set_parameters(tuned, {"convection_coefficient": ratio * true}) for ratio in RATIOS]
    loops, merits = runs([system] * len(RATIOS), swept, [TARGET] * len(RATIOS), fast)
    angle, overshoot = degrees(loops), np.degrees(merits.overshoot)
    end, start = angle[:, -1], austenite_range(system, loops.run.stress)[0]
    hottest = (loops.run.temperature - start).max(axis=1)
    return loops, {
        **{f"end_{r:g}_hc_deg": float(e) for r, e in zip(RATIOS, end, strict=True)},
        **{f"overshoot_{r:g}_hc_deg": float(o) for r, o in zip(RATIOS, overshoot, strict=True)},
        "hottest_above_start_true_C": float(hottest[RATIOS.index(1.0)]),
        "hottest_above_start_1.1_hc_C": float(hottest[RATIOS.index(1.1)]),
    }


def work(fast: bool) -> Result:
    """One batch over the coefficient believed in."""
    loops, numbers = believed(backstepping(plant()), fast)
    end = [numbers[f"end_{ratio:g}_hc_deg"] for ratio in RATIOS]
    names = [f"{ratio:g} h_c" for ratio in RATIOS]
    return Result(
        holds=judged(numbers),
        found=f"at a set point of {TARGET:.0f}° the arm ends at {', '.join(f'{e:.1f}°' for e in end)} where the controller has "
        f"{', '.join(f'{r:g}' for r in RATIOS)} of the true h_c; "
        f"at its hottest the wire is {numbers['hottest_above_start_1.1_hc_C']:.1f} °C above A_s' instead of {numbers['hottest_above_start_true_C']:.1f} °C",
        numbers=numbers,
        draw=lambda figure: draw_sweep(figure, loops, names, TARGET, draw_voltages(loops, names)),
        caveat=f"{ON_ITS_PLANT}.",
    )


ROW = Row(
    "C20",
    "Fig. 4.25",
    "arm, approach II, the controller's h_c wrong",
    "too low: moves less than asked; too high: overheats and over-actuates",
    work,
)
