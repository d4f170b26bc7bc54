"""C11: stress-based sliding control against a PID tuned at one set point (Fig. 4.17)."""

from __future__ import annotations

from matplotlib.figure import Figure

from smajax.control.figures_of_merit import Merit
from smajax.control.presets import pid, pid_tuned_at, quick_stress_sliding
from smajax.model.rigs import arm
from smajax.report.drawing import keyed, panels

from .row import Result, Row
from .set_points import at_set_points, draw_angles, measures, overshoot, steady

OWN = 10  # degrees, the PID's set point
TARGETS = (-30.0, 10.0, 40.0, 60.0)


def miss(one: Merit) -> float:
    """Overshoot and twice the steady error, degrees."""
    return overshoot(one) + 2.0 * steady(one)


def work(fast: bool) -> Result:
    """Both controllers at the same set points; a PID with anti-windup tuned at all of them beside the claim."""
    system = arm()
    sliding = at_set_points(quick_stress_sliding(system), fast, TARGETS)
    plain = at_set_points(pid_tuned_at(system, OWN), fast, TARGETS)
    best = at_set_points(pid(system), fast, TARGETS)
    own = miss(plain[OWN][1])
    elsewhere = {at: miss(one) for at, (_, one) in plain.items() if at != OWN}
    slides = {at: miss(one) for at, (_, one) in sliding.items()}
    worst, worst_sliding = max(elsewhere.values()), max(slides.values())
    slowest = max(float(one.reach_time) for _, one in sliding.values())
    worst_best = max(miss(one) for _, one in best.values())

    def draw(figure: Figure) -> None:
        left, right = panels(figure, 1, 2)
        draw_angles(left, plain)
        draw_angles(right, sliding)
        left.set_title(f"PID tuned at {OWN}°", fontsize=9.5, loc="left")
        right.set_title("stress-based sliding control", fontsize=9.5, loc="left")
        keyed(left)
        keyed(right)

    return Result(
        holds=own < 1.0 and worst > 5.0 * max(own, 0.2) and worst_sliding < 1.0 and slowest < 4.0,
        found=f"overshoot plus twice the steady error: {own:.2f}° for the PID at its own {OWN}°, "
        f"{', '.join(f'{value:.1f}° at {at:.0f}°' for at, value in elsewhere.items())}; {worst_sliding:.2f}° at most for the sliding controller, "
        f"which reaches every set point in {slowest:.1f} s or less",
        numbers={
            **measures(plain, "pid_"),
            **measures(sliding, "sliding_"),
            "pid_own_miss_deg": own,
            "pid_worst_miss_deg": worst,
            "sliding_worst_miss_deg": worst_sliding,
            "pid_tuned_everywhere_worst_miss_deg": worst_best,
        },
        draw=draw,
        caveat="gains of both by search, the source prints none. The PID is the one without anti-windup of Fig. 4.3; one with anti-windup, "
        f"tuned at several set points at once (beside the claim), misses by {worst_best:.1f}° at most. The sliding controller gets the true stress.",
    )


ROW = Row(
    "C11",
    "Fig. 4.17",
    "arm, stress-based sliding control against PID",
    "the PID is good at its own set point only, one sliding controller at all",
    work,
)
