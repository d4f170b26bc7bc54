"""What a controller is told once a period: measured, estimated or, in a study, true."""

from __future__ import annotations

import equinox as eqx
import jax.numpy as jnp

from smajax.core.parameters import parameter
from smajax.model.types import Sampled, Scalar, State


class MeasuredState(eqx.Module):
    """Position and what an estimator makes of it. A controller that measures the position only reads nothing else.

    Of one period, or arrays of shape (n,) of a run.
    """

    position: Sampled  # rad, m
    velocity: Sampled  # rad/s, m/s
    stress: Sampled  # Pa
    temperature: Sampled  # C
    martensite_fraction: Sampled  # -
    xi_M: Sampled  # amplitude of the heating curve in force (eq. 3.3)
    xi_A: Sampled  # floor of the cooling curve in force (eq. 3.5)


def truth(state: State) -> MeasuredState:
    """What a perfect estimator would say."""
    wire = state.wire
    return MeasuredState(
        state.motion.position,
        state.motion.velocity,
        wire.stress,
        wire.temperature,
        wire.martensite_fraction,
        wire.xi_M,
        wire.xi_A,
    )


class Sensor(eqx.Module):
    """Position sensor: Gaussian noise, then the steps of its counter."""

    noise_sigma: Scalar = parameter("rad or m", 0.0, 1.0, "standard deviation of a reading", default=0.0)
    quantum: Scalar = parameter("rad or m", 0.0, 1.0, "step between two readings; 0: none", default=0.0)

    def smoothed(self) -> Sensor:
        """Without steps, whose derivative is zero; a rounding's standard deviation, quantum / sqrt(12), is added to the noise."""
        return Sensor(jnp.sqrt(self.noise_sigma**2 + self.quantum**2 / 12.0))

    def reading(self, position: Scalar, noise: Scalar) -> Scalar:
        """`noise` is a standard normal number."""
        noisy = position + self.noise_sigma * noise
        counted = self.quantum > 0.0
        quantum = jnp.where(counted, self.quantum, 1.0)
        return jnp.where(counted, quantum * jnp.round(noisy / quantum), noisy)
