"""Friction that is larger at rest than in motion."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

import jax.numpy as jnp

from smajax.core.parameters import parameter
from smajax.model.effects.base import AbstractEffect
from smajax.model.effects.candidate import LOST_MOTION, Candidate, Width
from smajax.model.effects.coulomb_friction import BEND_WIDTH, LIMIT_WIDTH, presliding_parameter
from smajax.model.load.friction import PRESLIDING, FrictionTerm
from smajax.model.types import Scalar

# A load that sticks and jumps has a local minimum of the misfit for every row of jumps, so refits begin all over these.
# Friction at rest is larger than what the score test says, which knows no jumps: over that, r, v_s (m/s) and delta (m).
MORE, SLIDING, SPEED, BENT = (1.5, 4.0), (0.2, 0.8), (1e-4, 1e-2), (1e-5, 2e-4)

SLIDING_WIDTH = Width(0.2, "kinetic over static friction of dry metals and plastics: 0.4 to 0.9")
SPEED_WIDTH = Width(
    1.5,
    "Stribeck speeds of guides: 1 to 10 mm/s; a tenth of that when dry",
    logarithmic=True,
)


def falling(speed: Scalar, sliding: Scalar, scale: Scalar) -> Scalar:
    """Friction at a speed (m/s) over that at rest: 1, and `sliding` far above `scale` (m/s)."""
    return sliding + (1.0 - sliding) * jnp.exp(-((speed / scale) ** 2))


def all_over(switches: Mapping[str, float], size: str) -> dict[str, tuple[float, float]]:
    """`Candidate.start_ranges` of an effect whose switch is `size`, with a curve of `sliding` and `speed`, and `bend`."""
    at = switches.get(size, 0.0)
    if at <= 0.0:
        return {}
    return {size: (MORE[0] * at, MORE[1] * at), "sliding": SLIDING, "speed": SPEED, "bend": BENT}


def _start_ranges(switches: Mapping[str, float]) -> dict[str, tuple[float, float]]:
    return all_over(switches, "limit")


class StribeckFriction(AbstractEffect, FrictionTerm):
    r"""$F_s\,[r + (1 - r)\,e^{-(v/v_s)^2}]\,\mathrm{sign}(v)$: $F_s$ at rest, $F_c = r F_s$ in motion (Stribeck curve, Gaussian form).

    Built up over a presliding displacement, LuGre's bristle (Canudas de Wit et al. 1995). With r = 1, and where no run
    moves faster than v_s, it is `CoulombFriction`. How wide the loop of a slow run is tells F_s, that of a fast one r; v_s takes runs of several speeds.
    """

    limit: Scalar = parameter(
        "N", 0.0, 20.0, "F_s: friction at rest, to break away (N m on an arm)", of_load="force", default=0.0
    )
    sliding: Scalar = parameter("-", 0.01, 1.0, "r = F_c/F_s: friction in motion over that at rest", default=0.5)
    speed: Scalar = parameter(
        "m/s", 1e-5, 1.0, "v_s: speed of the wire's moving end about which it falls from F_s to F_c", default=0.005
    )
    bend: Scalar = presliding_parameter()

    effect_name: ClassVar[str] = "stribeck_friction"
    candidate: ClassVar[Candidate] = Candidate(
        title="Stribeck friction",
        equation="mechanics",
        formula="inertia a + resistance + [F_c + (F_s - F_c) exp(-(v/v_s)^2)] sign(v) = lever A_w sigma, F_c = r F_s "
        "(eq. 3.8, 3.13; Stribeck curve in its usual Gaussian form, presliding as in LuGre, Canudas de Wit 1995)",
        sentence="The guide rubs, and breaking away takes more force than keeping in motion: the load sticks at every change of "
        "direction, jumps when it starts, and may go on in jerks.",
        switches=("limit",),
        initial_guess={"limit": 0.1, "sliding": 0.5, "speed": 5e-3, "bend": PRESLIDING},
        stick_slip=True,
        start_ranges=_start_ranges,
        prior_class="bench",
        similar_group=LOST_MOTION,
        widths={
            "limit": LIMIT_WIDTH,
            "sliding": SLIDING_WIDTH,
            "speed": SPEED_WIDTH,
            "bend": BEND_WIDTH,
        },
    )

    def friction_limit(self, load_at_rest: Scalar) -> Scalar:
        return self.limit

    def friction_level(self, speed: Scalar) -> Scalar | float:
        return falling(speed, self.sliding, self.speed)

    def presliding(self) -> Scalar | float:
        return self.bend
