"""Coupon at constant stress on a prescribed temperature: xi in closed form, its history by the branches.

The rate form (eq. 3.2) at constant stress is strain' = (-theta_T/E(xi) + alpha) T' + eps_L xi'. xi is exact at every
point of the path; the thermal term and a creep are summed over SUBSTEPS points between two samples.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from studies.attribution_benchmark.kinetics import Branch, branches
from studies.attribution_benchmark.mechanics import Strains
from studies.attribution_benchmark.parameters import Effects, Wire
from studies.attribution_benchmark.runs import Run

Vector = NDArray[np.float64]
SUBSTEPS = 4
NEAR = 1e-6  # s: nodes that are nearer to each other are one
# Of a fixed point, which halves its error at least: a drift by its own transformation is less than half a range.
MOST_TIMES, SETTLED = 60, 1e-13
LEVEL = 100e6  # Pa: stress at which widths are as given


def _nodes(times: Vector, delay: float) -> Vector:
    """Times between which the path is straight, `SUBSTEPS` or more a sample, the samples' own among them."""
    even = np.linspace(times[0], times[-1], (times.size - 1) * SUBSTEPS + 1)
    turns = times[times + delay < times[-1]] + delay if delay else times[:0]
    return _joined(even, turns)


def _joined(nodes: Vector, turns: Vector) -> Vector:
    """Both in order; a turn next to a node is that node."""
    every = np.sort(np.concatenate([nodes, turns]))
    return every[np.concatenate([[True], np.diff(every) > NEAR])]


def _late(ramp: float, step: float, behind: float, lag: float) -> float:
    """By how much a late temperature is behind (`behind` before) at the end of a ramp, C."""
    return ramp * lag + (behind - ramp * lag) * float(np.exp(-step / lag))


def _turns_of_late(fine: Vector, path: Vector, lag: float) -> Vector:
    """Times at which the late temperature turns: where it meets the path, after that has turned. xi is exact only between these."""
    behind, turns = 0.0, []
    for k in range(1, fine.size):
        step = float(fine[k] - fine[k - 1])
        ramp = float(path[k] - path[k - 1]) / step
        if behind * ramp < 0:
            after = lag * float(np.log1p(-behind / (ramp * lag)))
            if after < step:
                turns.append(float(fine[k - 1]) + after)
        behind = _late(ramp, step, behind, lag)
    return np.asarray(turns)


def _left(b: Branch, xi: float, seen: float, stress: float, done: float) -> float:
    """What the branch has yet to transform at a temperature: a range that drifts has moved by what is transformed up to there, so this is a fixed point."""
    left = b.left(xi)
    for _ in range(MOST_TIMES):
        passed = done + abs(b.left(xi) - left)
        last, left = left, min(b.left(xi), max(b.amplitude * b.curve.at(b.progress(seen, stress, passed)[0])[0], 0.0))
        if not b.drift or abs(left - last) < SETTLED:
            break
    return left


def strain(wire: Wire, times: Vector, run: Run, effects: Effects) -> Vector:
    """Strain at the samples, from 0 at the first; all martensite at the start."""
    if run.other is None:
        raise ValueError(f"run {run.name!r} has no stress; expected one of a coupon's runs")
    stress = float(run.other[0]) * (1 + effects.get("wrong_load", 0.0))
    strains, lag = Strains(wire, effects), effects.get("rate_dependence", 0.0)
    pair = branches(wire, effects, LEVEL)
    # the oven is read at `times`; a delay means that the wire is behind it, and turns between two of them
    delay = effects.get("input_delay", 0.0)
    fine = _nodes(times, delay)
    if lag:
        fine = _joined(fine, _turns_of_late(fine, np.interp(fine - delay, times, run.command), lag))
    path = np.interp(fine - delay, times, run.command)
    xi, done, late = 1.0, 0.0, float(path[0])
    total, creep, kept = 0.0, strains.creep * stress / strains.level, np.zeros(fine.size)
    seen = late
    for k in range(1, fine.size):
        change, step = float(path[k] - path[k - 1]), float(fine[k] - fine[k - 1])
        behind = _late(change / step, step, float(path[k - 1]) - late, lag) if lag else 0.0
        seen = float(path[k]) - behind
        sign = (seen > late) - (seen < late)
        old = xi
        for b in pair:
            if b.sign == sign and b.left(xi) > 0:
                left = _left(b, xi, seen, stress, done)
                if left < b.left(xi):
                    xi = b.left(left)
                    pair[b.sign > 0].renew(seen, stress, done, xi)
        done += abs(xi - old)
        middle = (xi + old) / 2
        total += (strains.expansion - wire.thermal_modulus / wire.modulus(middle)) * change
        total += strains.per_fraction(middle, stress, sign) * (xi - old)
        total += strains.softened(old, xi, stress, (path[k] + path[k - 1]) / 2)
        if strains.creep:
            grown = strains.crept(creep, stress, middle, step)
            creep += grown
            total += grown
        late, kept[k] = seen, total
    return kept[np.searchsorted(fine, times - NEAR)]
