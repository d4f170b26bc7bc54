"""C18: approach II that believes in a wrong inertia (Fig. 4.23)."""

from __future__ import annotations

from collections.abc import Mapping

import jax
import numpy as np

from smajax.core.parameters import set_parameters

from .backstepping_runs import ON_ITS_PLANT, SECONDS, draw_sweep, draw_voltages, plant, runs
from .row import Result, Row
from .unprinted import backstepping

RATIOS = (0.5, 0.7, 0.85, 1.0, 1.4, 2.0)
BESIDE = (0.9, 1.1)  # of the inertia, and of the damping, which claim C19 finds strong
LITTLE = 0.25  # of the effect of the damping
IN_PROPORTION = 0.1  # of the settling time: a tenth of inertia shifts it by no more than a tenth
TARGET = 20.0


def judged(numbers: Mapping[str, float]) -> bool:
    """Settles with any inertia, shifts far less than with the damping, and in proportion at most."""
    checked = max(numbers[f"settling_{ratio:g}_I_s"] for ratio in RATIOS) < SECONDS
    for what, unit in (("overshoot", "deg"), ("settling", "s")):
        inertia, damping = (numbers[f"{what}_shift_by_10_percent_of_{name}_{unit}"] for name in ("inertia", "damping"))
        checked &= inertia < LITTLE * damping
    share = numbers["settling_shift_by_10_percent_of_inertia_s"] / numbers["settling_1_I_s"]
    return checked and share < IN_PROPORTION and numbers["overshoot_shift_by_10_percent_of_inertia_deg"] < 1.0


def work(fast: bool) -> Result:
    """One batch over the inertia believed in; its effect is compared with that of a damping with the same error."""
    system = plant()
    tuned = backstepping(system)
    swept = [set_parameters(tuned, {"inertia_ratio": ratio}) for ratio in RATIOS]
    damping = float(system.load.damping)
    swept += [set_parameters(tuned, {"inertia_ratio": ratio}) for ratio in BESIDE]
    swept += [set_parameters(tuned, {"damping": ratio * damping}) for ratio in BESIDE]
    loops, merits = runs([system] * len(swept), swept, [TARGET] * len(swept), fast)
    count = len(RATIOS)
    overshoot, settling = np.degrees(merits.overshoot), merits.settling_time
    error = np.degrees(merits.steady_error)[:count]
    # Largest shift by 10 % either way: of the overshoot (deg), of the settling time (s, `never` as the whole run).
    settled = np.minimum(settling, SECONDS)
    overshoot_shift, settling_shift = (
        np.abs(values[count:] - values[3]).reshape(2, -1).max(axis=1) for values in (overshoot, settled)
    )
    overshoot, settling = overshoot[:count], settling[:count]
    shown = jax.tree.map(lambda series: series[:count], loops)
    names = [f"{ratio:g} I" for ratio in RATIOS]
    numbers = {
        **{f"settling_{r:g}_I_s": float(min(s, 2.0 * SECONDS)) for r, s in zip(RATIOS, settling, strict=True)},
        **{f"overshoot_{r:g}_I_deg": float(o) for r, o in zip(RATIOS, overshoot, strict=True)},
        **{
            f"{what}_shift_by_10_percent_of_{name}_{unit}": float(value)
            for what, unit, pair in (("overshoot", "deg", overshoot_shift), ("settling", "s", settling_shift))
            for name, value in zip(("inertia", "damping"), pair, strict=True)
        },
        "largest_steady_error_deg": float(error.max()),
    }
    return Result(
        holds=judged(numbers),
        found=f"10 % of inertia shift the overshoot by {overshoot_shift[0]:.2f}° and the settling time by {settling_shift[0]:.2f} s, 10 % of damping (C19) by "
        f"{overshoot_shift[1]:.1f}° and {settling_shift[1]:.1f} s: with half to twice the inertia the arm settles in {settling.min():.1f} to {settling.max():.1f} s ({settling[3]:.1f} s with the "
        f"true one), the overshoot is {overshoot.min():.1f}° to {overshoot.max():.1f}°, the steady error {error.max():.2f}° at most",
        numbers=numbers,
        draw=lambda figure: draw_sweep(figure, shown, names, TARGET, draw_voltages(shown, names)),
        caveat=f"{ON_ITS_PLANT}. Gains: those of C15 and C17 to C21, one set (studies/unprinted); with "
        "those searched for settling the overshoot is about the degree that counts as there, and the settling time jumps where it passes that degree. "
        f"Little means less than {100 * LITTLE:.0f} % of what the damping does, and a settling time that shifts by less than {100 * IN_PROPORTION:.0f} % for 10 % of inertia; a run that never settles counts with its {SECONDS:.0f} s. The source prints no values of inertia.",
    )


ROW = Row(
    "C18",
    "Fig. 4.23",
    "arm, approach II, the controller's inertia wrong",
    "little effect",
    work,
)
