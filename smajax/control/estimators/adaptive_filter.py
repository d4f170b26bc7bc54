r"""The filter `model_filter` that also estimates parameters of the plant it believes in, such as the convection.

A parameter p that is believed wrongly is a state as position and temperature are: the logarithm of its ratio to the believed value,
q = ln(p / p_0), which has no unit and keeps p positive. From one reading to the next, a period apart,

    x_{k+1} = f(x_k, p_0 exp q_k) + noise,      q_{k+1} = a q_k + noise of variance (1 - a^2) sigma^2,      a = exp(-period / tau),

with f the simulator's own step: joint estimation of state and parameters by an extended Kalman filter (Jazwinski 1970, sec. 8.4), the parameters as Gauss-Markov
processes (Gelb 1974, sec. 2.2). Before anything is known, and long after, q has the standard deviation sigma; so nothing grows where a parameter moves nothing that is
read, as damping and inertia at rest. The derivative of f says how q moves what is read, so a reading corrects it. No equation of any load is written down here: any
parameter of the believed system, by name.
"""

from __future__ import annotations

import dataclasses

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float

from smajax.control.estimators.base import AbstractEstimator
from smajax.control.estimators.believed_state import advanced, vector_of, with_vector
from smajax.control.estimators.kalman import Belief, Innovation, Matrix, Vector, corrected
from smajax.control.estimators.model_filter import ModelFilter, none_yet, remembered, unexplained
from smajax.control.measured_state import MeasuredState, truth
from smajax.core.limited import limited
from smajax.core.parameters import get_parameters, parameter, set_vector
from smajax.model.system import System
from smajax.model.types import Scalar, State
from smajax.model.wire.branch_amplitude import beyond

STATES = 4  # of the filter below: position, velocity, temperature, martensite fraction
LARGEST = 1.0  # of a logarithm: 0.37 to 2.7 times the believed value


class AdaptiveFilterMemory(eqx.Module):
    """What `ModelFilterMemory` has, and the parameters."""

    state: State
    logarithms: Float[Array, " parameters"]  # of the ratios to the believed values
    covariance: Matrix  # of position, velocity, temperature, martensite fraction, logarithms
    innovation: Innovation


class AdaptiveFilter(AbstractEstimator):
    """`filter` with the parameters `estimated` of its believed system as further states, all with one sigma and one tau."""

    filter: ModelFilter
    ratio_error: Scalar = parameter(
        "-", 0.0, 1.0, "sigma: standard deviation of the logarithm of an estimated parameter"
    )
    ratio_time: Scalar = parameter("s", 1e-3, 1e9, "tau: time after which an estimated parameter may be another")
    estimated: tuple[str, ...] = eqx.field(static=True, default=("convection_coefficient",))

    def with_reading_noise(self, noise: float) -> AdaptiveFilter:
        return dataclasses.replace(self, filter=self.filter.with_reading_noise(noise))

    def start(self, reading: Scalar) -> tuple[AdaptiveFilterMemory, MeasuredState]:
        rest, belief = self.filter.belief_at_rest(reading)
        nothing = jnp.zeros(len(self.estimated), belief.mean.dtype)
        errors = jnp.concatenate([jnp.diag(belief.covariance), self.ratio_error**2 + nothing])
        belief = Belief(jnp.concatenate([belief.mean, nothing]), jnp.diag(errors))
        return self._read(rest, belief, jnp.zeros_like(reading, bool), reading, none_yet(reading))

    def step(
        self, memory: AdaptiveFilterMemory, reading: Scalar, voltage: Scalar, period: Scalar
    ) -> tuple[AdaptiveFilterMemory, MeasuredState]:
        kept = jnp.exp(-period / self.ratio_time)

        def transition(vector: Vector) -> tuple[Vector, State]:
            system = self.believed(vector[STATES:])
            before = with_vector(system, memory.state, vector[:STATES])
            after = advanced(system, before, voltage, period, self.filter.substeps)
            return jnp.concatenate([vector_of(after), kept * vector[STATES:]]), after

        before = Belief(jnp.concatenate([vector_of(memory.state), memory.logarithms]), memory.covariance)
        wander = (1.0 - kept**2) * self.ratio_error**2 + jnp.zeros_like(memory.logarithms)
        noise = jnp.concatenate([self.filter.walks() ** 2 * period, wander])
        belief, after = self.filter.prediction.predicted(transition, before, jnp.diag(noise))
        transforming = beyond(jnp.abs(after.wire.martensite_fraction - memory.state.wire.martensite_fraction))
        return self._read(after, belief, transforming, reading, memory.innovation)

    def believed(self, logarithms: Float[Array, " parameters"]) -> System:
        """The system with its estimated parameters put in."""
        system = self.filter.system
        return set_vector(system, self.estimated, get_parameters(system, self.estimated) * jnp.exp(logarithms))

    def _read(
        self, state: State, belief: Belief, transforming: Bool[Array, ""], reading: Scalar, last: Innovation
    ) -> tuple[AdaptiveFilterMemory, MeasuredState]:
        """Correct by the reading; a parameter stays within a factor of e of what is believed."""
        position = jnp.zeros_like(belief.mean).at[0].set(1.0)
        belief, innovation = corrected(belief, reading, position, self.filter.reading_noise**2)
        logarithms = limited(belief.mean[STATES:], -LARGEST, LARGEST)
        system = self.believed(logarithms)
        lost = unexplained(last, innovation) & ~transforming
        innovation = remembered(last, innovation, reading)
        state = self.filter.consistent(system, state, belief.mean[:STATES], transforming, lost)
        covariance = self.filter.widened(belief.covariance, lost)
        return AdaptiveFilterMemory(state, logarithms, covariance, innovation), truth(state)
