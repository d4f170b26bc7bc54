"""C11: stress-based sliding control against a PID tuned at one set point (Fig. 4.17)."""

from __future__ import annotations

from collections.abc import Mapping

from matplotlib.figure import Figure

from smajax.control.figures_of_merit import Merit
from smajax.control.presets import pid, pid_tuned_at, quick_stress_sliding
from smajax.model.rigs import arm
from smajax.report.drawing import keyed, panels

from .row import Result, Row, State, judgement
from .set_points import at_set_points, draw_angles, measures, overshoot, steady

OWN = 10  # degrees, the PID's set point
TARGETS = (-30.0, 10.0, 40.0, 60.0)


def miss(one: Merit) -> float:
    """Overshoot and twice the steady error, degrees."""
    return overshoot(one) + 2.0 * steady(one)


def judged(numbers: Mapping[str, float]) -> State:
    """A PID without anti-windup misses elsewhere, the sliding controller nowhere; as worded any PID does."""
    own, worst = numbers["pid_own_miss_deg"], numbers["pid_worst_miss_deg"]
    checked = own < 1.0 and worst > 5.0 * max(own, 0.2)
    checked &= numbers["sliding_worst_miss_deg"] < 1.0 and numbers["sliding_slowest_reach_s"] < 4.0
    return judgement(checked, numbers["pid_tuned_everywhere_worst_miss_deg"] > 1.0)


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

    numbers = {
        **measures(plain, "pid_"),
        **measures(sliding, "sliding_"),
        "pid_own_miss_deg": own,
        "pid_worst_miss_deg": worst,
        "sliding_worst_miss_deg": worst_sliding,
        "sliding_slowest_reach_s": slowest,
        "pid_tuned_everywhere_worst_miss_deg": worst_best,
    }
    state = judged(numbers)
    return Result(
        holds=state is not State.FAILS,
        in_part=f"the contrast is windup: the PID of the claim has no anti-windup, and one with it, tuned at four set points, misses by {worst_best:.1f}° at most "
        f"instead of {worst:.1f}°"
        if state is State.IN_PART
        else "",
        found=f"overshoot plus twice the steady error: {own:.2f}° for the PID at its own {OWN}°, "
        f"{', '.join(f'{value:.1f}° at {at:.0f}°' for at, value in elsewhere.items())}; {worst_sliding:.2f}° at most for the sliding controller, "
        f"which reaches every set point in {slowest:.1f} s or less",
        numbers=numbers,
        draw=draw,
        caveat="gains of both by search, the source prints none. The PID is the one of Fig. 4.3. The"
        " sliding controller gets the true stress.",
    )


ROW = Row(
    "C11",
    "Fig. 4.17",
    "arm, stress-based sliding control against PID",
    "the PID is good at its own set point only, one sliding controller at all",
    work,
)
