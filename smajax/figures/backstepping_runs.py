"""The arm under backstepping control: the plant that section 4.8 is written for, and batches of runs on it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TypeVar

import equinox as eqx
import jax
import jax.numpy as jnp

from smajax.closed_loop import ClosedLoop, simulate_closed_loop
from smajax.controller.base import AbstractController
from smajax.controller.inverse_wire import fraction_for, temperature_for
from smajax.figures.rigs import Recorded, arm, recorded
from smajax.load.base import AbstractMovingLoad
from smajax.parameters import set_parameters
from smajax.reference import clock, constant
from smajax.system import System, initial_state
from smajax.types import Motion, Scalar, State
from smajax.wire.constitutive import IntegratedForm
from smajax.wire.heat import cross_section
from smajax.wire.wire import start

Tree = TypeVar("Tree")
PERIOD = 0.01  # s


def plant() -> System:
    """The arm with the constitutive law that the section prints: integrated, and without a thermal term (eq. 4.51)."""
    return set_parameters(arm(form=IntegratedForm()), {"thermal_modulus": 0.0})


def on_heating_curve(system: System, position: Scalar, velocity: Scalar) -> State:
    """The arm at an angle with a velocity; the wire carries its weight, on the heating curve of cold martensite."""
    load = system.load
    assert isinstance(load, AbstractMovingLoad)
    rest = initial_state(system, system.drive.from_voltage(jnp.zeros(())))
    stress = load.resistance(position, jnp.zeros_like(position), {}) / (load.lever() * cross_section(system.wire))
    fraction = fraction_for(system, position, stress)
    one, zero = jnp.ones_like(position), jnp.zeros_like(position)
    edge = jnp.asarray(1e-9)
    temperature = temperature_for(system.wire.kinetics, fraction, stress, one > 0.0, one, zero, edge)
    strain = -load.contraction(system.wire) * (position - load.start())
    wire = start(system.wire, (), temperature, stress, strain, fraction)
    return State(rest.time, wire, Motion(position, velocity, zero), position)


def stacked(trees: Sequence[Tree]) -> Tree:
    """One tree of arrays (runs, ...) of many trees of one shape."""
    stack: Tree = jax.tree.map(lambda *leaves: jnp.stack([jnp.asarray(leaf) for leaf in leaves]), *trees)
    return stack


@eqx.filter_jit
def _runs(
    systems: System, controllers: AbstractController, targets: jax.Array, initial: State | None, seconds: float
) -> ClosedLoop:
    time = clock(seconds, PERIOD)

    def one(system: System, controller: AbstractController, target: Scalar, initial: State | None) -> ClosedLoop:
        return simulate_closed_loop(system, controller, constant(time, target), PERIOD, initial=initial)

    return jax.vmap(one)(systems, controllers, targets, initial)


def runs(
    systems: Sequence[System],
    controllers: Sequence[AbstractController],
    targets: Sequence[float],
    seconds: float,
    initial: State | None = None,
) -> Recorded:
    """A batch, one set point (degrees), system and controller a run; `initial` has one state a run too."""
    return recorded(_runs(stacked(systems), stacked(controllers), jnp.radians(jnp.asarray(targets)), initial, seconds))
