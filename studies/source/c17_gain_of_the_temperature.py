"""C17: approach II with the gain K_1 swept (Fig. 4.22)."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from matplotlib.axes import Axes

from smajax.core.parameters import set_parameters

from .backstepping_runs import ON_ITS_PLANT, degrees, draw_sweep, draw_voltages, plant, runs
from .row import Result, Row
from .unprinted import backstepping

GAINS = (0.2, 0.3, 3.0, 20.0, 150.0, 400.0)  # 1/s
TARGET, SECONDS = 0.0, 100.0
WINDOW = (16.0, 20.0)  # s: the last fifth of a run of the other rows of this section


def judged(numbers: Mapping[str, float]) -> bool:
    """Over the length of this section's runs, 20 s: the error of a small K_1 stays, a large K_1 alternates, and neither is so between them."""
    small, middle, large = GAINS[:2], GAINS[2:5], GAINS[5]
    checked = min(numbers[f"hanging_K1_{gain:g}_deg"] for gain in small) > 3.0
    checked &= max(numbers[f"hanging_K1_{gain:g}_deg"] for gain in middle) < 0.5
    checked &= numbers[f"changes_K1_{large:g}"] > 20
    return checked and max(numbers[f"changes_K1_{gain:g}"] for gain in middle[:2]) <= 2


def work(fast: bool) -> Result:
    """One batch over K_1."""
    system = plant()
    tuned = backstepping(system)
    swept = [set_parameters(tuned, {"temperature_gain": gain}) for gain in GAINS]
    loops, _ = runs([system] * len(GAINS), swept, [TARGET] * len(GAINS), fast, SECONDS)
    angle, time = degrees(loops) - TARGET, loops.run.time[0]
    early, late = (time > WINDOW[0]) & (time <= WINDOW[1]), time > 0.9 * SECONDS
    hanging, offset = (np.abs(angle[:, at]).mean(axis=1) for at in (early, late))
    at_30 = angle[:, np.searchsorted(time, 30.0)]
    wanders = angle[5, time > WINDOW[0]] + TARGET
    heated = loops.voltage > 0.5
    changes = (heated[:, 1:] != heated[:, :-1])[:, early[1:]].sum(axis=1)
    names = [f"K_1 = {gain:g} 1/s" for gain in GAINS]

    def below(axes: Axes) -> None:
        draw_voltages(loops, names)(axes)
        axes.set_xlim(4.0, 4.5)
        axes.figure.axes[0].set_xlim(0.0, 60.0)
        axes.set_title("half a second of it", fontsize=9.5, loc="left")

    numbers = {
        **{f"offset_K1_{k:g}_deg": float(o) for k, o in zip(GAINS, offset, strict=True)},
        "wanders_low_K1_400_deg": float(wanders.min()),
        "wanders_high_K1_400_deg": float(wanders.max()),
        **{f"hanging_K1_{k:g}_deg": float(o) for k, o in zip(GAINS, hanging, strict=True)},
        **{f"changes_K1_{k:g}": float(c) for k, c in zip(GAINS, changes, strict=True)},
    }
    return Result(
        holds=judged(numbers),
        found=f"with a small K_1, {GAINS[0]:g} and {GAINS[1]:g} 1/s, the wire does not cool enough, and the arm is {hanging[0]:.1f}° and {hanging[1]:.1f}° off from "
        f"{WINDOW[0]:.0f} to {WINDOW[1]:.0f} s; from {GAINS[2]:g} to {GAINS[4]:g} 1/s it is {hanging[2:5].max():.2f}° off at most; a large K_1 alternates: "
        f"with {GAINS[5]:g} 1/s heating goes on and off {changes[5]} times in those 4 s, and the arm wanders between {wanders.min():.0f}° and {wanders.max():.0f}° to the end",
        numbers=numbers,
        draw=lambda figure: draw_sweep(figure, loops, names, TARGET, below),
        caveat=f"{ON_ITS_PLANT}. Judged over {WINDOW[1]:.0f} s, the length of this section's runs. With the model known exactly the error of a small K_1 is a transient, the "
        f"overshoot that stays while the wire cools through its hysteresis: {at_30[0]:.1f}° and {at_30[1]:.1f}° after 30 s, {offset[0]:.2f}° and {offset[1]:.2f}° over the last 10 s of {SECONDS:.0f}. Heating and cooling alternate where K_1 "
        "passes 2/T_s = 200 1/s for the sample time of 0.01 s; what is off there is this large K_1.",
    )


ROW = Row(
    "C17",
    "Fig. 4.22",
    "arm, approach II, gain K_1 swept",
    "large K_1 makes heating and cooling alternate, small K_1 leaves a large steady error",
    work,
)
