"""C8: temperature control while the arm passes its greatest stress takes the overshoot away (Fig. 4.13)."""

from __future__ import annotations

from collections.abc import Iterable

from matplotlib.figure import Figure

from smajax.control.presets import printed_filter, temperature_vsc, vsc3_of_section_4_6
from smajax.model.rigs import arm
from smajax.report.drawing import keyed, panels

from .rigs import Recorded
from .row import Result, Row
from .set_points import (
    PERIOD,
    SECONDS,
    SET_POINTS,
    Runs,
    at_set_points,
    draw_angles,
    largest_finish_rate,
    measures,
    nvsc_without_temperature,
    overshoot,
    regulated,
    steady,
    time_of,
)

SAME = 0.5  # degrees: steady errors within this are the same


def work(fast: bool) -> Result:
    """VSC and NVSC at eight set points; NVSC also without temperature control, and with the printed filter's states."""
    system = arm()
    nvsc = temperature_vsc(system)
    before, after = regulated(vsc3_of_section_4_6, fast), regulated(temperature_vsc, fast)
    damped = regulated(nvsc_without_temperature, fast)
    filtered = at_set_points(nvsc, fast, estimator=printed_filter(system))
    numbers = measures(before, "vsc_") | measures(after, "nvsc_")
    numbers |= measures(damped, "nvsc_without_K_p_") | measures(filtered, "nvsc_with_filter_")
    old, new, bare, estimated = (_judged(runs) for runs in (before, after, damped, filtered))
    numbers["largest_rate_of_the_finish_C_per_s"] = largest_finish_rate(after)
    later = {angle: time_of(new[angle].reach_time) - time_of(old[angle].reach_time) for angle in SET_POINTS}
    slower = {angle: time_of(new[angle].settling_time) - time_of(old[angle].settling_time) for angle in SET_POINTS}
    farther = {angle: steady(new[angle]) - steady(old[angle]) for angle in SET_POINTS}
    less = all(overshoot(new[angle]) < overshoot(old[angle]) for angle in SET_POINTS)
    arrives = all(value < 1.5 * PERIOD for value in later.values())
    settles = all(value < 1.5 * PERIOD for value in slower.values())
    same = all(abs(value) < SAME for value in farther.values())
    parts = {"less_overshoot": less, "no_later_reach": arrives, "no_later_settling": settles, "same_steady_error": same}
    numbers |= {name: float(part) for name, part in parts.items()}
    late = [angle for angle in SET_POINTS if slower[angle] >= 1.5 * PERIOD]
    apart = [angle for angle in SET_POINTS if abs(farther[angle]) >= SAME]
    never = [angle for angle in SET_POINTS if time_of(estimated[angle].settling_time) > SECONDS]
    return Result(
        holds=all(parts.values()),
        found=f"at {SET_POINTS[0]:g} to {SET_POINTS[-1]:g}° the overshoot falls from {_span(map(overshoot, old.values()))}° under VSC to "
        f"{max(map(overshoot, new.values())):.1f}° at most under NVSC; but the arm first arrives {_span(later.values(), 2)} s later than under VSC, and settles "
        f"later at {_list(late)} (by up to {max(slower.values()):.1f} s); the steady error is {_span(map(steady, new.values()))}° instead of "
        f"{_span(map(steady, old.values()))}°"
        + (f", not the same at {_list(apart)}, by {_span((farther[angle] for angle in apart), 1)}°" if apart else ""),
        numbers=numbers,
        draw=lambda figure: _draw(
            figure, {"VSC": before, "NVSC": after, "NVSC, K_p = 0": damped, "NVSC, printed filter's states": filtered}
        ),
        caveat="less overshoot holds, no slower does not: VSC arrives first because it is on its way to overshoot, and where it hardly overshoots there is no "
        "time to win back; the steady error differs where VSC has not settled after 10 s. Told the true state. A_f' changes by "
        f"{numbers['largest_rate_of_the_finish_C_per_s']:.0f} °C/s at most and the band is {float(nvsc.temperature_band):g} °C/s (by search). Part of the work is "
        "damping: inside the band the command falls with the speed, whatever the temperature, and with K_p = 0 the overshoot is "
        f"{max(map(overshoot, bare.values())):.1f}° at most. What the temperature term adds to that is the earlier arrival, at 50° after "
        f"{time_of(new[50.0].reach_time):.2f} instead of {time_of(bare[50.0].reach_time):.2f} s. On the printed filter's states (no noise) NVSC overshoots by "
        f"{', '.join(f'{overshoot(estimated[angle]):.1f}' for angle in SET_POINTS)}° at {', '.join(f'{angle:g}' for angle in SET_POINTS)}°, never settles at {_list(never)}, and has "
        f"{max(map(steady, estimated.values())):.1f}° of steady error at most. VSC has the quick gains of C9: with those of C4 it overshoots by less than a degree, and "
        "nothing is left to mend. Gains of both chosen here.",
    )


def _judged(runs: Runs) -> dict[float, Recorded]:
    return {angle: one for angle, (_, one) in runs.items()}


def _span(values: Iterable[float], digits: int = 1) -> str:
    """`least to most`."""
    several = list(values)
    return f"{min(several):.{digits}f} to {max(several):.{digits}f}"


def _list(angles: list[float]) -> str:
    return ", ".join(f"{angle:g}°" for angle in angles) or "none"


def _draw(figure: Figure, several: dict[str, Runs]) -> None:
    every = panels(figure, 2, 2, share=True)
    for axes, (name, runs) in zip(every, several.items(), strict=True):
        draw_angles(axes, runs)
        axes.set_title(name, fontsize=9.5, loc="left")
        axes.set_xlim(0.0, 6.0)
        axes.set_ylim(-48.0, 95.0)
    keyed(every[0])


ROW = Row(
    "C8",
    "Fig. 4.13",
    "arm, NVSC (temperature based) and VSC",
    "less overshoot at each desired angle, no slower, same steady error",
    work,
)
