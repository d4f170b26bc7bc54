"""Integration from event to event by scipy's LSODA (variable order and step, Adams or BDF as stiffness asks).

Events and samples are read off the cubic through both ends of a step and their rates, which unlike LSODA's own
interpolation meets the ends exactly; a step is at most `longest_step`, so that it is as good as the tolerance asks.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import LSODA
from scipy.optimize import brentq

from studies.attribution_benchmark.actuator import Actuator

Vector = NDArray[np.float64]
FINEST = 1e-5  # s
MAX_EVENTS = 20_000


class Cubic:
    """Hermite's cubic of one step."""

    def __init__(self, t: float, s: Vector, rate: Vector, end: float, last: Vector, last_rate: Vector) -> None:
        self.t, self.h, self.s, self.last = t, end - t, s, last
        self.rate, self.last_rate = rate * self.h, last_rate * self.h

    def __call__(self, t: float) -> Vector:
        u = (t - self.t) / self.h
        v = 1 - u
        return v * v * ((1 + 2 * u) * self.s + u * self.rate) + u * u * ((1 + 2 * v) * self.last - v * self.last_rate)


def march(
    actuator: Actuator,
    segments: Iterable[tuple[float, Callable[[float], None]]],
    times: Vector,
    rtol: float,
    longest_step: float,
) -> Vector:
    """States, and below them the martensite fraction, at `times`; a sample on a break sees the state before it.

    `segments`: (end time, what sets the commands at its start) in turn. Raises RuntimeError if the modes chatter.
    """
    state = actuator.start()
    kept = np.empty((state.size + 1, times.size))
    kept[:-1, 0], kept[-1, 0] = state, actuator.xi
    done, now, events = 1, 0.0, 0
    atol = rtol * actuator.scales()

    def rates(t: float, s: Vector) -> Vector:
        return np.array(actuator.rates(t, s))

    for end, begin in segments:
        begin(now)
        state = actuator.settle(now, state)
        longest = longest_step
        while now < end - 1e-12:
            events += 1
            if events > MAX_EVENTS:
                raise RuntimeError(f"{MAX_EVENTS} events by t = {now:.6g} s; expected far fewer: the modes chatter")
            watched, peaks = actuator.watch(), actuator.peaks()
            functions = [(d, f) for _, d, f in watched] + peaks
            before = [f(now, state) for _, f in functions]
            solver = LSODA(rates, now, state, end, rtol=rtol, atol=atol, max_step=longest)
            rate = rates(now, state)
            event: int | None = None
            while event is None and solver.status == "running":
                t0, s0 = solver.t, solver.y.copy()
                message = solver.step()
                if solver.status == "failed":
                    raise RuntimeError(f"integration stopped at t = {t0:.6g} s: {message}; loosen rtol")
                t1, s1 = solver.t, solver.y.copy()
                rate1 = rates(t1, s1)
                cubic = Cubic(t0, s0, rate, t1, s1, rate1)
                after = [f(t1, s1) for _, f in functions]
                hits = []
                for i, (direction, f) in enumerate(functions):
                    a, b = before[i] * direction, after[i] * direction
                    if a <= 0 < b:
                        root = t0 if a == 0 else brentq(_along, t0, t1, args=(f, cubic), xtol=1e-12, rtol=1e-14)
                        hits.append((float(root), i))
                missed = [at for at, i in hits if i >= len(watched) and actuator.passed(cubic(at))]
                if missed and longest > FINEST:
                    longest = max(longest / 10, FINEST)
                    now, state, event = t0, s0, -1  # a contact was passed and left within one step: again, closer
                    break
                first = min((hit for hit in hits if hit[1] < len(watched)), default=None)
                until = t1 if first is None else first[0]
                while done < times.size and times[done] <= until:
                    s = cubic(float(times[done]))
                    kept[:-1, done], kept[-1, done] = s, actuator.fraction(s)
                    done += 1
                now, state = t1, s1
                if first is not None:
                    now, event = first
                    state = cubic(now)
                before, rate = after, rate1
            if event is not None and event >= 0:
                longest = longest_step
                state = actuator.handle(watched[event][0], now, state)
        now = end
    kept[:-1, done:], kept[-1, done:] = state[:, None], actuator.fraction(state)  # rounding of the last end
    return kept


def _along(t: float, f: Callable[[float, Vector], float], cubic: Cubic) -> float:
    return f(t, cubic(t))
