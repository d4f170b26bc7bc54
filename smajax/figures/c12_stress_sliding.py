"""C12: stress-based sliding control at set points from -40 to 60 degrees (Fig. 4.18)."""

from __future__ import annotations

import jax.numpy as jnp
import numpy as np
from matplotlib.figure import Figure

from smajax.controller.inverse_wire import moving_load
from smajax.figures.backstepping_runs import degrees, runs, shades
from smajax.figures.drawing import GREY, keyed, named, panels
from smajax.figures.rigs import arm
from smajax.figures.row import Result, Row
from smajax.parameters import set_parameters
from smajax.presets import quick_stress_sliding

TARGETS = tuple(range(-40, 61, 10))  # degrees
SECONDS = 10.0
SLACK = {
    "surface_slope": 20.0,  # 1/s
    "gain": 9.5e-3,  # N m
    "boundary": 1.7,  # rad/s
    "stress_gain": 2e-7,  # V/Pa
    "stress_integral_gain": 1e-6,  # V/(Pa s)
}


def work(fast: bool) -> Result:
    """All set points with one set of gains, searched; and with a stress controller that follows less closely."""
    system = arm()
    tuned = quick_stress_sliding(system)
    slack = set_parameters(tuned, SLACK)
    count = len(TARGETS)
    loops, merits = runs([system] * 2 * count, [tuned] * count + [slack] * count, [*TARGETS, *TARGETS], fast, SECONDS)
    angle, time = degrees(loops), loops.run.time[0]
    reach, overshoot = merits.reach_time, np.degrees(merits.overshoot)
    error = np.degrees(merits.steady_error)
    # The arm's greatest static stress: where gravity's torque falls as fast as the spring's rises.
    sweep = jnp.linspace(-0.7, 1.6, 2301)
    torque = moving_load(system).resistance(sweep, jnp.zeros_like(sweep), {})
    summit = float(jnp.degrees(sweep[jnp.argmax(torque)]))
    loose = overshoot[count:]
    beyond = np.asarray(TARGETS) > summit

    def draw(figure: Figure) -> None:
        for axes, first, title in zip(
            panels(figure, 1, 2), (0, count), ("gains by search", "slacker stress controller"), strict=True
        ):
            for k, colour in enumerate(shades(count)):
                axes.plot(time, angle[first + k], color=colour, label=f"{TARGETS[k]}°")
            axes.axhline(summit, color=GREY, linewidth=0.8, linestyle=":")
            axes.set_xlim(0.0, 5.0)
            named(axes, "time (s)", "arm angle (°)", title)
            keyed(axes)

    return Result(
        holds=bool(
            reach.max() < 4.0
            and error.max() < 0.2
            and loose[~beyond].max() < 0.5
            and loose[-1] > 1.0
            and (np.diff(loose[beyond]) > 0.0).all()
        ),
        found=f"every set point is reached in {reach[:count].min():.1f} to {reach[:count].max():.1f} s; with the searched gains the largest overshoot is "
        f"{overshoot[:count].max():.2f}°; with a slacker stress controller ({reach[count:].max():.1f} s at most) the overshoot stays within {loose[~beyond].max():.1f}° up to "
        f"the angle of greatest stress ({summit:.0f}°) and grows beyond it to {loose[-1]:.1f}° at 60°",
        numbers={
            "slowest_reach_s": float(reach[:count].max()),
            "slowest_reach_slack_s": float(reach[count:].max()),
            "largest_overshoot_deg": float(overshoot[:count].max()),
            **{f"overshoot_slack_{at}_deg": float(o) for at, o in zip(TARGETS, loose, strict=True)},
            "largest_steady_error_deg": float(error.max()),
            "angle_of_greatest_stress_deg": summit,
        },
        draw=draw,
        caveat="the controller is told the true state. Gains are not printed; the searched ones avoid the overshoot that the source sees, "
        f"those with {', '.join(f'{name} = {value:g}' for name, value in SLACK.items())} show it.",
    )


ROW = Row(
    "C12",
    "Fig. 4.18",
    "arm, stress-based sliding control, -40° to 60°",
    "reaches every set point in less than 4 s; overshoot grows beyond the angle of greatest stress",
    work,
)
