"""The arm under a PID controller tuned at one set point, shown at others: C1, C2 and C3."""

from __future__ import annotations

from smajax.control.presets import pid, pid_tuned_at
from smajax.model.rigs import arm

from .set_points import SECONDS, Runs, at_set_points, overshoot, regulated, steady, time_of


def tuned_at(degrees: int, fast: bool, seconds: float = SECONDS) -> Runs:
    """Every set point under the gains of one."""
    return at_set_points(pid_tuned_at(arm(), degrees), fast, seconds=seconds)


def unwound(fast: bool) -> str:
    """What the same arm does under the PID with anti-windup, as a sentence."""
    runs = regulated(pid, fast)
    last = max(time_of(one.settling_time) for _, one in runs.values())
    most = max(overshoot(one) for _, one in runs.values())
    return (
        "gains chosen here, the source prints none; it names no anti-windup either, and none is used. With it (and gains "
        f"searched at four set points) one PID settles at every one of these in {last:.1f} s at most, overshooting by "
        f"{most:.1f}° at most: what the figure shows is windup more than the want of a linear controller"
    )


def worst_overshoot(runs: Runs, above: float, below: float = 90.0) -> float:
    """Degrees, over the set points between."""
    return max(overshoot(one) for angle, (_, one) in runs.items() if above < angle < below)


def worst_error(runs: Runs, above: float, below: float = 90.0) -> float:
    """Degrees, over the set points between."""
    return max(steady(one) for angle, (_, one) in runs.items() if above < angle < below)


def soonest_settled(runs: Runs, tuned: float) -> float:
    """Seconds, over the set points other than the tuned one."""
    return min(time_of(one.settling_time) for angle, (_, one) in runs.items() if angle != tuned)
