"""A coupon led along straight lines of temperature and stress, and wires of any law."""

from __future__ import annotations

import dataclasses

import jax.numpy as jnp
import numpy as np

from smajax.model.presets import build
from smajax.model.system import System
from smajax.model.types import Trajectory
from smajax.model.wire.laws import under_law
from smajax.simulation.compiled import simulate_compiled

EACH = 60  # samples a leg
COUPON = build("flexinol_table_3_2", "coupon", "none")


def under(system: System, law: str = "enhanced", **parts: object) -> System:
    wire = under_law(system.wire, law)
    kinetics = {name: part for name, part in parts.items() if name in ("renewal", "conditions")}
    constitutive = {name: part for name, part in parts.items() if name in ("form", "stiffness")}
    wire = dataclasses.replace(
        wire,
        kinetics=dataclasses.replace(wire.kinetics, **kinetics),
        constitutive=dataclasses.replace(wire.constitutive, **constitutive),
    )
    return dataclasses.replace(system, wire=wire)


def path(levels: list[float]) -> np.ndarray:
    return np.interp(np.arange(EACH * (len(levels) - 1) + 1) / EACH, np.arange(len(levels)), levels)


def driven(system: System, temperature: list[float], stress: list[float]) -> Trajectory:
    return simulate_compiled(
        system, {"temperature": jnp.asarray(path(temperature)), "stress": jnp.asarray(path(stress))}, 1.0
    )
