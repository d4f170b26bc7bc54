"""Runs of a rig for the transfer study: steps to fit to, and runs of other kinds that nothing of the fit has seen.

A coupon in an oven has no steps of a command: it is fitted to whole cycles.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from studies.attribution_benchmark.parameters import Wire
from studies.attribution_benchmark.rigs import RIGS, Rig
from studies.attribution_benchmark.runs import Clock, Marks, Run, command

KINDS = ("ramps", "partial loops", "another load", "half the power")
STRESSES = {"arm": 105e6, "dead_weight": 83e6, "bias_spring": 44e6}  # Pa, about which runs are tuned
MASSES, HEAVY = (0.64, 1.07), 139e6  # kg, on the dead weight; Pa of the heavy one
COUPON = (50e6, 100e6, 150e6, 200e6)  # Pa; the last is judged only


def transfer_rig(name: str, thinned: int = 1) -> Rig:
    """The rig of that name with the runs of this study; `thinned`: every so many samples of its clock (fast)."""
    rig = RIGS[name]
    clock = rig.clock
    own = Clock(clock.step * thinned, max(1, clock.update // thinned), (clock.count - 1) // thinned + 1)
    if rig.load is None:
        return replace(rig, clock=own, runs=lambda _: _cycles(own))
    return replace(rig, clock=own, runs=lambda wire: _powered(own, wire, name))


def kind_of(run: str) -> str:
    """Of a judged run: its name says it."""
    return run.replace("_", " ")


def _powered(clock: Clock, wire: Wire, name: str) -> tuple[Run, ...]:
    m = Marks.of(wire, STRESSES[name])
    hung = name == "dead_weight"

    def run(called: str, role: str, series: np.ndarray, mass: float = MASSES[0]) -> Run:
        return Run(called, role, series, np.full(clock.count, mass) if hung else None)

    def steps(*pairs: tuple[float, float]) -> np.ndarray:
        return command(wire, clock.levels(*pairs))

    amplitude = 0.5 * (m.full - m.cold) + 6
    wave = amplitude * math.hypot(1.0, 2 * math.pi * 5 / clock.seconds * m.slow), 5.0, 1.2
    first = steps((0.03, m.off), (0.22, m.full + 8), (0.2, m.off), (0.2, m.hot(0.5)), (0.15, m.full + 12), (0.2, m.off))
    ramps = clock.ramps((0, m.off), (0.35, m.full + 12), (0.65, m.cold - 10), (0.85, m.hot(0.5)), (1, m.cold - 10))
    half = 0.5 if wire.drive == "duty" else math.sqrt(0.5)
    runs = [
        run("steps", "fit", first),
        run(
            "low_steps", "fit", steps((0.03, m.off), (0.3, m.full + 4), (0.3, m.off), (0.2, m.full + 10), (0.17, m.off))
        ),
        run(
            "high_steps",
            "fit",
            steps((0.03, m.off), (0.15, m.full + 15), (0.25, m.off), (0.3, m.hot(0.8)), (0.27, m.off)),
        ),
        run("ramps", "held-out", command(wire, ramps)),
        run("partial_loops", "held-out", command(wire, clock.sines(m.middle, wave))),
        run("half_the_power", "held-out", half * first),
    ]
    if hung:
        h = Marks.of(wire, HEAVY)
        lifted = steps((0.03, h.off), (0.3, h.full + 8), (0.27, h.off), (0.2, h.hot(0.6)), (0.2, h.off))
        runs.append(run("another_load", "held-out", lifted, MASSES[1]))
    return tuple(runs)


def _cycles(clock: Clock) -> tuple[Run, ...]:
    share = np.arange(clock.count) / (clock.count - 1)

    def oven(*points: tuple[float, float]) -> np.ndarray:
        return np.interp(share, [x for x, _ in points], [30.0 + 95.0 * y for _, y in points])

    whole, twice = oven((0, 0), (0.5, 1), (1, 0)), oven((0, 0), (0.25, 1), (0.5, 0), (0.75, 1), (1, 0))
    inner = oven((0, 0), (0.22, 0.62), (0.38, 0.3), (0.55, 0.72), (0.72, 0.38), (0.86, 0.6), (1, 0.05))

    def run(name: str, role: str, path: np.ndarray, stress: float) -> Run:
        return Run(name, role, path, np.full(clock.count, stress))

    return (
        run("low", "fit", whole, COUPON[0]),
        run("middle", "fit", twice, COUPON[1]),
        run("high", "fit", whole, COUPON[2]),
        run("partial_loops", "held-out", inner, COUPON[1]),
        run("another_load", "held-out", whole, COUPON[3]),
    )
