"""C2: a PID controller tuned at 40 degrees leaves a steady error and overshoots elsewhere (Fig. 4.4)."""

from __future__ import annotations

from .pid_set_points import tuned_at, worst_error, worst_overshoot
from .row import Result, Row
from .set_points import draw_set_points, measures, overshoot, steady, time_of

PRINTED = 4.0  # s


def work(fast: bool) -> Result:
    """The gains of 40 degrees at eight set points."""
    runs = tuned_at(40, fast)
    own = runs[40.0][1]
    reach, below = time_of(own.reach_time), worst_error(runs, -90.0, 40.0)
    above, over = worst_error(runs, 40.0), worst_overshoot(runs, 40.0)
    holds = abs(reach / PRINTED - 1.0) < 0.25 and overshoot(own) < 0.1 and steady(own) < 0.25
    holds &= below > 1.0 and above > 1.0 and over > 1.0
    return Result(
        holds=bool(holds),
        found=f"at 40° the arm arrives after {reach:.1f} s with {overshoot(own):.2f}° of overshoot and stays within {steady(own):.2f}°; after 10 s "
        f"it is up to {below:.1f}° short of lower set points, and up to {above:.1f}° beyond higher ones, which it overshoots by up to {over:.1f}°",
        numbers=measures(runs),
        draw=lambda figure: draw_set_points(figure, runs),
        caveat="gains chosen here, no anti-windup (C1). The errors are those after 10 s: the integral removes them in time.",
    )


ROW = Row(
    "C2",
    "Fig. 4.4",
    "arm, PID tuned at 40°",
    "about 4 s reach, no overshoot at 40°; steady error and overshoot elsewhere",
    work,
)
