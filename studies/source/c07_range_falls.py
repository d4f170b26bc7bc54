"""C7: the transformation temperatures fall once the arm is past its angle of greatest stress (Fig. 4.11)."""

from __future__ import annotations

import jax.numpy as jnp
import numpy as np
from matplotlib.figure import Figure

from smajax.control.presets import vsc3_of_section_4_6
from smajax.model.load.arm import Arm
from smajax.model.rigs import arm
from smajax.report.drawing import BLUE, GREY, RED, named, panels

from .rigs import Recorded, austenite_range, martensite_range
from .row import Result, Row
from .set_points import regulated
from .unprinted import switch_on_a_surface

SWING = 0.5  # s: two swings of the arm on its wire, over which A_f' is averaged


def static_peak() -> float:
    """Angle at which the arm at rest asks most of its wire, degrees."""
    angles = np.radians(np.linspace(-45.0, 90.0, 2701))
    load = arm().load
    assert isinstance(load, Arm)
    torque = load.resistance(jnp.asarray(angles), jnp.zeros(angles.size), {})
    return float(np.degrees(angles[int(np.argmax(np.asarray(torque)))]))


def _averaged(loop: Recorded, series: np.ndarray) -> np.ndarray:
    count = round(SWING / float(loop.run.time[1] - loop.run.time[0])) // 2
    padded = np.pad(series, count, mode="edge")
    return np.convolve(padded, np.full(2 * count + 1, 1.0 / (2 * count + 1)), mode="valid")


def work(fast: bool) -> Result:
    """VSC at 50 degrees: the controller of C4, and the quicker one of section 4.6."""
    loop, _ = regulated(switch_on_a_surface, fast)[50.0]
    quick, _ = regulated(vsc3_of_section_4_6, fast)[50.0]
    peak = static_peak()
    numbers: dict[str, float] = {"greatest_stress_at_rest_deg": peak}
    for name, one in (("", loop), ("quick_", quick)):
        finish, degrees = _averaged(one, austenite_range(arm(), one.run.stress)[1]), np.degrees(one.run.position)
        passing = int(np.argmax(degrees > peak))
        after = finish[passing:]
        numbers |= {
            f"{name}highest_at_deg": float(degrees[int(finish.argmax())]),
            f"{name}finish_in_passing_C": float(finish[passing]),
            f"{name}rise_before_C": float(finish[passing] - finish[0]),
            f"{name}fall_after_C": float(finish[passing] - finish[-1]),
            # How far it ever climbs again.
            f"{name}largest_rise_after_C": float((after - np.minimum.accumulate(after)).max()),
        }
    lines = [line for limit in (austenite_range, martensite_range) for line in limit(arm(), loop.run.stress)]
    passing = int(np.argmax(np.degrees(loop.run.position) > peak))
    falls = [float((one := _averaged(loop, line))[passing] - one[-1]) for line in lines]
    holds = numbers["rise_before_C"] > 1.0 and min(falls) > 1.0 and numbers["largest_rise_after_C"] < 0.25 * min(falls)
    holds &= numbers["quick_fall_after_C"] > 1.0
    return Result(
        holds=bool(holds),
        found=f"A_f' has risen by {numbers['rise_before_C']:.1f} °C when the arm passes {peak:.0f}°, where its stress at rest is greatest, and from there on "
        f"falls by {numbers['fall_after_C']:.1f} °C until it stands at 50°, never rising by more than {numbers['largest_rise_after_C']:.1f} °C, and so do the other three",
        numbers=numbers,
        draw=lambda figure: _draw(figure, loop, quick),
        caveat=f"gains of C4; averaged over {SWING} s, for the arm swings on its wire as it goes, and its inertia moves A_f' too (highest at "
        f"{numbers['highest_at_deg']:.0f}°). With the quicker gains of C9 it falls by {numbers['quick_fall_after_C']:.1f} °C, and to and fro with the overshoot.",
    )


def _draw(figure: Figure, loop: Recorded, quick: Recorded) -> None:
    axes = panels(figure, 2, 2)
    for column, (one, title) in enumerate(((loop, "gains of C4"), (quick, "quicker gains, of C9"))):
        heat, angle = axes[column], axes[column + 2]
        lines = zip(("A_s'", "A_f'"), austenite_range(arm(), one.run.stress), strict=True)
        for style, (name, line) in zip(("--", "-"), lines, strict=True):
            heat.plot(one.run.time, line, style, color=RED, label=name)
        lines = zip(("M_f'", "M_s'"), martensite_range(arm(), one.run.stress)[::-1], strict=True)
        for style, (name, line) in zip(("--", "-"), lines, strict=True):
            heat.plot(one.run.time, line, style, color=BLUE, label=name)
        angle.plot(one.run.time, np.degrees(one.run.position), color=RED)
        angle.axhline(static_peak(), color=GREY, linewidth=0.8, linestyle=":")
        named(heat, "time (s)", "temperature (°C)", title)
        named(angle, "time (s)", "arm angle (°)")
    axes[0].legend(frameon=False, fontsize=8, ncols=4, loc="center right")
    axes[2].annotate("greatest stress", (6.0, static_peak() - 8.0), fontsize=8, color="#6b7078")


ROW = Row(
    "C7",
    "Fig. 4.11",
    "arm, VSC at 50°",
    "the transformation temperatures fall past the angle of greatest stress",
    work,
)
