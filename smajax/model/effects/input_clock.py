"""A recorded input whose clock runs slow or fast."""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar

from smajax.core.parameters import parameter
from smajax.model.effects.base import AbstractEffect
from smajax.model.load.coupon import AbstractCoupon
from smajax.model.types import Scalar

if TYPE_CHECKING:
    from smajax.model.system import System


class InputClock(AbstractEffect):
    r"""$u(t) = u_{rec}(t (1 - r))$: the log of the input falls behind that of the sensor by r seconds a second.

    On a whole recorded series (`simulate`, a batch or a fit); a closed loop refuses it.
    """

    rate: Scalar = parameter("-", -0.05, 0.05, "r: by how much what acts falls behind the log, per second of the run")

    effect_name: ClassVar[str] = "input_clock"
    title: ClassVar[str] = "wrong clock of the recorded input"
    equation: ClassVar[str] = "input"
    formula: ClassVar[str] = "u(t) = u_recorded(t (1 - r))"
    sentence: ClassVar[str] = (
        "Two recorders with two clocks: input and motion fit at the start of a run and drift apart towards its end."
    )
    switches: ClassVar[tuple[str, ...]] = ("rate",)
    needs_time: ClassVar[bool] = True
    starts: ClassVar[dict[str, float]] = {"rate": 0.005}

    @classmethod
    def base(cls) -> InputClock:
        return cls(rate=0.0)

    @classmethod
    def applies(cls, system: System) -> bool:
        return bool(system.drive.inputs_required) or isinstance(system.load, AbstractCoupon)

    def input_lag(self, time: Scalar) -> Scalar | float:
        return self.rate * time
