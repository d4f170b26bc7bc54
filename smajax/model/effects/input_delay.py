"""A recorded input that acted later than the log says."""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar

from smajax.core.parameters import parameter
from smajax.model.effects.base import AbstractEffect
from smajax.model.load.coupon import AbstractCoupon
from smajax.model.types import Scalar

if TYPE_CHECKING:
    from smajax.model.system import System


class InputDelay(AbstractEffect):
    r"""$u(t) = u_{rec}(t - \tau)$; between samples the mean over a step of the held input, a straight line in $\tau$.

    On a whole recorded series (`simulate`, a batch or a fit); a closed loop has a delay of its own.
    """

    delay: Scalar = parameter("s", -0.5, 2.0, "tau; < 0: the log is late")

    effect_name: ClassVar[str] = "input_delay"
    title: ClassVar[str] = "delay of the recorded input"
    equation: ClassVar[str] = "input"
    formula: ClassVar[str] = "u(t) = u_recorded(t - tau)"
    sentence: ClassVar[str] = (
        "The input and the sensor were not logged on the same clock: what the log shows acted a little later (or earlier)."
    )
    switches: ClassVar[tuple[str, ...]] = ("delay",)
    needs_time: ClassVar[bool] = True
    starts: ClassVar[dict[str, float]] = {"delay": 0.03}

    @classmethod
    def base(cls) -> InputDelay:
        return cls(delay=0.0)

    @classmethod
    def applies(cls, system: System) -> bool:
        return bool(system.drive.inputs_required) or isinstance(system.load, AbstractCoupon)

    def input_lag(self, time: Scalar) -> Scalar | float:
        return self.delay
