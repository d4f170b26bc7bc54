"""C16: approach II with the gain K swept (Fig. 4.21)."""

from __future__ import annotations

import itertools
from collections.abc import Mapping

import numpy as np

from smajax.core.parameters import set_parameters

from .backstepping_runs import ON_ITS_PLANT, degrees, draw_sweep, draw_voltages, plant, runs
from .row import Result, Row, State, judgement
from .unprinted import backstepping

GAINS = (0.0, 0.3, 1.0, 1.7, 4.0, 10.0)  # 1/s
TARGET = 0.0


def judged(numbers: Mapping[str, float]) -> State:
    """Small K overshoots, K = 0 keeps swinging, large K is slow; as worded (unstable) the swing at K = 0 grows."""
    over = [numbers[f"overshoot_K_{gain:g}_deg"] for gain in GAINS]
    checked = all(later <= sooner for sooner, later in itertools.pairwise(over)) and over[1] > 10.0
    checked &= numbers["swing_at_K_0_deg"] > 0.95 * over[0] and numbers["settles_at_K_0"] == 0.0
    checked &= max(over[4:]) < 0.1 and numbers["reach_K_4_s"] > 2.0 * numbers["reach_K_1.7_s"]
    checked &= numbers["short_at_K_10_deg"] > 1.0
    return judgement(checked, numbers["swing_at_K_0_deg"] > 1.05 * numbers["early_swing_at_K_0_deg"])


def work(fast: bool) -> Result:
    """One batch over K."""
    system = plant()
    tuned = backstepping(system)
    swept = [set_parameters(tuned, {"damping_gain": gain}) for gain in GAINS]
    loops, merits = runs([system] * len(GAINS), swept, [TARGET] * len(GAINS), fast)
    angle, time = degrees(loops) - TARGET, loops.run.time[0]
    overshoot, settling, reach = np.degrees(merits.overshoot), merits.settling_time, merits.reach_time
    swing = float(np.abs(angle[0][time > 12.0]).max())
    slow = float(angle[-1][-1])
    names = [f"K = {gain:g} 1/s" for gain in GAINS]
    early = float(np.abs(angle[0][(time > 4.0) & (time <= 12.0)]).max())
    numbers = {
        **{f"overshoot_K_{k:g}_deg": float(o) for k, o in zip(GAINS, overshoot, strict=True)},
        "early_swing_at_K_0_deg": early,
        "swing_at_K_0_deg": swing,
        "settles_at_K_0": float(np.isfinite(settling[0])),
        "reach_K_1.7_s": float(reach[3]),
        "reach_K_4_s": float(reach[4]),
        "short_at_K_10_deg": -slow,
    }
    return Result.of(
        judged(numbers),
        in_part=f"near K = 0 the loop keeps swinging and is not unstable: at K = 0 the swing is {early:.1f}° from 4 to 12 s and {swing:.1f}° from 12 to 20 s, no larger than at the start, and "
        f"at K = {GAINS[1]:g} 1/s the overshoot is {overshoot[1]:.0f}°",
        found=f"overshoot {', '.join(f'{o:.1f}°' for o in overshoot[:4])} at K = {', '.join(f'{k:g}' for k in GAINS[:4])} 1/s, none "
        f"above; K = 0 is marginal: the arm still swings by {swing:.0f}° after 12 s; K = {GAINS[4]:g} takes {reach[4]:.1f} s to come within a "
        f"degree instead of {reach[3]:.1f} s, and K = {GAINS[5]:g} is {-slow:.0f}° short after 20 s",
        numbers=numbers,
        draw=lambda figure: draw_sweep(figure, loops, names, TARGET, draw_voltages(loops, names)),
        caveat=f"{ON_ITS_PLANT}. At K = 0 eq. 4.70 asks for x_1'' + x_1 = 0, which can do nothing "
        "else than keep its swing; it does not grow, and every K > 0 damps that equation.",
    )


ROW = Row(
    "C16",
    "Fig. 4.21",
    "arm, approach II, gain K swept",
    "small K overshoots, K near 0 is unstable, large K is slow",
    work,
)
