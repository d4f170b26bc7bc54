"""A supply that tires: its voltage falls by the current that it has given of late, and comes back in time."""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar

import jax.numpy as jnp

from smajax.core.parameters import parameter
from smajax.model.drive.base import AbstractDrive
from smajax.model.effects.base import AbstractEffect, Extent
from smajax.model.types import Scalar, WireState
from smajax.model.wire.history import DURATION, forgotten

if TYPE_CHECKING:
    from smajax.model.system import System

REMEMBERED = "supply_current"


class SupplyMemory(AbstractEffect):
    r"""$U = U_0 - r I_m$, $\tau \dot I_m + I_m = I$: a resistance that the supply shows a time constant late.

    A battery (polarisation), a capacitor behind a weak charger, a supply with a slow regulator. Of a duty the mean current
    counts, of a voltage with `pulsed_voltage` the one that heats as much. A run begins rested. The energy that a closed loop's figures of merit count is that of a rested supply.
    """

    resistance: Scalar = parameter("ohm", 0.0, 10.0, "r: fall of the voltage per ampere given for long")
    time_constant: Scalar = parameter("s", 0.05, 1e3, "tau: time in which the supply tires and recovers")

    effect_name: ClassVar[str] = "supply_memory"
    title: ClassVar[str] = "supply that tires and recovers"
    equation: ClassVar[str] = "electrical"
    formula: ClassVar[str] = (
        "U = U_0 - r I_m, tau dI_m/dt + I_m = I in I^2 R of eq. 3.1 (one RC element of a battery's equivalent circuit)"
    )
    sentence: ClassVar[str] = (
        "The supply holds its voltage at first and then gives way: the wire gets more power in the first seconds of a step "
        "than later."
    )
    switches: ClassVar[tuple[str, ...]] = ("resistance",)
    needs_time: ClassVar[bool] = True
    starts: ClassVar[dict[str, float]] = {"resistance": 0.1, "time_constant": 2.0}

    @classmethod
    def base(cls) -> SupplyMemory:
        return cls(resistance=0.0, time_constant=2.0)

    @classmethod
    def places(cls, extent: Extent) -> tuple[dict[str, float], ...]:
        return tuple({"time_constant": share * extent.seconds} for share in (0.02, 0.1, 0.4))

    @classmethod
    def applies(cls, system: System) -> bool:
        return type(system.drive).drawn_current is not AbstractDrive.drawn_current

    def kept_at_start(self, temperature: Scalar, stress: Scalar, fraction: Scalar) -> dict[str, Scalar]:
        none = jnp.zeros_like(temperature)
        return {REMEMBERED: none, DURATION: none}

    def _remembered(self, old: WireState, current: Scalar, per_volt: Scalar) -> Scalar:
        """I_m at the end of a step in which a rested supply would give `current`, exact for a resistance that stays.

        It recovers no faster than without any current: a wire gives none back.
        """
        before, steps = old.kept[REMEMBERED], old.kept[DURATION] / self.time_constant
        falls = 1.0 + self.resistance * per_volt
        nearer = before + (current / falls - before) * forgotten(steps * falls)
        return jnp.maximum(nearer, before * (1.0 - forgotten(steps)))

    def supply_drop(self, old: WireState, current: Scalar, per_volt: Scalar) -> Scalar:
        return self.resistance * self._remembered(old, current, per_volt)

    def kept_after_current(self, old: WireState, current: Scalar, per_volt: Scalar) -> dict[str, Scalar]:
        return {REMEMBERED: self._remembered(old, current, per_volt)}
