"""Slack that the wire takes up before it pulls in full."""

from __future__ import annotations

from typing import ClassVar

import jax.numpy as jnp

from smajax.core.parameters import parameter
from smajax.model.effects.base import AbstractEffect
from smajax.model.effects.candidate import Candidate, Width
from smajax.model.types import Scalar, WireState
from smajax.model.wire.constitutive import ConstitutiveTerm
from smajax.model.wire.heat import cross_section
from smajax.model.wire.wire import Wire


class Slack(AbstractEffect, ConstitutiveTerm):
    r"""$\varepsilon \mathrel{+}= (s/l_0)(1 - e^{-F/F_0})$: a path that is s longer once a force of some $F_0$ has pulled it straight.

    Of kinks, knots and crimps that seat themselves. Play without any force would show only where the force on the wire
    can vanish; this is play where $F_0$ is next to nothing.
    """

    length: Scalar = parameter("m", 0.0, 0.02, "s: length that is taken up", default=0.0)
    force: Scalar = parameter("N", 0.01, 100.0, "F_0: force over which it is taken up", default=1.0)

    effect_name: ClassVar[str] = "slack"
    candidate: ClassVar[Candidate] = Candidate(
        title="slack that is taken up",
        equation="mechanics",
        formula="strain += (s/l_0)[1 - exp(-A_w sigma/F_0)] in eq. 3.7, 3.14 (usual form of a take-up)",
        sentence="The wire first pulls its kinks, knots and crimps straight: the load lags behind the contraction as long as the "
        "force is small.",
        switches=("length",),
        initial_guess={"length": 1e-3, "force": 1.0},
        prior_class="bench",
        widths={
            "length": Width(1e-3, "kinks, knots and crimps: some tenths of a millimetre to 2 mm"),
            "force": Width(1.0, "thin wires straighten at 0.3 to 3 N", logarithmic=True),
        },
    )

    def strain(self, wire: Wire, at: WireState) -> Scalar | float:
        # A solver may try a negative stress, of which the exponential knows no end.
        force = cross_section(wire) * jnp.where(at.stress < 0.0, 0.0, at.stress)
        return self.length / wire.wire_length * (1.0 - jnp.exp(-force / self.force))
