"""Transformation curves, branches and their history (Elahinia 2004, eq. 3.3, 3.5, 3.17, 3.18, 3.26 corrected).

A branch (+1 heating, -1 cooling) has a progress z, 0 at the start of its range and 1 at its end. What it has yet to
transform, xi when heating and 1 - xi when cooling, is amplitude * share(z). The amplitude is renewed only by the other
branch, so that the curve passes through the present state; before `contact` the branch transforms nothing.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

from studies.attribution_benchmark.parameters import Effects, Wire

WIDE = 3.0  # width of the smooth part over the range
SECOND_WIDTH = 0.8  # width of the second step over the range


@dataclass(frozen=True)
class Curve:
    """Share not yet transformed: cosines (weight, shift, width), then asymmetry and bump. 1 up to `low`, 0 from `high`."""

    parts: tuple[tuple[float, float, float], ...] = ((1.0, 0.0, 1.0),)
    asymmetry: float = 0.0
    bump: float = 0.0
    low: float = field(init=False)
    high: float = field(init=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "low", min(shift for _, shift, _ in self.parts))
        object.__setattr__(self, "high", max(shift + width for _, shift, width in self.parts))

    def at(self, z: float) -> tuple[float, float]:
        """Share and its slope."""
        h = slope = 0.0
        for weight, shift, width in self.parts:
            u = (z - shift) / width
            if u <= 0:
                h += weight
            elif u < 1:
                h += weight * (1 + math.cos(math.pi * u)) / 2
                slope -= weight * math.pi / 2 / width * math.sin(math.pi * u)
        if self.asymmetry:
            slope *= 1 + self.asymmetry * (1 - 2 * h)
            h += self.asymmetry * h * (1 - h)
        if self.bump and 0 < z < 1:
            p = math.pi * z
            h += self.bump * math.sin(p) ** 2 * math.sin(4 * p) / (4 * math.pi)
            slope += self.bump * (math.sin(2 * p) * math.sin(4 * p) / 4 + math.sin(p) ** 2 * math.cos(4 * p))
        return h, slope


@dataclass
class Branch:
    """One branch with what it carries."""

    sign: int
    start: float
    span: float
    slope: float  # C, Pa/K
    curve: Curve
    widening: float = 0.0  # 1/Pa: growth of the span with stress
    level: float = 0.0  # Pa: stress at which the span is as given
    drift: float = 0.0  # K the range has moved down per transformation done
    partial: float = 0.0  # K by which a half transformation makes the way back start earlier
    amplitude: float = 1.0
    contact: float = math.inf
    early: float = 0.0

    def progress(self, temperature: float, stress: float, done: float) -> tuple[float, float, float, float]:
        """z and its derivatives to temperature, stress and `done`, the transformations passed so far."""
        grown = 1 + self.widening * (stress - self.level)
        span = self.span * grown + self.early
        y = temperature - stress / self.slope + self.drift * done - self.start + self.sign * self.early
        z = self.sign * y / span
        return (
            z,
            self.sign / span,
            (-self.sign / self.slope - z * self.span * self.widening) / span,
            self.sign * self.drift / span,
        )

    def left(self, xi: float) -> float:
        """What the branch has yet to transform; its own inverse."""
        return xi if self.sign > 0 else 1 - xi

    def touch(self, z: float, xi: float) -> None:
        """Set the contact where the present state lies on the curve, or at the start of the curve."""
        self.contact = max(z, self.curve.low) if self.left(xi) > 0 else math.inf

    def renew(self, temperature: float, stress: float, done: float, xi: float) -> None:
        """Lay the curve through the present state: the other branch has moved it."""
        self.early = 4 * self.partial * xi * (1 - xi)
        z = self.progress(temperature, stress, done)[0]
        share = self.curve.at(z)[0]
        if share <= 0:
            raise ValueError(
                f"both branches transform at {temperature:.2f} degC, {stress:.3e} Pa; expected the austenite range above "
                "the martensite one; check the four temperatures and the effects of the kinetics"
            )
        self.amplitude = self.left(xi) / share
        self.touch(z, xi)


def branches(wire: Wire, effects: Effects, level: float) -> tuple[Branch, Branch]:
    """Heating and cooling branch of a wire that is all martensite; `level`: stress at which widths are as given, Pa."""
    get = effects.get
    smooth, second = get("smooth_transformation", 0.0), get("two_part_transformation", 0.0)
    asymmetry, bump = get("asymmetric_transformation", 0.0), get("bumped_transformation", 0.0)
    tilt = get("different_slopes", 0.0)

    def curve(sign: int) -> Curve:
        parts = [(1.0 - smooth - second, 0.0, 1.0)]
        if smooth:
            parts.append((smooth, (1 - WIDE) / 2, WIDE))
        if second:  # an intermediate phase comes first on cooling, well before the rest, and goes last on heating
            parts.append((second, -1.0 if sign < 0 else 0.9, SECOND_WIDTH))
        return Curve(tuple(parts), asymmetry * sign, bump)

    widening = get("stress_dependent_width", 0.0) / level if level else 0.0
    common = {
        "widening": widening,
        "level": level,
        "drift": get("transformation_drift", 0.0),
        "partial": get("minor_loops", 0.0),
    }
    w = wire
    heating = Branch(
        1,
        w.austenite_start,
        w.austenite_finish - w.austenite_start,
        w.stress_slope_austenite * (1 + tilt),
        curve(1),
        **common,
    )
    cooling = Branch(
        -1,
        w.martensite_start,
        w.martensite_start - w.martensite_finish,
        w.stress_slope_martensite * (1 - tilt),
        curve(-1),
        **common,
    )
    heating.contact = heating.curve.low
    return heating, cooling
