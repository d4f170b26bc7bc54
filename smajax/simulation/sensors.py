"""What sensors beside the load's own can show of a simulated run."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

import jax
import jax.numpy as jnp
import numpy as np

from smajax.model.load.base import AbstractMovingLoad
from smajax.model.system import System
from smajax.model.types import Series, Trajectory
from smajax.model.wire.heat import cross_section
from smajax.model.wire.resistance import resistance_per_metre

# Name -> the program's own unit. The load's own sensor (position, angle, strain or stress) is the trajectory's `reading`,
# the only one that an effect may delay.
SENSORS: Mapping[str, str] = MappingProxyType(
    {"temperature": "degC", "stress": "Pa", "force": "N", "strain": "-", "resistance": "ohm"}
)


def sensors_of(system: System) -> dict[str, str]:
    """Name -> unit of everything that can be measured on `system`; what is prescribed to a coupon is no output."""
    name, unit = system.load.reading
    if isinstance(system.load, AbstractMovingLoad):
        return {name: unit, **SENSORS}
    return {name: unit, "resistance": SENSORS["resistance"]}


def sensor_output(system: System, run: Trajectory, name: str) -> Series:
    """What the sensor `name` shows of `run`, shape (n,): force A_w sigma, resistance R(xi) l_0 (eq. 3.15).

    The load's own sensor may be called by its name or `reading`.
    """
    if name in ("reading", system.load.reading[0]):
        return run.reading
    if name == "force":
        return run.stress * cross_section(system.wire)
    if name == "resistance":
        at = (run.temperature, run.martensite_fraction)
        if not (
            system.terms.resistance
            or any(isinstance(one, jax.core.Tracer) for one in jax.tree.leaves((system.wire, at)))
        ):
            # By numpy: by JAX each operation is a program of its own for every length of a run, compiled for 20 ms.
            wire = jax.tree.map(np.asarray, system.wire)
            return jnp.asarray(resistance_per_metre(wire, (), *map(np.asarray, at)) * wire.wire_length)
        ohms = jax.vmap(
            lambda temperature, fraction: resistance_per_metre(
                system.wire, system.terms.resistance, temperature, fraction
            )
        )
        return ohms(*at) * system.wire.wire_length
    return getattr(run, name)
