"""A wire that hangs loose at first: it has to shorten before it pulls."""

from __future__ import annotations

from typing import ClassVar

from smajax.core.parameters import parameter
from smajax.model.effects.base import AbstractEffect
from smajax.model.effects.candidate import Actuator, Candidate, Width
from smajax.model.load.base import AbstractMovingLoad
from smajax.model.load.mounting import MountingTerm
from smajax.model.types import Scalar


def _applies(system: Actuator) -> bool:
    load = system.load
    return isinstance(load, AbstractMovingLoad) and bool(float(load.limits()[0]) >= float(load.start()))


class LooseStart(AbstractEffect, MountingTerm):
    r"""$l = l_0 (1 + \varepsilon) + s$ at the start, where l is the way that the wire spans: no stress until it has shortened by s.

    Of a load that rests on its end stop, which carries it until then. A length below the wire's elastic one takes that much
    off the stress at rest. Each run begins with it anew.
    """

    length: Scalar = parameter(
        "m", 0.0, 0.05, "s: by how much the cold wire is too long at the start of a run", default=0.0
    )

    effect_name: ClassVar[str] = "loose_start"
    candidate: ClassVar[Candidate] = Candidate(
        title="wire that is loose at the start",
        equation="mechanics",
        formula="strain = eps - s/l_0 in eq. 3.7, sigma = 0 until it is no longer negative (kinematics of a wire that is too long)",
        sentence="The wire is mounted too long, or has been stretched: the load stays on its stop until the slack is taken up, and "
        "reaches it again before the wire is cold.",
        switches=("length",),
        initial_guess={"length": 5e-4},
        applies=_applies,
        prior_class="event",
        widths={
            "length": Width(1e-3, "mounting by hand: some tenths of a millimetre to 2 mm"),
        },
    )

    def loose_length(self) -> Scalar | float:
        return self.length
