"""C1: a PID controller tuned at 10 degrees is good there, and worse at other set points (Fig. 4.3)."""

from __future__ import annotations

from .pid_set_points import (
    soonest_settled,
    tuned_at,
    unwound,
    worst_error,
    worst_overshoot,
)
from .row import Result, Row
from .set_points import draw_set_points, measures, overshoot, time_of

PRINTED = 2.5  # s


def work(fast: bool) -> Result:
    """The gains of 10 degrees at eight set points."""
    runs = tuned_at(10, fast)
    own = runs[10.0][1]
    soonest, reach = soonest_settled(runs, 10.0), time_of(own.reach_time)
    holds = abs(reach / PRINTED - 1.0) < 0.25 and overshoot(own) < 0.1
    # At every other set point, both below and above.
    holds &= soonest > 1.5 * time_of(own.settling_time) and worst_overshoot(runs, 10.0) > 5.0
    return Result(
        holds=bool(holds),
        found=f"at 10° the arm arrives after {reach:.1f} s with {overshoot(own):.2f}° of overshoot; everywhere else it needs "
        f"{soonest:.1f} s or more to settle, below without overshoot and up to {worst_error(runs, -90.0, 10.0):.1f}° off, above with "
        f"up to {worst_overshoot(runs, 10.0):.0f}°",
        numbers=measures(runs),
        draw=lambda figure: draw_set_points(figure, runs),
        caveat=f"{unwound(fast)}.",
    )


ROW = Row(
    "C1",
    "Fig. 4.3",
    "arm, PID tuned at 10°",
    "about 2.5 s reach, no overshoot at 10°; clearly worse at other set points",
    work,
)
