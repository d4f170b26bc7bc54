"""Kalman filter over the simulator's own step: position, velocity, temperature and martensite fraction corrected.

The transition is `smajax.simulation.step.step`, its derivative what automatic differentiation makes of it (or none, with the
unscented prediction). So whatever the believed system has - a law, an effect, an end stop - is in the filter.
"""

from __future__ import annotations

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Bool

from smajax.control.estimators.base import AbstractEstimator
from smajax.control.estimators.believed_state import (
    Corrected,
    advanced,
    vector_of,
    with_correction,
    with_vector,
    within_one,
)
from smajax.control.estimators.kalman import (
    AbstractPrediction,
    Belief,
    Innovation,
    Linearised,
    Matrix,
    Vector,
    corrected,
)
from smajax.control.measured_state import MeasuredState, truth
from smajax.core.parameters import parameter, set_parameters
from smajax.model.system import System, initial_state
from smajax.model.types import Scalar, State
from smajax.model.wire.branch_amplitude import beyond

# Standard deviations of an innovation, from which on, twice in a row on the same side, the wire has transformed where its believed curves had
# nothing to transform. Twice, since one wrong reading is a glitch of the sensor as likely as a lost branch: after a glitch the correction has gone
# too far, and the next innovation is on the other side. This is no error rate: innovations of a model with wrong parameters are not white (with
# the air 3 K warmer their autocorrelation is some 0.5 from one reading to the next), and two in a row are then no rarity.
UNEXPLAINED = 5.0
# By how much temperature (K) and fraction may then be off beside what the filter believed: without it the filter that has lost its branch is too
# sure of its fraction to follow the readings, and the curves go through the wrong state. Not where it believes that the wire transforms: there the
# curves go with every correction, and are no less certain for it.
OFF_BRANCH = (1.0, 3e-3)

# Share by which a noise may differ from the one that a filter has and still be that one: the preset of `adaptive` is 3.2e-5 of the wire's length, which on the
# arm is 0.10001 deg, and loops with 0.1 deg are to go on as they went.
SAME_NOISE = 1e-3


def none_yet(reading: Scalar) -> Innovation:
    """The innovation before the first reading: it tells nothing."""
    return Innovation(jnp.zeros_like(reading), jnp.ones_like(reading))


def remembered(last: Innovation, now: Innovation, reading: Scalar) -> Innovation:
    """The innovation that the next one is held against: a missing reading has none."""
    missing = jnp.isnan(reading)
    return Innovation(jnp.where(missing, last.value, now.value), jnp.where(missing, last.variance, now.variance))


def unexplained(last: Innovation, now: Innovation) -> Bool[Array, ""]:
    """Whether two innovations in a row are beyond `UNEXPLAINED` standard deviations on the same side."""
    both = jnp.minimum(last.value**2 / last.variance, now.value**2 / now.variance) > UNEXPLAINED**2
    return both & (last.value * now.value > 0.0)


class ModelFilterMemory(eqx.Module):
    """The believed state after the last reading, how far it may be off, and what that reading was off by."""

    state: State
    covariance: Matrix  # of position, velocity, temperature, martensite fraction
    innovation: Innovation  # at the start, against the load at rest


class ModelFilter(AbstractEstimator):
    """`system` is the plant that the filter believes in; its load moves and its drive takes a voltage.

    Noise enters the four numbers as random walks, whose variance grows with the time: it stands for what the believed
    system has wrong. `substeps` are the simulator's steps in one period.
    """

    system: System
    reading_noise: Scalar = parameter("rad or m", 1e-9, 1.0, "standard deviation of a reading")
    position_walk: Scalar = parameter("rad/s^0.5 or m/s^0.5", 0.0, 1e2, "random walk of the position")
    velocity_walk: Scalar = parameter("rad/s^1.5 or m/s^1.5", 0.0, 1e4, "random walk of the velocity")
    temperature_walk: Scalar = parameter("K/s^0.5", 0.0, 1e4, "random walk of the temperature")
    fraction_walk: Scalar = parameter("1/s^0.5", 0.0, 1e2, "random walk of the martensite fraction")
    start_temperature: Scalar = parameter("degC", -100.0, 400.0, "temperature believed at the start")
    start_position_error: Scalar = parameter("rad or m", 0.0, 10.0, "standard deviation of the position at the start")
    start_velocity_error: Scalar = parameter("rad/s or m/s", 0.0, 1e2, "of the velocity")
    start_temperature_error: Scalar = parameter("K", 0.0, 1e3, "of the temperature")
    start_fraction_error: Scalar = parameter("-", 0.0, 1.0, "of the martensite fraction")
    prediction: AbstractPrediction = Linearised()
    substeps: int = eqx.field(static=True, default=1)
    # Whether the memory of the branches is held to what a wire can have: xi_M is a fraction, and innovations that nothing explains lay both
    # curves through the corrected state, whose temperature and fraction are then less certain (`unexplained`). Not where xi_M has to stand for
    # a temperature that is degrees off, as with a wrong convection.
    keeps_branches: bool = eqx.field(static=True, default=False)

    def with_reading_noise(self, noise: float) -> ModelFilter:
        same = jnp.abs(self.reading_noise - noise) <= SAME_NOISE * self.reading_noise
        return set_parameters(self, {"reading_noise": jnp.where(same, self.reading_noise, noise)})

    def belief_at_rest(self, reading: Scalar) -> tuple[State, Belief]:
        """(state, belief) before the first reading."""
        rest = initial_state(self.system, self.system.drive.from_command(jnp.zeros_like(reading)))
        # Strain and stress count from the rest at ambient temperature also where the wire is believed to be warm.
        believed = vector_of(rest).at[2].set(self.start_temperature)
        errors = [self.start_position_error, self.start_velocity_error, self.start_temperature_error]
        return rest, Belief(believed, jnp.diag(jnp.stack([*errors, self.start_fraction_error]) ** 2))

    def walks(self) -> Vector:
        """Random walks of position, velocity, temperature and martensite fraction, per root of a second."""
        return jnp.stack([self.position_walk, self.velocity_walk, self.temperature_walk, self.fraction_walk])

    def start(self, reading: Scalar) -> tuple[ModelFilterMemory, MeasuredState]:
        rest, belief = self.belief_at_rest(reading)
        return self._read(rest, belief, jnp.zeros_like(reading, bool), reading, none_yet(reading))

    def step(
        self, memory: ModelFilterMemory, reading: Scalar, voltage: Scalar, period: Scalar
    ) -> tuple[ModelFilterMemory, MeasuredState]:
        def transition(vector: Vector) -> tuple[Vector, State]:
            after = advanced(
                self.system, with_vector(self.system, memory.state, vector), voltage, period, self.substeps
            )
            return vector_of(after), after

        before = Belief(vector_of(memory.state), memory.covariance)
        belief, after = self.prediction.predicted(transition, before, jnp.diag(self.walks() ** 2) * period)
        # Rounding alone does not transform.
        transforming = beyond(jnp.abs(after.wire.martensite_fraction - memory.state.wire.martensite_fraction))
        return self._read(after, belief, transforming, reading, memory.innovation)

    def _read(
        self, state: State, belief: Belief, transforming: Bool[Array, ""], reading: Scalar, last: Innovation
    ) -> tuple[ModelFilterMemory, MeasuredState]:
        """Correct by the reading, and make the rest of the state consistent with what came out."""
        position = jnp.zeros_like(belief.mean).at[0].set(1.0)
        belief, innovation = corrected(belief, reading, position, self.reading_noise**2)
        lost = unexplained(last, innovation) & ~transforming
        innovation = remembered(last, innovation, reading)
        state = self.consistent(self.system, state, belief.mean, transforming, lost)
        return ModelFilterMemory(state, self.widened(belief.covariance, lost), innovation), truth(state)

    def consistent(
        self,
        system: System,
        state: State,
        vector: Corrected,
        transforming: Bool[Array, ""],
        lost: Bool[Array, ""],
    ) -> State:
        """`with_correction`, and what `keeps_branches` says where the branch is `lost`."""
        if not self.keeps_branches:
            return with_correction(system, state, vector, transforming)
        return within_one(with_correction(system, state, vector, transforming | lost))

    def widened(self, covariance: Matrix, lost: Bool[Array, ""]) -> Matrix:
        """`covariance`, of temperature and fraction by `OFF_BRANCH` more where the branch is `lost`."""
        if not self.keeps_branches:
            return covariance
        errors = jnp.zeros(covariance.shape[0], covariance.dtype).at[2:4].set(jnp.asarray(OFF_BRANCH, covariance.dtype))
        return covariance + jnp.where(lost, jnp.diag(errors**2), 0.0)
