"""C4: a switch chatters, a layer ends the chatter, a surface with velocity ends the overshoot (Fig. 4.6, 4.7)."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from matplotlib.figure import Figure

from smajax.control.figures_of_merit import BAND_DEGREES
from smajax.control.presets import vsc1, vsc2
from smajax.report.drawing import BLUE, GREEN, GREY, RED, keyed, named, panels

from .rigs import Recorded
from .row import Result, Row
from .set_points import overshoot, regulated, steady, time_of
from .unprinted import LAYER, switch_on_a_surface, switch_with_a_layer

COLOURS = {"VSC1": RED, "VSC2": BLUE, "VSC3": GREEN}
PRINTED = {"VSC2": 8.0, "VSC3": 3.0}  # s, settling
LATE = 8.5  # s: from here on every controller has done what it does, VSC2 within the printed 8 s


def full_switches(loop: Recorded) -> float:
    """Times a second that the command goes from one end of 4 ... 10 V to the other, after `LATE`."""
    volts = loop.voltage[loop.run.time > LATE]
    at_end = volts[(volts < 4.01) | (volts > 9.99)] > 7.0
    return float((at_end[1:] != at_end[:-1]).sum()) / float(loop.run.time[-1] - LATE)


def swing(loop: Recorded) -> tuple[float, float]:
    """Range of the angle (deg) and of the rate (deg/s) after `LATE`: the size of what is left in the phase plane."""
    late = loop.run.time > LATE
    return float(np.degrees(np.ptp(loop.run.position[late]))), float(np.degrees(np.ptp(loop.run.velocity[late])))


def comes_to_rest(time: np.ndarray, degrees: np.ndarray) -> float:
    """Seconds after which the arm stays within a degree of where it ends (mean of the last fifth)."""
    off = np.abs(degrees - degrees[time > 0.8 * time[-1]].mean())
    outside = np.flatnonzero(off > BAND_DEGREES)
    return float(time[outside[-1]]) if outside.size else 0.0


def judged(numbers: Mapping[str, float]) -> bool:
    """VSC1 chatters, the others rest; VSC2 overshoots and is slow to rest; VSC3 settles at its set point, far nearer to it.

    "There is still an overshoot problem leading to slow settling of the arm (8 sec) due to cooling"; with VSC3 "the steady
    state error is greatly reduced" (sec. 4.4.4): VSC2 ends off its set point, so that its 8 s are those until it rests.
    """
    chatters = numbers["VSC1_full_switches_per_s"] > 2.0 and numbers["VSC1_late_rate_swing_deg_per_s"] > 1.0
    rests = all(numbers[f"{name}_full_switches_per_s"] == 0.0 for name in ("VSC2", "VSC3"))
    rests &= numbers["VSC2_late_rate_swing_deg_per_s"] < 0.1 * numbers["VSC1_late_rate_swing_deg_per_s"]
    second, third = numbers["VSC2_comes_to_rest_s"], numbers["VSC3_settling_s"]
    holds = chatters and rests and numbers["VSC2_overshoot_deg"] > 5.0 and second > 1.5 * third
    holds &= abs(second / PRINTED["VSC2"] - 1.0) < 0.25 and abs(third / PRINTED["VSC3"] - 1.0) < 0.25
    holds &= numbers["VSC3_overshoot_deg"] < 0.2 and numbers["VSC3_steady_error_deg"] < 0.25
    return holds and numbers["VSC3_steady_error_deg"] < 0.25 * numbers["VSC2_steady_error_deg"]


def work(fast: bool) -> Result:
    """Three controllers at 0 degrees."""
    three = (("VSC1", vsc1), ("VSC2", switch_with_a_layer), ("VSC3", switch_on_a_surface))
    runs = {name: regulated(one, fast)[0.0] for name, one in three}
    numbers: dict[str, float] = {}
    for name, (loop, one) in runs.items():
        angle, rate = swing(loop)
        numbers |= {
            f"{name}_full_switches_per_s": full_switches(loop),
            f"{name}_late_swing_deg": angle,
            f"{name}_late_rate_swing_deg_per_s": rate,
            f"{name}_settling_s": time_of(one.settling_time),
            f"{name}_comes_to_rest_s": comes_to_rest(loop.run.time, np.degrees(loop.run.position)),
            f"{name}_overshoot_deg": overshoot(one),
            f"{name}_steady_error_deg": steady(one),
        }
    continuous = regulated(vsc2, fast)[0.0][1]
    numbers["VSC2_continuous_settling_s"] = time_of(continuous.settling_time)
    numbers["VSC2_least_voltage_V"] = float(runs["VSC2"][0].voltage.min())
    second, third = numbers["VSC2_comes_to_rest_s"], numbers["VSC3_settling_s"]
    return Result(
        holds=judged(numbers),
        found=f"VSC1 still switches {numbers['VSC1_full_switches_per_s']:.0f} times a second between 4 and 10 V after {LATE:g} s, on a cycle of "
        f"{numbers['VSC1_late_swing_deg']:.2f}° by {numbers['VSC1_late_rate_swing_deg_per_s']:.0f}°/s; VSC2 overshoots by "
        f"{numbers['VSC2_overshoot_deg']:.0f}° and comes to rest after {second:.1f} s, "
        f"{numbers['VSC2_steady_error_deg']:.1f}° off; VSC3 settles in {third:.1f} s with {numbers['VSC3_overshoot_deg']:.2f}° of "
        f"overshoot and {numbers['VSC3_steady_error_deg']:.2f}° of steady error",
        numbers=numbers,
        draw=lambda figure: _draw(figure, {name: loop for name, (loop, _) in runs.items()}),
        caveat=f"VSC2 has u = K s inside its layer as eq. 4.5 prints it. Neither phi nor K is printed: the layer is VSC3's, {LAYER['boundary']:.3f} rad of the angle at rest (phi / lambda), and K = {LAYER['layer_gain']:.0f} V/rad meets V_high at its edge, so that nothing is chosen for the 8 s "
        f"(of the layers of 35 surfaces that meet C4 and C5, 23 rest within a quarter of 8 s: studies/unprinted). The printed equation has no lower limit inside the layer: VSC2 commands K s there, down to {numbers['VSC2_least_voltage_V']:g} V, where "
        f"V_low is 4 V. It rests {numbers['VSC2_steady_error_deg']:.1f}° off its set point and never settles within a degree of it, so that the 8 s are judged as those until it rests. With a continuous layer it settles in {numbers['VSC2_continuous_settling_s']:.1f} s at most. "
        "VSC3 has the continuous layer: with the printed one it either switches between the ends at rest or is more than 0.25° off. "
        "Its slope, layer and filter of the velocity are one set for C4, C5 and C7 (studies/unprinted).",
    )


def _draw(figure: Figure, loops: dict[str, Recorded]) -> None:
    volts, plane, angle, close = panels(figure, 2, 2)
    for name, loop in loops.items():
        colour = COLOURS[name]
        degrees, rate = np.degrees(loop.run.position), np.degrees(loop.run.velocity)
        volts.plot(loop.run.time, loop.voltage, color=colour, linewidth=0.8)
        angle.plot(loop.run.time, degrees, color=colour, label=name)
        plane.plot(degrees, rate, color=colour, linewidth=0.9)
        late = loop.run.time > LATE
        close.plot(degrees[late], rate[late], color=colour, linewidth=0.9, marker=".", markersize=3)
    angle.axhline(0.0, color=GREY, linewidth=0.7)
    named(volts, "time (s)", "voltage (V)")
    named(angle, "time (s)", "arm angle (°)")
    named(plane, "arm angle (°)", "rate (°/s)", "phase plane")
    named(close, "arm angle (°)", "rate (°/s)", f"phase plane after {LATE:g} s")
    keyed(angle)


ROW = Row(
    "C4",
    "Fig. 4.6, 4.7",
    "arm, VSC1, VSC2, VSC3 at 0°, 10 V and 4 V",
    "VSC1 keeps a limit cycle (chatter); VSC2 has none, overshoots, settles in about 8 s; VSC3 in about 3 s, no overshoot, small steady error",
    work,
)
