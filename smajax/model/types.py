"""Shared array types and the records that travel through a simulation."""

from __future__ import annotations

import warnings
from collections.abc import Mapping

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

Scalar = Float[Array, ""]
Series = Float[Array, " time"]
Sampled = Float[Array, "*time"]  # of one instant, or of all of them
Inputs = Mapping[str, Scalar]  # one value per input channel, SI, held over one step


class WireState(eqx.Module):
    """Memory of one wire between two steps."""

    temperature: Scalar  # C
    stress: Scalar  # Pa, tension positive, never negative: a wire cannot push
    strain: Scalar  # -, the wire's own strain; larger than the geometric one while the wire is slack
    martensite_fraction: Scalar  # -, 1 = all martensite
    xi_M: Scalar  # amplitude of the martensite-to-austenite curve, eq. 3.3
    xi_A: Scalar  # floor of the austenite-to-martensite curve, eq. 3.5
    heating_missed: Scalar  # xi_M that counts again if the wire comes back, where the conditions keep it from its curve; -1: not known; else 0
    cooling_missed: Scalar  # 1 - xi_A, likewise. Meanwhile xi_M and xi_A are of curves through the present state
    detwinned_fraction: Scalar  # xi_s: the part of the martensite that gives strain, all of it without Brinson's split
    formed_by_loading: Scalar  # 1 where loading, not cooling, formed the martensite last; else 0
    history: dict[str, Scalar] = eqx.field(default_factory=dict)  # of effects (`wire/history.py`); mostly empty

    @property
    def kept(self) -> dict[str, Scalar]:
        """`history`, as version 0.1 called it; until version 0.3."""
        warnings.warn("WireState.kept is WireState.history now", DeprecationWarning, stacklevel=2)
        return self.history


class Motion(eqx.Module):
    """Memory of the load."""

    position: Scalar  # m (rad for an arm), positive when the wire contracts
    velocity: Scalar  # m/s (rad/s)
    # Of each effect of friction: the part of its limit in use, -, -1..1, positive against +velocity.
    friction: dict[str, Scalar] = eqx.field(default_factory=dict)


class State(eqx.Module):
    """Everything that the next step needs."""

    time: Scalar  # s
    wire: WireState
    motion: Motion
    reading: Scalar  # what the sensor shows: m, rad, or - (strain)
    sensor: dict[str, Scalar] = eqx.field(default_factory=dict)  # its history (`sensor_reading.py`); mostly empty
    unsolved: Scalar = eqx.field(default_factory=lambda: jnp.zeros(()))  # stages so far that did not converge


class Trajectory(eqx.Module):
    """A simulated run: the states at t_0 ... t_{n-1}, every array of shape (n,)."""

    time: Series
    temperature: Series
    stress: Series
    strain: Series
    martensite_fraction: Series
    xi_M: Series
    xi_A: Series
    detwinned_fraction: Series
    position: Series
    velocity: Series
    reading: Series
    unsolved: Series  # stages until then whose solver did not converge: 0 in a run to rely on
