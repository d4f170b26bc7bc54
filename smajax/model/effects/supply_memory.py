"""A supply that tires: its voltage falls by the current that it has given of late, and comes back in time."""

from __future__ import annotations

from typing import ClassVar

import jax.numpy as jnp

from smajax.core.parameters import parameter
from smajax.model.drive.base import AbstractDrive
from smajax.model.drive.supply import NO_VOLTAGE, Circuit, SupplyTerm
from smajax.model.effects.base import AbstractEffect
from smajax.model.effects.candidate import Actuator, Candidate, Width, time_constants
from smajax.model.types import Scalar, WireState
from smajax.model.wire.history import DURATION, HistoryTerm, forgotten

REMEMBERED = "supply_current"


def _applies(system: Actuator) -> bool:
    return type(system.drive).drawn_current is not AbstractDrive.drawn_current


class SupplyMemory(AbstractEffect, HistoryTerm, SupplyTerm):
    r"""$U = U_0 - r I_m$, $\tau \dot I_m + I_m = I$: a resistance that the supply shows a time constant late.

    A battery (polarisation), a capacitor behind a weak charger, a supply with a slow regulator. Of a duty the mean current
    counts, of a voltage with `pulsed_voltage` the one that heats as much. A run begins rested. The energy that a closed loop's figures of merit count is that of a rested supply.
    """

    resistance: Scalar = parameter("ohm", 0.0, 10.0, "r: fall of the voltage per ampere given for long", default=0.0)
    time_constant: Scalar = parameter("s", 0.05, 1e3, "tau: time in which the supply tires and recovers", default=2.0)

    effect_name: ClassVar[str] = "supply_memory"
    candidate: ClassVar[Candidate] = Candidate(
        title="supply that tires and recovers",
        equation="electrical",
        formula="U = U_0 - r I_m, tau dI_m/dt + I_m = I in I^2 R of eq. 3.1 (one RC element of a battery's equivalent circuit)",
        sentence="The supply holds its voltage at first and then gives way: the wire gets more power in the first seconds of a step "
        "than later.",
        switches=("resistance",),
        initial_guess={"resistance": 0.1, "time_constant": 2.0},
        needs_time=True,
        grid=time_constants(0.02, 0.1, 0.4),
        applies=_applies,
        prior_class="bench",
        widths={
            "resistance": Width(0.2, "polarisation of small batteries: 0.05 to 0.3 ohm"),
            "time_constant": Width(1.2, "polarisation of batteries and slow regulators: 0.5 to 20 s", logarithmic=True),
        },
    )

    def history_at_start(self, at: WireState) -> dict[str, Scalar]:
        none = jnp.zeros_like(at.temperature)
        return {REMEMBERED: none, DURATION: none}

    def _remembered(self, circuit: Circuit, old: WireState) -> Scalar:
        """I_m at the end of a step in which a rested supply would give the circuit's current, exact for a resistance that stays.

        It recovers no faster than without any current: a wire gives none back.
        """
        before, steps = old.history[REMEMBERED], old.history[DURATION] / self.time_constant
        falls = 1.0 + self.resistance * circuit.per_volt
        nearer = before + (circuit.current / falls - before) * forgotten(steps * falls)
        return jnp.maximum(nearer, before * (1.0 - forgotten(steps)))

    def voltage_share(self, circuit: Circuit, old: WireState | None) -> Scalar | float:
        if old is None:
            return 1.0
        lost, on = self.resistance * self._remembered(circuit, old), circuit.voltage > NO_VOLTAGE
        share = jnp.where(on, 1.0 - lost / jnp.where(on, circuit.voltage, 1.0), 1.0)
        return jnp.where(share > 0.0, share, 0.0)

    def history_after_supply(self, circuit: Circuit, old: WireState) -> dict[str, Scalar]:
        return {REMEMBERED: self._remembered(circuit, old)}
