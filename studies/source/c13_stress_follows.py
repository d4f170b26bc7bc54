"""C13: stress-based sliding control at 45 degrees: the stress follows the stress wanted (Fig. 4.19)."""

from __future__ import annotations

import jax
import numpy as np
from matplotlib.figure import Figure

from smajax.control.presets import printed_filter
from smajax.model.rigs import arm
from smajax.report.drawing import BLUE, GREY, RED, keyed, named, panels

from .row import Result, Row
from .set_points import at_set_points
from .unprinted import sliding

TARGET = 45.0
AFTER = 2.5  # s: the arm has arrived


def work(fast: bool) -> Result:
    """One run; the stress wanted is computed again from the controller's inputs. Beside it, one on the filter."""
    system = arm()
    tuned = sliding(system)
    one, judged = at_set_points(tuned, fast, [TARGET])[TARGET]
    filtered, _ = at_set_points(tuned, fast, [TARGET], printed_filter(system))[TARGET]
    estimated = float(np.sqrt(np.mean((filtered.measured.stress - filtered.run.stress) ** 2)) / 1e6)
    end_filtered = float(np.degrees(filtered.run.position[-1]))
    wanted = np.asarray(jax.vmap(tuned.stress_wanted)(one.measured, one.wanted)) / 1e6
    stress, time = one.run.stress / 1e6, one.run.time
    reach = float(judged.reach_time)
    transforming = one.run.martensite_fraction < 0.999
    off = np.abs(stress - wanted)
    moving = transforming & (time < reach)
    free = moving & (one.voltage > 0.0) & (one.voltage < float(tuned.largest_voltage))
    typical, able = (float(np.sqrt(np.mean(off[at] ** 2))) for at in (moving, free))
    largest = float(off[moving].max())
    late = float(np.abs(stress - wanted)[time > AFTER].max())
    span = float(stress.max() - stress[0])
    angle = np.degrees(one.run.position)

    def draw(figure: Figure) -> None:
        top, middle, low = panels(figure, 3, 1, share=True)
        top.plot(time, wanted, color=RED, linestyle="--", label="wanted")
        top.plot(time, stress, color=BLUE, label="wire")
        keyed(top)
        middle.plot(time, angle, color=BLUE)
        middle.axhline(TARGET, color=GREY, linewidth=0.8, linestyle="--")
        low.step(time, one.voltage, where="post", color=BLUE)
        low.set_xlim(0.0, 6.0)
        named(top, "", "stress (MPa)")
        named(middle, "", "arm angle (°)")
        named(low, "time (s)", "voltage (V)")

    return Result(
        holds=able < 0.1 * span
        and typical < 0.2 * span
        and late < 0.02 * span
        and max(abs(angle[-1] - TARGET), abs(end_filtered - TARGET)) < 0.5,
        found=f"from the start of the transformation until the arm arrives ({reach:.1f} s) the stress is {typical:.1f} MPa (root mean square) off "
        f"the stress wanted, and {able:.1f} MPa while the voltage is inside its limits, of a rise of {span:.0f} MPa; after {AFTER:g} s it is "
        f"{late:.2f} MPa off at most, and the arm ends at {angle[-1]:.2f}°; on the printed filter's stress, which is "
        f"{estimated:.1f} MPa off the true one, it ends at {end_filtered:.2f}°",
        numbers={
            "stress_error_rms_MPa": typical,
            "stress_error_rms_inside_limits_MPa": able,
            "stress_error_largest_MPa": largest,
            "stress_error_late_MPa": late,
            "stress_span_MPa": span,
            "estimate_error_rms_MPa": estimated,
            "end_with_filter_deg": end_filtered,
            "end_deg": float(angle[-1]),
            "reach_s": reach,
        },
        draw=draw,
        caveat="drawn and judged with the true stress; the source estimates it. The filter beside it reads the angle without noise. Before, while the wire warms up, "
        "no voltage gives the stress wanted, and the controller holds its limit.",
    )


ROW = Row(
    "C13",
    "Fig. 4.19",
    "arm, stress-based sliding control at 45°",
    "the stress follows the desired stress",
    work,
)
