"""C10: the wider the band of NVSC, the smaller the overshoot (Fig. 4.15)."""

from __future__ import annotations

import itertools
from collections.abc import Mapping

import numpy as np
from matplotlib.figure import Figure

from smajax.control.presets import temperature_vsc
from smajax.model.rigs import arm
from smajax.report.drawing import BLUE, GREY, RED, keyed, named, panels

from .row import Result, Row, State, judgement
from .set_points import (
    Runs,
    largest_finish_rate,
    nvsc_as_printed,
    nvsc_without_temperature,
    overshoot,
    steady,
    swept,
    time_of,
)

BANDS = (0.0, 10.0, 20.0, 25.0, 27.0, 30.0, 40.0, 60.0, 100.0, 200.0, 400.0)  # C/s
SHOWN = (0.0, 25.0, 30.0, 60.0, 400.0)
GONE = 0.1  # degrees: less overshoot than this is none


def judged(numbers: Mapping[str, float]) -> State:
    """Falls with the band and vanishes; as worded it is the temperature control that takes the overshoot away."""
    over = [numbers[f"overshoot_at_{band:g}_C_per_s_deg"] for band in BANDS]
    falls = all(later <= sooner + GONE for sooner, later in itertools.pairwise(over))
    without = numbers[f"overshoot_without_K_p_at_{BANDS[-1]:g}_C_per_s_deg"]
    return judgement(falls and over[-1] < GONE and over[0] > 5.0, without > 5.0)


def work(fast: bool) -> Result:
    """The band swept at 50 degrees, with the temperature control and without it (K_p = 0)."""
    runs = swept(temperature_vsc(arm()), "temperature_band", BANDS, 50.0, fast)
    damped = swept(nvsc_without_temperature(arm()), "temperature_band", BANDS, 50.0, fast)
    over = [overshoot(one) for _, one in runs.values()]
    over_damped = {band: overshoot(one) for band, (_, one) in damped.items()}
    preset = temperature_vsc(arm())
    quickest = largest_finish_rate({band: one for band, one in runs.items() if band >= 100.0})
    numbers = {f"overshoot_at_{band:g}_C_per_s_deg": value for band, value in zip(BANDS, over, strict=True)}
    numbers |= {f"steady_error_at_{band:g}_C_per_s_deg": steady(one) for band, (_, one) in runs.items()}
    first, last = runs[BANDS[0]][1], runs[BANDS[-1]][1]
    numbers |= {"reach_without_band_s": time_of(first.reach_time), "reach_with_widest_s": time_of(last.reach_time)}
    numbers |= {f"overshoot_without_K_p_at_{band:g}_C_per_s_deg": value for band, value in over_damped.items()}
    last_damped = damped[BANDS[-1]][1]
    numbers |= {"reach_with_widest_without_K_p_s": time_of(last_damped.reach_time), "largest_rate_C_per_s": quickest}
    literal = swept(nvsc_as_printed(arm()), "temperature_band", BANDS, 50.0, fast)
    printed = {band: 50.0 - float(np.degrees(loop.run.position[-1])) for band, (loop, _) in literal.items()}
    numbers |= {f"as_printed_short_at_{band:g}_C_per_s_deg": value for band, value in printed.items()}
    gone = next((band for band, value in zip(BANDS, over, strict=True) if value < GONE), np.inf)
    return Result.of(
        judged(numbers),
        in_part="the factor v/v_p, which is added here to eq. 4.37, does the work and not the temperature control: with K_p = 0 the overshoot vanishes as well "
        f"({over_damped[30.0]:.1f}° at 30 °C/s); with eq. 4.37 as printed the arm stops {printed[20.0]:.0f}° short of 50° from 20 °C/s on, and at 10 °C/s "
        f"overshoots by {overshoot(literal[10.0][1]):.0f}° and ends {printed[10.0]:.0f}° short",
        found=f"the overshoot falls from {over[0]:.0f}° without a band over {numbers['overshoot_at_30_C_per_s_deg']:.1f}° at 30 °C/s "
        + (f"to less than {GONE}° from {gone:g} °C/s on" if np.isfinite(gone) else f"to {over[-1]:.1f}°"),
        numbers=numbers,
        draw=lambda figure: _draw(figure, runs, over, list(over_damped.values())),
        caveat=f"the gains of C8 and C9, quicker than those of C4, with which VSC overshoots by less than a degree (C8); the controller gets the true state. Without temperature control (K_p = 0) the overshoot is "
        f"{', '.join(f'{over_damped[band]:.1f}' for band in SHOWN)}° at {', '.join(f'{band:g}' for band in SHOWN)} °C/s, for inside the band the command falls with the "
        f"speed, whatever the temperature. From 100 °C/s on A_f' changes by {quickest:.0f} °C/s at most: a band beyond that does not switch; the preset's is "
        f"{float(preset.temperature_band):g} °C/s (by search). What the temperature term adds is an earlier arrival, at {BANDS[-1]:g} °C/s after "
        f"{time_of(last.reach_time):.2f} instead of {time_of(last_damped.reach_time):.2f} s. The wider band costs time: the arm arrives after {time_of(last.reach_time):.1f} instead of {time_of(first.reach_time):.1f} s.",
    )


def _draw(figure: Figure, runs: Runs, over: list[float], over_damped: list[float]) -> None:
    angle, sizes = panels(figure, 1, 2)
    for shade, band in zip(np.linspace(0.75, 0.0, len(SHOWN)), SHOWN, strict=True):
        loop, _ = runs[band]
        angle.plot(loop.run.time, np.degrees(loop.run.position), color=(shade, shade, 1.0), label=f"{band:g} °C/s")
    angle.axhline(50.0, color=GREY, linewidth=0.8, linestyle=":")
    angle.set_xlim(0.0, 6.0)
    named(angle, "time (s)", "arm angle (°)")
    keyed(angle)
    sizes.plot(BANDS, over, "o-", color=BLUE, label="NVSC")
    sizes.plot(BANDS, over_damped, "x--", color=RED, label="NVSC with K_p = 0")
    keyed(sizes)
    sizes.set_xscale("symlog", linthresh=10.0)
    named(sizes, "band phi_T (°C/s)", "overshoot (°)")


ROW = Row(
    "C10", "Fig. 4.15", "arm, NVSC at 50°, band phi_T swept", "overshoot falls as phi_T grows, and can vanish", work
)
