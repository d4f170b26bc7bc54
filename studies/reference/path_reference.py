"""Wire led along a prescribed path of temperature and stress, or of temperature and strain, without inertia.

Each leg is integrated by DOP853 in steps of at most a hundredth of the leg, at a relative tolerance of 1e-10; contact
with a curve, completion, reversal, detwinning, change of a condition, slack and take-up are located by root finding on
the dense output. Within a branch xi is algebraic. SI units, degrees Celsius.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

import numpy as np
from numpy.typing import ArrayLike

from studies.reference.event_march import Vector, march
from studies.reference.law_modes import Forcing, LawModes
from studies.reference.wire_parameters import WireParameters

__all__ = ["WireParameters", "simulate_path"]

SCALES = np.array([1.0, 1e6, 1e-4, 1.0, 1e-4, 1e-1])  # absolute tolerances of the state per unit of rtol


class PathModes(LawModes):
    """State (T, stress, strain, -, gap, xi_s); strain is the prescribed one where stress is not."""

    def __init__(self, wire: WireParameters, control: str, rest_rate: float) -> None:
        super().__init__(wire, rest_rate)
        self.control = control
        self.leg = [0.0, 0.0]

    def force(self, t: float, s: Sequence[float] | Vector, xi: float) -> Forcing:
        """The leg's two rates."""
        heat, rate = self.leg
        return Forcing(heat, stress_rate=rate) if self.control == "stress" else Forcing(heat, strain_rate=rate)

    def rates(self, t: float, s: Vector) -> tuple[float, ...]:
        """Rates of the state."""
        t_rate, stress_rate, own, detwinned_rate, _ = self.material(t, s)
        strain_rate = own if self.control == "stress" else self.leg[1]
        return t_rate, stress_rate, strain_rate, 0.0, strain_rate - own, detwinned_rate


def simulate_path(
    params: WireParameters,
    path: Sequence[tuple[float, float]],
    at: ArrayLike,
    *,
    control: str = "stress",
    initial_stress: float = 0.0,
    rtol: float = 1e-10,
) -> dict[str, Vector]:
    """Wire led along straight legs between the corners of `path`: (degC, Pa) or, with control "strain", (degC, strain).

    `at`: ascending points of the path, counted in corners (0.5 is halfway along the first leg). Under strain control
    the path starts at `initial_stress`, and only changes of strain count; a wire that would be compressed goes slack.
    Returns arrays shaped like `at`: path, temperature, stress, strain (the wire's own; from 0 under stress control),
    slack (strain prescribed less the wire's own, <= 0), martensite_fraction, detwinned_fraction. Temperatures of
    `params` other than the transformation's and the ambient T_0 are not read. Raises ValueError on a malformed path.
    """
    points, corners = np.asarray(at, dtype=float), np.asarray(path, dtype=float)
    tension = corners[:, 1].min() if control == "stress" else initial_stress
    if control not in ("stress", "strain") or len(corners) < 2 or tension < 0:
        raise ValueError(
            f"control is {control!r}, {len(corners)} corners, least stress {tension}; expected 'stress' or 'strain', "
            "two corners or more and no compression; mend the path"
        )
    if np.any(np.diff(points) <= 0) or points[0] < 0 or points[-1] > len(corners) - 1:
        raise ValueError(f"points run {points[0]} to {points[-1]}; expected ascending, from 0 to the last corner")
    modes = PathModes(params, control, rest_rate=rtol)
    stress = corners[0, 1] if control == "stress" else initial_stress
    first = 0.0 if control == "stress" else corners[0, 1]
    state = np.array([corners[0, 0], stress, first, 0.0, 0.0, modes.first_detwinned(stress)])

    def leg(i: int, _t: float, _s: Vector) -> None:
        modes.leg = (corners[i + 1] - corners[i]).tolist()

    legs = [(float(i + 1), partial(leg, i)) for i in range(len(corners) - 1)]
    states = march(modes, legs, state, points, rtol * SCALES, rtol, "DOP853")
    return {
        "path": points,
        "temperature": states[0],
        "stress": np.maximum(states[1], 0.0),
        "strain": states[2] - states[4],
        "slack": states[4],
        "martensite_fraction": states[6],
        "detwinned_fraction": modes.detwinned(states, states[6]),
    }
