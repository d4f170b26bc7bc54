"""Friction that grows with the load and is larger at rest than in motion."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

from smajax.core.parameters import parameter
from smajax.model.effects.base import AbstractEffect
from smajax.model.effects.candidate import LOST_MOTION, Candidate
from smajax.model.effects.coulomb_friction import BEND_WIDTH, presliding_parameter
from smajax.model.effects.pulley_friction import SHARE_WIDTH, PulleyFriction
from smajax.model.effects.stribeck_friction import SLIDING_WIDTH, SPEED_WIDTH, all_over, falling
from smajax.model.load.friction import PRESLIDING, FrictionTerm
from smajax.model.types import Scalar


def _start_ranges(switches: Mapping[str, float]) -> dict[str, tuple[float, float]]:
    return all_over(switches, "share")


class PulleyStribeckFriction(AbstractEffect, FrictionTerm):
    r"""$\mu(v)\,|F_{load}|$, $\mu = \mu_s\,[r + (1 - r)\,e^{-(v/v_s)^2}]$: `PulleyFriction` with the curve of `StribeckFriction`.

    Identifiable beside a friction of one size only where the load changes from run to run.
    """

    share: Scalar = parameter(
        "-", 0.0, 1.0, "mu_s: friction at rest, to break away, over the load at rest", default=0.0
    )
    sliding: Scalar = parameter("-", 0.01, 1.0, "r: friction in motion over that at rest", default=0.5)
    speed: Scalar = parameter(
        "m/s", 1e-5, 1.0, "v_s: speed of the wire's moving end about which the friction falls", default=0.005
    )
    bend: Scalar = presliding_parameter()

    effect_name: ClassVar[str] = "pulley_stribeck_friction"
    candidate: ClassVar[Candidate] = Candidate(
        title="Stribeck friction that grows with the load",
        equation="mechanics",
        formula="inertia a + resistance + mu_s [r + (1 - r) exp(-(v/v_s)^2)] F_load sign(v) = lever A_w sigma "
        "(Stribeck curve in its usual Gaussian form, presliding as in LuGre, Canudas de Wit 1995)",
        sentence="A pulley or a bearing rubs, the more the heavier the load, and more at rest than in motion: the load sticks at "
        "every change of direction and jumps when it starts.",
        switches=("share",),
        initial_guess={"share": 0.02, "sliding": 0.5, "speed": 5e-3, "bend": PRESLIDING},
        stick_slip=True,
        start_ranges=_start_ranges,
        applies=PulleyFriction.candidate.applies,
        prior_class="bench",
        similar_group=LOST_MOTION,
        widths={
            "share": SHARE_WIDTH,
            "sliding": SLIDING_WIDTH,
            "speed": SPEED_WIDTH,
            "bend": BEND_WIDTH,
        },
    )

    def friction_limit(self, load_at_rest: Scalar) -> Scalar:
        return self.share * load_at_rest

    def friction_level(self, speed: Scalar) -> Scalar | float:
        return falling(speed, self.sliding, self.speed)

    def presliding(self) -> Scalar | float:
        return self.bend
