"""The simulator's state as a filter sees it: four numbers that it corrects, and the rest kept consistent with them."""

from __future__ import annotations

import dataclasses

import jax.numpy as jnp
from jaxtyping import Array, Bool, Float

from smajax.core.limited import limited
from smajax.model.load.base import AbstractMovingLoad
from smajax.model.system import System
from smajax.model.types import Motion, Scalar, State
from smajax.model.wire.constitutive import reached, stress_at
from smajax.model.wire.history import over
from smajax.model.wire.two_populations import corrected, moved
from smajax.simulation.input_delay import refuse_lag
from smajax.simulation.step import step

# Position (rad, m), velocity, temperature (C), martensite fraction.
Corrected = Float[Array, "4"]


def vector_of(state: State) -> Corrected:
    """What a filter corrects."""
    wire, motion = state.wire, state.motion
    return jnp.stack([motion.position, motion.velocity, wire.temperature, wire.martensite_fraction])


def with_vector(system: System, state: State, vector: Corrected) -> State:
    """`state` with the four numbers put in, held between the end stops and in [0, 1].

    Strain follows from the position and stress from the constitutive law, which counts from `state`. The curves of the
    kinetics stay: on a branch the fraction belongs to the temperature, which is how a reading of the position tells it.
    """
    load, wire, terms, old = system.load, system.wire, system.terms, over(state.wire, 0.0)
    assert isinstance(load, AbstractMovingLoad)
    position = limited(vector[0], *load.limits())
    velocity, temperature, fraction = vector[1], vector[2], limited(vector[3], 0.0, 1.0)
    strain = -load.contraction(wire) * (position - load.start())
    stress = stress_at(wire, terms.constitutive, old, strain, temperature, old.stress, fraction)
    new = moved(terms.kinetics, old, reached(wire, terms.constitutive, old, temperature, stress, fraction))
    motion = Motion(position, velocity, state.motion.friction)
    return dataclasses.replace(state, wire=new, motion=motion)


def with_correction(system: System, state: State, vector: Corrected, transforming: Bool[Array, ""]) -> State:
    """`with_vector`, and the curves laid so that the corrected fraction does not jump in the next step."""
    new = with_vector(system, state, vector)
    wire = corrected(system.wire.kinetics, system.terms.kinetics, state.wire, new.wire, transforming)
    return dataclasses.replace(new, wire=wire)


def within_one(state: State) -> State:
    """`state`, whose heating curve begins at all martensite at most.

    An amplitude beyond 1 is no branch of any wire: it is a temperature believed too high while the wire rests on its curve.
    """
    wire = state.wire
    beyond_one = (wire.xi_M > 1.0) & (wire.heating_missed == 0.0)
    return dataclasses.replace(
        state, wire=dataclasses.replace(wire, xi_M=jnp.where(beyond_one, jnp.ones_like(wire.xi_M), wire.xi_M))
    )


def advanced(system: System, state: State, voltage: Scalar, period: Scalar, substeps: int) -> State:
    """The simulator's own steps through one period with `voltage` held."""
    refuse_lag(system, "a filter")
    inputs = system.drive.from_command(voltage)
    for _ in range(substeps):
        state = step(system, state, inputs, period / substeps)
    return state
