"""C11: stress-based sliding control against a PID tuned at one set point (Fig. 4.17)."""

from __future__ import annotations

from collections.abc import Mapping

from matplotlib.figure import Figure

from smajax.control.figures_of_merit import Merit
from smajax.control.presets import pid, pid_tuned_at
from smajax.model.rigs import arm
from smajax.report.drawing import keyed, panels

from .row import Result, Row
from .set_points import at_set_points, draw_angles, measures, overshoot, steady
from .unprinted import sliding

OWN = 10  # degrees, the PID's set point
TARGETS = (-30.0, 10.0, 40.0, 60.0)


def miss(one: Merit) -> float:
    """Overshoot and twice the steady error, degrees."""
    return overshoot(one) + 2.0 * steady(one)


def judged(numbers: Mapping[str, float]) -> bool:
    """The PID misses at other set points than its own, the sliding controller at none.

    "The PID controller can be tuned to perform well for certain set-points while the same SLD controller works well for
    all the desired positions" (sec. 4.7): of the PID that is compared, not of every PID there could be.
    """
    own, worst = numbers["pid_own_miss_deg"], numbers["pid_worst_miss_deg"]
    misses = own < 1.0 and worst > 5.0 * max(own, 0.2)
    return misses and numbers["sliding_worst_miss_deg"] < 1.0 and numbers["sliding_slowest_reach_s"] < 4.0


def work(fast: bool) -> Result:
    """Both controllers at the same set points; a PID with anti-windup tuned at all of them beside the claim."""
    system = arm()
    slid = at_set_points(sliding(system), fast, TARGETS)
    plain = at_set_points(pid_tuned_at(system, OWN), fast, TARGETS)
    best = at_set_points(pid(system), fast, TARGETS)
    own = miss(plain[OWN][1])
    elsewhere = {at: miss(one) for at, (_, one) in plain.items() if at != OWN}
    slides = {at: miss(one) for at, (_, one) in slid.items()}
    worst, worst_sliding = max(elsewhere.values()), max(slides.values())
    slowest = max(float(one.reach_time) for _, one in slid.values())
    worst_best = max(miss(one) for _, one in best.values())

    def draw(figure: Figure) -> None:
        left, right = panels(figure, 1, 2)
        draw_angles(left, plain)
        draw_angles(right, slid)
        left.set_title(f"PID tuned at {OWN}°", fontsize=9.5, loc="left")
        right.set_title("stress-based sliding control", fontsize=9.5, loc="left")
        keyed(left)
        keyed(right)

    numbers = {
        **measures(plain, "pid_"),
        **measures(slid, "sliding_"),
        "pid_own_miss_deg": own,
        "pid_worst_miss_deg": worst,
        "sliding_worst_miss_deg": worst_sliding,
        "sliding_slowest_reach_s": slowest,
        "pid_tuned_everywhere_worst_miss_deg": worst_best,
    }
    return Result(
        holds=judged(numbers),
        found=f"overshoot plus twice the steady error: {own:.2f}° for the PID at its own {OWN}°, "
        f"{', '.join(f'{value:.1f}° at {at:.0f}°' for at, value in elsewhere.items())}; {worst_sliding:.2f}° at most for the sliding controller, "
        f"which reaches every set point in {slowest:.1f} s or less",
        numbers=numbers,
        draw=draw,
        caveat="gains of both by search, the source prints none; the sliding controller's are those of M5, M6, M8, C12 and C13, one set for all (studies/unprinted). The PID is the one of Fig. 4.3, "
        f"without anti-windup, which the source does not name: one with it, tuned at four set points, misses by {worst_best:.1f}° at most, so that the contrast is windup more than the "
        "want of a linear controller. Both command 10 V at most, as every controller here (sec. 4.4.4). The sliding controller gets the true stress.",
    )


ROW = Row(
    "C11",
    "Fig. 4.17",
    "arm, stress-based sliding control against PID",
    "the PID is good at its own set point only, one sliding controller at all",
    work,
)
