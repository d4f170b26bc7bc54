"""What sensors beside the load's own can show of a simulated run."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from types import MappingProxyType
from typing import TypeVar

import jax
import jax.numpy as jnp
import numpy as np

from smajax.model.load.base import AbstractMovingLoad
from smajax.model.system import System
from smajax.model.types import Series, Trajectory
from smajax.model.wire.heat import cross_section
from smajax.model.wire.resistance import resistance_per_metre

Tree = TypeVar("Tree")
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


def own_sensor(system: System, name: str) -> bool:
    """Whether that is the load's own sensor, which may be called by its name or `reading`."""
    return name in ("reading", system.load.reading[0])


def sensor_output(system: System, run: Trajectory, name: str) -> Series:
    """What the sensor `name` shows of `run`, shape (n,): force A_w sigma, resistance R(xi) l_0 (eq. 3.15); the load's own by `own_sensor`."""
    if own_sensor(system, name):
        return run.reading
    wire, stress, at = _known((system.wire, run.stress, (run.temperature, run.martensite_fraction)))
    if name == "force":
        return jnp.asarray(stress * cross_section(wire))
    if name == "resistance":
        terms = system.terms.resistance
        ohms = partial(resistance_per_metre, wire, terms)
        return jnp.asarray((jax.vmap(ohms)(*at) if terms else ohms(*at)) * wire.wire_length)
    return getattr(run, name)


def _known(tree: Tree) -> Tree:
    """With arrays of numpy, where nothing is traced: by JAX each operation is a program for every length of a run, compiled for 20 ms."""
    traced = any(isinstance(one, jax.core.Tracer) for one in jax.tree.leaves(tree))
    return tree if traced else jax.tree.map(np.asarray, tree)
