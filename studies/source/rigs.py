"""The source's rigs as the figures use them: one choice for all rows of a rig, made in the presets."""

from __future__ import annotations

import dataclasses
from typing import Any

import equinox as eqx
import jax
import numpy as np
from jaxtyping import Array, Float

from smajax.control.closed_loop import ClosedLoop, simulate_closed_loop
from smajax.control.presets import stress_sliding
from smajax.model.presets import build
from smajax.model.system import System
from smajax.model.types import Series, Trajectory
from smajax.model.wire.constitutive import AbstractForm, IntegratedForm, RateForm
from smajax.model.wire.laws import under_law
from smajax.simulation.simulate import simulate

Batched = Float[Array, "runs time"]
# A Trajectory (or a ClosedLoop of one) whose arrays are numpy's, which the type of a jax array does not say.
Recorded = Any

LAWS = ("tanaka", "liang", "brinson", "enhanced")


def arm(law: str = "enhanced", form: AbstractForm | None = None) -> System:
    """The rotary arm of section 3.1, with the rate form (eq. 3.2) of the constitutive law, as section 3.3 has it."""
    return _formed(_under(build("niti_table_3_1", "arm", "amplified_voltage"), law), form or RateForm())


def dead_weight(law: str = "enhanced", form: AbstractForm | None = None) -> System:
    """The hanging mass of section 3.5.

    With the integrated form (eq. 4.51) of the constitutive law: under the rate form a cycle does not close (M11).
    """
    return _formed(_under(build("flexinol_table_3_2", "dead_weight", "flexinol_voltage"), law), form)


def coupon(law: str = "enhanced", load: str = "coupon", form: AbstractForm | None = None) -> System:
    """The wire of Table 3.2 on a prescribed path of temperature and stress (or strain), integrated form."""
    return _formed(_under(build("flexinol_table_3_2", load, "none"), law), form)


def _formed(system: System, form: AbstractForm | None) -> System:
    constitutive = dataclasses.replace(system.wire.constitutive, form=form or IntegratedForm())
    return dataclasses.replace(system, wire=dataclasses.replace(system.wire, constitutive=constitutive))


def _under(system: System, law: str) -> System:
    return dataclasses.replace(system, wire=under_law(system.wire, law))


def recorded(run: Trajectory | ClosedLoop) -> Recorded:
    """The same record in numpy, for checks and pictures."""
    return jax.tree.map(np.asarray, run)


@eqx.filter_jit
def _simulated(system: System, inputs: dict[str, Series], dt: float) -> Trajectory:
    return simulate(system, inputs, dt)


def simulated(system: System, inputs: dict[str, Series], dt: float) -> Recorded:
    """One run, compiled, in numpy."""
    return recorded(_simulated(system, inputs, dt))


@eqx.filter_jit
def _batch(system: System, inputs: dict[str, Batched], dt: float) -> Trajectory:
    return jax.vmap(lambda one: simulate(system, one, dt))(inputs)


def batch(system: System, inputs: dict[str, Batched], dt: float) -> Recorded:
    """Many runs of one system at once: every input, and every array that comes back, of shape (runs, time)."""
    return recorded(_batch(system, inputs, dt))


@eqx.filter_jit
def _controlled(system: System, target: Series, dt: float, every: int) -> ClosedLoop:
    return simulate_closed_loop(system, stress_sliding(system), target, dt, every)


def controlled(system: System, target: Series, dt: float, period: float) -> Recorded:
    """The arm under stress-based sliding control, compiled, in numpy."""
    return recorded(_controlled(system, target, dt, round(period / dt)))


def austenite_range(system: System, stress: Any) -> tuple[Any, Any]:
    """(A_s', A_f') at a stress, C: the range moved by sigma/C_A."""
    law = system.wire.kinetics
    shift = stress / float(law.stress_slope_austenite)
    return float(law.austenite_start) + shift, float(law.austenite_finish) + shift


def martensite_range(system: System, stress: Any) -> tuple[Any, Any]:
    """(M_s', M_f') at a stress, C."""
    law = system.wire.kinetics
    shift = stress / float(law.stress_slope_martensite)
    return float(law.martensite_start) + shift, float(law.martensite_finish) + shift
