"""C4: a switch chatters, a layer ends the chatter, a surface with velocity ends the overshoot (Fig. 4.6, 4.7)."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from smajax.control.presets import vsc1, vsc2, vsc3
from smajax.report.drawing import BLUE, GREEN, GREY, RED, keyed, named, panels

from .rigs import Recorded
from .row import Result, Row
from .set_points import overshoot, regulated, steady, time_of

COLOURS = {"VSC1": RED, "VSC2": BLUE, "VSC3": GREEN}
PRINTED = {"VSC2": 8.0, "VSC3": 3.0}  # s, settling
LATE = 7.0  # s: from here on every controller has done what it does


def full_switches(loop: Recorded) -> float:
    """Times a second that the command goes from one end of 4 ... 10 V to the other, after `LATE`."""
    volts = loop.voltage[loop.run.time > LATE]
    at_end = volts[(volts < 4.01) | (volts > 9.99)] > 7.0
    return float((at_end[1:] != at_end[:-1]).sum()) / float(loop.run.time[-1] - LATE)


def swing(loop: Recorded) -> tuple[float, float]:
    """Range of the angle (deg) and of the rate (deg/s) after `LATE`: the size of what is left in the phase plane."""
    late = loop.run.time > LATE
    return float(np.degrees(np.ptp(loop.run.position[late]))), float(np.degrees(np.ptp(loop.run.velocity[late])))


def work(fast: bool) -> Result:
    """Three controllers at 0 degrees."""
    runs = {name: regulated(one, fast)[0.0] for name, one in (("VSC1", vsc1), ("VSC2", vsc2), ("VSC3", vsc3))}
    numbers: dict[str, float] = {}
    for name, (loop, one) in runs.items():
        angle, rate = swing(loop)
        numbers |= {
            f"{name}_full_switches_per_s": full_switches(loop),
            f"{name}_late_swing_deg": angle,
            f"{name}_late_rate_swing_deg_per_s": rate,
            f"{name}_settling_s": time_of(one.settling_time),
            f"{name}_overshoot_deg": overshoot(one),
            f"{name}_steady_error_deg": steady(one),
        }
    chatters = numbers["VSC1_full_switches_per_s"] > 2.0 and numbers["VSC1_late_rate_swing_deg_per_s"] > 1.0
    rests = all(numbers[f"{name}_full_switches_per_s"] == 0.0 for name in ("VSC2", "VSC3"))
    rests &= numbers["VSC2_late_rate_swing_deg_per_s"] < 0.1 * numbers["VSC1_late_rate_swing_deg_per_s"]
    second, third = numbers["VSC2_settling_s"], numbers["VSC3_settling_s"]
    holds = chatters and rests and numbers["VSC2_overshoot_deg"] > 5.0 and second > 1.5 * third
    holds &= all(abs(numbers[f"{name}_settling_s"] / printed - 1.0) < 0.25 for name, printed in PRINTED.items())
    holds &= numbers["VSC3_overshoot_deg"] < 0.2
    holds &= numbers["VSC3_steady_error_deg"] < 0.25
    return Result(
        holds=bool(holds),
        found=f"VSC1 still switches {numbers['VSC1_full_switches_per_s']:.0f} times a second between 4 and 10 V after {LATE:.0f} s, on a cycle of "
        f"{numbers['VSC1_late_swing_deg']:.2f}° by {numbers['VSC1_late_rate_swing_deg_per_s']:.0f}°/s; VSC2 comes to rest, but overshoots by "
        f"{numbers['VSC2_overshoot_deg']:.0f}° and settles in {second:.1f} s, {100 * (1 - second / PRINTED['VSC2']):.0f} % sooner than the printed {PRINTED['VSC2']:.0f} s; VSC3 settles in {third:.1f} s with {numbers['VSC3_overshoot_deg']:.2f}° of "
        f"overshoot and {numbers['VSC3_steady_error_deg']:.2f}° of steady error",
        numbers=numbers,
        draw=lambda figure: _draw(figure, {name: loop for name, (loop, _) in runs.items()}),
        caveat=f"not reached: the 8 s of VSC2. Layers and surface are chosen here, VSC3's for the printed 3 s, VSC2's for the printed 8 s: the search over "
        "layers of 0.01 to 1 rad ends on its edge of 0.01, where VSC2 is VSC1 with hardly a layer, and even there it settles in "
        f"{second:.1f} s; VSC1, without any, is within a degree after {numbers['VSC1_settling_s']:.1f} s. The rest of the claim is as printed. The reason: this arm passes 0° after 1.1 s of 10 V and its wire cools with a time constant of 1.4 s (eq. 3.1 and Table 3.1), so that a cycle of overshoot is short. VSC3's command switches while the arm slides; a layer that keeps it still (1.5 rad/s with lambda = 4.9) leaves 1° of steady error.",
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
    named(close, "arm angle (°)", "rate (°/s)", f"phase plane after {LATE:.0f} s")
    keyed(angle)


ROW = Row(
    "C4",
    "Fig. 4.6, 4.7",
    "arm, VSC1, VSC2, VSC3 at 0°, 10 V and 4 V",
    "VSC1 keeps a limit cycle (chatter); VSC2 has none, overshoots, settles in about 8 s; VSC3 in about 3 s, no overshoot, small steady error",
    work,
)
