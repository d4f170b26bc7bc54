"""An amplifier or a supply at the end of its range: large commands do not come through whole."""

from __future__ import annotations

from typing import ClassVar

import jax.numpy as jnp

from smajax.core.parameters import parameter
from smajax.model.drive.inputs import CommandTerm
from smajax.model.effects.base import AbstractEffect
from smajax.model.effects.candidate import Candidate, Extent, Width, has_command
from smajax.model.types import Scalar

# Sizes of commands, beside zero: what is lost of one or two is a gain, which convection and heat capacity say as well.
SIZES = 3
# Knees that are tried: where, in shares of the largest command, and how soft.
KNEES = (0.5, 1.0), (0.7, 0.1), (0.85, 0.1)
LIMITS = (1e-4, 1e5)


def _observable(extent: Extent) -> bool:
    return extent.command_sizes >= SIZES


def _bounds(extent: Extent) -> dict[str, tuple[float, float]]:
    # Beyond the largest command nothing is lost, and far below it all is a gain.
    low, high = (min(max(share * extent.command, LIMITS[0]), LIMITS[1]) for share in (0.1, 1.2))
    return {"limit": (low, high)} if low < high else {}


def _grid(extent: Extent) -> tuple[dict[str, float], ...]:
    return tuple({"limit": share * extent.command, "softness": soft} for share, soft in KNEES)


class AmplifierSaturation(AbstractEffect, CommandTerm):
    r"""$|u| \to |u| - r\,[e(|u|) - e(0)]$ with $e(x) = \frac12 \{x - L + \sqrt{(x - L)^2 + (w L)^2}\}$, the sign of u kept.

    Of what is beyond the limit L the share r is lost: with r = 1 and a small w a clipping at L, with a large w a gain that falls gently.
    """

    lost: Scalar = parameter("-", 0.0, 1.0, "r: share of the command beyond the limit that is lost", default=0.0)
    limit: Scalar = parameter(
        "-", *LIMITS, "L: limit, a number of V, A, W or duty as the drive's channel is", default=1.0
    )
    softness: Scalar = parameter("-", 0.01, 1.5, "w: how soft the knee is, over the limit", default=0.1)

    effect_name: ClassVar[str] = "amplifier_saturation"
    candidate: ClassVar[Candidate] = Candidate(
        title="saturation of the amplifier",
        equation="electrical",
        formula="|u| -> |u| - r [e(|u|) - e(0)], e(x) = {x - L + sqrt((x - L)^2 + (w L)^2)}/2 (a clipping, smoothed)",
        sentence="The amplifier or its supply is near the end of its range: of a large command less comes through.",
        switches=("lost",),
        initial_guess={"lost": 0.3, "limit": 1.0, "softness": 0.1},
        applies=has_command,
        observable=_observable,
        bounds=_bounds,
        grid=_grid,
        prior_class="bench",
        widths={
            "lost": Width(0.5, "from a gain that falls to a supply that clips"),
            "limit": Width(
                0.5, "below the largest command, or nothing is lost", of="command", logarithmic=True, base=0.7
            ),
            "softness": Width(
                1.5,
                "a transistor stage clips within a tenth, a battery falls over all of its range",
                logarithmic=True,
                base=0.2,
            ),
        },
    )

    def command(self, channel: str, value: Scalar) -> Scalar:
        # [e(|u|) - e(0)]/|u| in a form that has its value and slope at zero.
        size, knee = jnp.abs(value), self.softness * self.limit
        far, near = (jnp.sqrt((one - self.limit) ** 2 + knee**2) for one in (size, 0.0))
        return value * (1.0 - 0.5 * self.lost * (1.0 + (size - 2.0 * self.limit) / (far + near)))
