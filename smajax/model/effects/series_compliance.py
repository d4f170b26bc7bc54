"""A spring between wire and load: clamps, rope, frame."""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar

from smajax.core.parameters import parameter
from smajax.model.effects.base import AbstractEffect
from smajax.model.types import Scalar
from smajax.model.wire.heat import cross_section

if TYPE_CHECKING:
    from smajax.model.wire.wire import Wire


class SeriesCompliance(AbstractEffect):
    r"""$x_{load} = x_{wire} - c F$ with $F = A_w \sigma$, as strain of the path: $\varepsilon \mathrel{+}= c A_w \sigma/l_0$ (Hooke).

    The strain that the model shows is then that of the whole path, wire and spring.
    """

    compliance: Scalar = parameter("m/N", 0.0, 1e-2, "c: one over the stiffness of what lies between wire and load")

    effect_name: ClassVar[str] = "series_compliance"
    title: ClassVar[str] = "compliance in series with the wire"
    equation: ClassVar[str] = "mechanics"
    formula: ClassVar[str] = "strain += c A_w sigma/l_0 in eq. 3.7, 3.14: x_load = x_wire - c F (Hooke)"
    sentence: ClassVar[str] = (
        "Clamps, rope or frame give way under force: the load moves by less than the wire contracts when the force "
        "rises on the way, and sags when it is loaded."
    )
    switches: ClassVar[tuple[str, ...]] = ("compliance",)
    starts: ClassVar[dict[str, float]] = {"compliance": 1e-4}

    @classmethod
    def base(cls) -> SeriesCompliance:
        return cls(compliance=0.0)

    def strain(
        self, wire: Wire, temperature: Scalar, stress: Scalar, fraction: Scalar, detwinned: Scalar
    ) -> Scalar | float:
        return self.compliance * cross_section(wire) * stress / wire.wire_length
