"""C14: backstepping through the stress, approach I, implemented and simulated (sec. 4.8.1)."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from smajax.core.parameters import set_parameters
from smajax.report.drawing import keyed, named, panels

from .backstepping_runs import ON_ITS_PLANT, degrees, plant, runs, shades
from .row import Result, Row
from .unprinted import backstepping_by_stress

TARGETS = (-40.0, -20.0, 0.0, 20.0, 40.0, 60.0)


def work(fast: bool) -> Result:
    """Six set points with one pair of gains; then one of them with the gain at which the measured rate runs away."""
    system = plant()
    tuned = backstepping_by_stress(system)
    slack = set_parameters(tuned, {"stress_gain": 5.0})
    wanted = set_parameters(slack, {"measured_rate_share": 0.0})
    lanes = [*((tuned, target) for target in TARGETS), (slack, 40.0), (wanted, 40.0)]
    loops, merits = runs([system] * len(lanes), [one for one, _ in lanes], [at for _, at in lanes], fast)
    angle, count = degrees(loops), len(TARGETS)
    settling = merits.settling_time[:count]
    overshoot = np.degrees(merits.overshoot)
    error = np.degrees(merits.steady_error[:count])

    def draw(figure: Figure) -> None:
        left, right, volts, stress = panels(figure, 2, 2)
        time = loops.run.time[0]
        for k, colour in enumerate(shades(count)):
            left.plot(time, angle[k], color=colour, label=f"{TARGETS[k]:.0f}°")
            volts.plot(time, loops.voltage[k], color=colour)
            stress.plot(time, loops.run.stress[k] / 1e6, color=colour)
        right.plot(time, angle[count], label="rate of the stress as measured")
        right.plot(time, angle[count + 1], label="rate that is wanted")
        keyed(left)
        keyed(right)
        named(left, "time (s)", "arm angle (°)")
        named(right, "time (s)", "arm angle (°)", "40°, k_1 = 5 1/s")
        named(volts, "time (s)", "voltage (V)")
        named(stress, "time (s)", "stress (MPa)")

    return Result(
        holds=bool(np.isfinite(settling).all() and error.max() < 0.5 and np.isinf(loops.failed_at).all()),
        found=f"the arm settles at every set point from {TARGETS[0]:.0f}° to {TARGETS[-1]:.0f}°, in {settling.min():.1f} to "
        f"{settling.max():.1f} s, with {overshoot[:count].max():.1f}° of overshoot and {error.max():.3f}° of steady error at most",
        numbers={
            "slowest_settling_s": float(settling.max()),
            "largest_overshoot_deg": float(overshoot[:count].max()),
            "largest_steady_error_deg": float(error.max()),
            "overshoot_40_measured_rate_deg": float(overshoot[count]),
            "overshoot_40_wanted_rate_deg": float(overshoot[count + 1]),
        },
        draw=draw,
        caveat=f"{ON_ITS_PLANT}. The stress's rate, as the source asks, is a difference of two samples; it enters eq. 4.67 with "
        f"a weight near one, and at k_1 = 5 1/s this runs away past the angle of greatest stress ({overshoot[count]:.0f}° of overshoot "
        f"at 40°; with the rate that is wanted in its place {overshoot[count + 1]:.0f}°). No gains are printed: k_1 and K by search.",
    )


ROW = Row(
    "C14",
    "sec. 4.8.1",
    "arm, backstepping through the stress (approach I)",
    "approach I implemented and simulated: the arm settles at the set point",
    work,
)
