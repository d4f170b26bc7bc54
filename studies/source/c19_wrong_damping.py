"""C19: approach II that believes in a wrong damping (Fig. 4.24)."""

from __future__ import annotations

import itertools

import jax
import numpy as np

from smajax.core.parameters import set_parameters

from .backstepping_runs import ON_ITS_PLANT, draw_sweep, draw_voltages, plant, runs
from .row import Result, Row
from .unprinted import backstepping

PAIRS = tuple(itertools.product((1.0, 1.67, 4.0, 8.0, 15.0), (1.0, 5.0, 20.0, 99.3)))  # (K, K_1), 1/s; the preset's too
RATIOS = (0.8, 0.9, 0.95, 1.0, 1.05, 1.1)
TARGET = 20.0


def work(fast: bool) -> Result:
    """One batch over the damping believed in, and over pairs of gains with 10 % too little and too much of it."""
    system = plant()
    tuned = backstepping(system)
    damping, inertia = float(system.load.damping), float(system.load.inertia({}))
    swept = [set_parameters(tuned, {"damping": ratio * damping}) for ratio in RATIOS]
    swept += [
        set_parameters(tuned, {"damping_gain": gain, "temperature_gain": other, "damping": ratio * damping})
        for gain, other in PAIRS
        for ratio in (0.9, 1.1)
    ]
    loops, merits = runs([system] * len(swept), swept, [TARGET] * len(swept), fast)
    overshoot, reach, count = np.degrees(merits.overshoot), merits.reach_time, len(RATIOS)
    low, high = overshoot[count:].reshape(-1, 2).T
    reach_low, reach_high = reach[count:].reshape(-1, 2).T
    sooner = int((reach_low < reach_high).sum())
    turned = [pair for pair, less, more in zip(PAIRS, low, high, strict=True) if less > more]
    shown = jax.tree.map(lambda series: series[:count], loops)
    shift = 0.1 * damping / inertia
    names = [f"{ratio:g} c" for ratio in RATIOS]
    strong = bool(overshoot[5] > 10.0 + overshoot[3] and reach[1] > 1.5 * reach[3])
    undamped_when_low = bool(overshoot[1] > overshoot[3] > overshoot[5])
    return Result(
        holds=strong and undamped_when_low,
        found=f"10 % of damping changes the run from {overshoot[3]:.1f}° of overshoot and {reach[3]:.1f} s of reach to {overshoot[5]:.0f}° and "
        f"{reach[5]:.1f} s when too high, and to {overshoot[1]:.1f}° and {reach[1]:.1f} s when too low: strong, but the other way round than claimed",
        numbers={
            **{f"overshoot_{r:g}_c_deg": float(o) for r, o in zip(RATIOS, overshoot, strict=False)},
            **{f"reach_{r:g}_c_s": float(min(t, 99.0)) for r, t in zip(RATIOS, reach, strict=False)},
            "pairs_of_gains": float(len(PAIRS)),
            "pairs_as_claimed": float(len(turned)),
            "pairs_sooner_when_too_low": float(sooner),
            "least_overshoot_1.1_c_less_0.9_c_deg": float((high - low).min()),
            "strong_effect": float(strong),
            "undamped_when_too_low": float(undamped_when_low),
        },
        draw=lambda figure: draw_sweep(figure, shown, names, TARGET, draw_voltages(shown, names)),
        caveat=f"{ON_ITS_PLANT}. The direction contradicts the source, and follows from its own equations: with c_b instead of c, "
        f"eq. 4.70 in eq. 4.55 gives x_1'' + [K + (c - c_b)/I] x_1' + x_1 = 0, so too small a c_b damps more. Here c/I = {damping / inertia:.0f} 1/s: "
        f"10 % are worth {shift:.1f} 1/s of K. Of {len(PAIRS)} pairs of K from "
        f"{PAIRS[0][0]:g} to {PAIRS[-1][0]:g} and K_1 from {PAIRS[0][1]:g} to {PAIRS[-1][1]:g} 1/s {len(turned)} overshoot more with 0.9 c than with 1.1 c, and {sooner} arrive sooner"
        + (f": {', '.join(f'({k:g}, {k1:g})' for k, k1 in turned)}." if turned else "."),
    )


ROW = Row(
    "C19",
    "Fig. 4.24",
    "arm, approach II, the controller's damping wrong",
    "strong effect: too low acts undamped, too high acts overdamped",
    work,
)
