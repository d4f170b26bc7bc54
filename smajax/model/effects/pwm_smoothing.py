"""Pulses that the circuit smooths: the mean of the square is no longer the duty."""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar

from smajax.core.parameters import parameter
from smajax.model.effects.base import AbstractEffect
from smajax.model.types import Scalar

if TYPE_CHECKING:
    from smajax.model.system import System


class PwmSmoothing(AbstractEffect):
    r"""$d \to d\,[1 - w (1 - d)]$: the heating of hard pulses is d, of a current smoothed throughout $d^2$.

    $\overline{I^2} = \overline{I}^2 + \mathrm{var}\,I$, and smoothing takes the share w of the variance $d (1 - d)$ away.
    """

    share: Scalar = parameter("-", 0.0, 1.0, "w: share of the pulses' variance that inductance or a filter takes away")

    effect_name: ClassVar[str] = "pwm_smoothing"
    title: ClassVar[str] = "smoothed pulse-width modulation"
    equation: ClassVar[str] = "electrical"
    formula: ClassVar[str] = (
        "heating ~ d [1 - w (1 - d)]: mean square of a pulsed current, its variance less by the share w"
    )
    sentence: ClassVar[str] = (
        "An inductance or a filter smooths the pulses: a duty of one half heats by less than half of full power."
    )
    switches: ClassVar[tuple[str, ...]] = ("share",)
    starts: ClassVar[dict[str, float]] = {"share": 0.1}

    @classmethod
    def base(cls) -> PwmSmoothing:
        return cls(share=0.0)

    @classmethod
    def applies(cls, system: System) -> bool:
        return "duty" in system.drive.inputs_required

    def command(self, channel: str, value: Scalar) -> Scalar:
        return value * (1.0 - self.share * (1.0 - value)) if channel == "duty" else value
