"""The path integration once more by plain sub-steps, to check `path_reference` by: no events, no contacts, no modes.

Each leg is cut into equal steps; in each, the definitions are applied as they read. Exact in xi under stress control
(a step takes the lower of the curve and the present state); of second order in the strain, xi_s and strain control.
"""

from __future__ import annotations

import copy
from collections.abc import Sequence
from itertools import pairwise

import numpy as np
from scipy.optimize import brentq

from studies.reference.wire_law import LAWS, branches, detwinned_share
from studies.reference.wire_parameters import WireParameters

MOST_STRESS = 1e10


class Point:
    """Material point: state and history."""

    def __init__(self, wire: WireParameters, temperature: float, stress: float) -> None:
        self.wire, self.law = wire, LAWS[wire.law or wire.conditions]
        self.temperature, self.stress, self.strain = temperature, stress, 0.0
        self.xi = wire.initial_martensite_fraction
        self.detwinned = self.xi if not self.law.split else detwinned_share(wire, stress)[0] * self.xi
        self.amplitudes, self.loaded, self.falling = [1.0, 1.0], False, False

    def moved(self, temperature: float, stress: float) -> Point:
        """The point after one step."""
        new, w, law = copy.copy(self), self.wire, self.law
        new.amplitudes, new.falling = list(self.amplitudes), False
        new.temperature, new.stress = temperature, stress
        d_t, d_s = temperature - self.temperature, stress - self.stress
        pair = branches(w)
        for i, b in enumerate(pair):
            warm, pull = d_t * b.sign > 0, d_s * b.sign < 0
            may = {
                "enhanced": True,
                "liang": warm,
                "brinson": warm or (pull and (self.loaded or b.sign < 0)),
            }[law.conditions]
            old, now = b.progress((self.temperature, self.stress)), b.progress((temperature, stress))
            before, after, left = law.curve(old), law.curve(now), b.left(self.xi)
            moving = b.pace(d_t, d_s) > 0
            if not may or (not moving and w.anchor == "motion") or left == 0:
                continue
            if w.renewal == "corrected":
                if before > 0 and new.amplitudes[i] * before < left:
                    new.amplitudes[i] = left / before
                goal = min(left, new.amplitudes[i] * after) if before > 0 else left
            else:
                if b.sign > 0 and not self.falling and moving:
                    new.amplitudes[0] = self.xi
                goal = max(left + new.amplitudes[i] * (after - before), 0.0)
            if moving and goal < left:
                new.xi = b.left(goal)
                if w.renewal == "corrected":
                    other = pair[1 - i]
                    new.amplitudes[1 - i] = other.left(new.xi) / law.curve(other.progress((temperature, stress)))
                elif b.sign > 0:
                    new.falling, new.amplitudes[1] = True, 1 - new.xi
                if b.sign < 0:
                    new.loaded = d_s / b.slope > -d_t
                break
        gained = new.xi - self.xi
        share = detwinned_share(w, stress)[0] if law.split else 1.0
        mean = (share + detwinned_share(w, self.stress)[0]) / 2 if law.split else 1.0
        if gained < 0:
            new.detwinned += self.detwinned / self.xi * gained
        else:
            new.detwinned += mean * gained
        new.detwinned = max(new.detwinned, share * new.xi)
        new.strain += self._stretch(new)
        return new

    def _stretch(self, new: Point) -> float:
        w = self.wire
        slope = 0.0 if w.stiffness == "martensite" else w.modulus_martensite - w.modulus_austenite
        e0, e1 = (w.modulus_martensite + (xi - 1) * slope for xi in (self.xi, new.xi))
        p0, p1 = (p.stress - w.thermoelastic_coefficient * (p.temperature - w.ambient_temperature) for p in (self, new))
        grown = w.recoverable_strain * (new.detwinned - self.detwinned)
        return grown + (p1 / e1 - p0 / e0 if w.constitutive == "integrated" else 2 * (p1 - p0) / (e0 + e1))


def substep_path(
    params: WireParameters,
    path: Sequence[tuple[float, float]],
    steps: int,
    control: str = "stress",
    initial_stress: float = 0.0,
) -> list[Point]:
    """Points at the start and the end of each leg; their strain is the wire's own."""
    stress = path[0][1] if control == "stress" else initial_stress
    point = Point(params, path[0][0], stress)
    point.strain = 0.0 if control == "stress" else path[0][1]
    points = [point]
    for start, end in pairwise(path):
        for u in np.linspace(0, 1, steps + 1)[1:]:
            temperature, value = (float(a + u * (b - a)) for a, b in zip(start, end, strict=True))
            if control == "strain":
                value = _stress(point, temperature, value)
            point = point.moved(temperature, value)
        points.append(point)
    return points


def _stress(point: Point, temperature: float, strain: float) -> float:
    def miss(stress: float) -> float:
        return point.moved(temperature, stress).strain - strain

    return 0.0 if miss(0.0) >= 0 else float(brentq(miss, 0.0, MOST_STRESS, xtol=1e-4, rtol=1e-15))
