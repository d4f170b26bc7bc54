"""Two rigs under held inputs, and the closed forms that effects are compared with."""

from __future__ import annotations

from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from smajax.model.extended import extended
from smajax.model.presets import build
from smajax.model.system import System
from smajax.simulation.compiled import simulate_compiled

DT = 0.05
RIGS = {
    "dead_weight": (build("flexinol_table_3_2", "dead_weight", "voltage"), "voltage", 7.4),
    "bias_spring": (build("flexinol_ht_500um", "bias_spring", "duty"), "duty", 0.35),
}


def levels(channel: str, top: float) -> dict[str, jax.Array]:
    shares = [jnp.full(120, 1.0), jnp.full(60, 0.6), jnp.full(60, 0.95), jnp.full(120, 0.0)]
    return {channel: top * jnp.concatenate(shares)}


def heat_lost(system: System, temperature: Any) -> Any:
    """h_c A_c (T - T_inf), W/m: what keeps the wire at `temperature`."""
    heat = system.wire.heat
    surface = np.pi * float(system.wire.wire_diameter)
    return float(heat.convection_coefficient) * surface * (temperature - float(heat.ambient_temperature))


def settled(
    effect: str, values: dict[str, float], rig: str = "dead_weight", seconds: int = 60, **held: float
) -> tuple[System, Any]:
    """(system, its state at the end) after a while with inputs held, from cold."""
    system = RIGS[rig][0]
    full = extended(system, (effect,), {f"{effect}.{name}": value for name, value in values.items()})
    run = simulate_compiled(full, {name: jnp.full(10 * seconds + 1, value) for name, value in held.items()}, 0.1)
    return full, jax.tree.map(lambda series: float(series[-1]), run)


def resistance(system: System, fraction: Any) -> Any:
    law, area = system.wire.resistance, 0.25 * np.pi * float(system.wire.wire_diameter) ** 2
    resistivity = (1.0 - fraction) * float(law.resistivity_austenite) + fraction * float(law.resistivity_martensite)
    return resistivity / area * float(system.wire.wire_length)
