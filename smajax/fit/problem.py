"""Runs, model and noise as one least-squares problem; each lane of a batch frees its own parameters."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int

from smajax.fit.batch import RunBatch, simulate_batch
from smajax.fit.bounds import bounded, unbounded
from smajax.parameters import get_parameters, parameters, set_vector
from smajax.system import System


class Lane(NamedTuple):
    """One fit of a batch. All lanes of a batch have the same number of slots, so that they share one compilation."""

    slots: Int[Array, " slot"]  # index into the parameter vector; the last index is a dummy that nothing reads
    low: Float[Array, " slot"]
    high: Float[Array, " slot"]
    values: Float[Array, " parameter"]  # every parameter of the model, and the dummy at the end
    weights: Float[Array, " run"]  # 0 leaves a run out
    tie: Float[Array, ""]  # pull back to the start, in the residual's unit per unit of the unbounded parameter; 0: none
    scale: Float[Array, ""]  # the residual is divided by this, so that damping of order one means something


class Problem(eqx.Module):
    """A model that carries all candidate effects at their base values, and the runs to fit it to."""

    system: System
    names: tuple[str, ...] = eqx.field(static=True)
    batch: RunBatch
    noise_sigma: Float[Array, ""]
    offset: bool = eqx.field(static=True)

    @classmethod
    def build(cls, system: System, batch: RunBatch, noise_sigma: float | Array, offset: bool) -> Problem:
        return cls(system, tuple(parameters(system)), batch, jnp.asarray(noise_sigma), offset)

    def start_values(self) -> np.ndarray:
        """The model's own values in the order of `names`, and the dummy: shape (P + 1,)."""
        return np.append(np.asarray(get_parameters(self.system, self.names)), 0.0)

    def lane(
        self,
        free: Sequence[str],
        bounds: Mapping[str, tuple[float, float]],
        values: np.ndarray,
        slots: int,
        weights: np.ndarray | None = None,
        tie: float = 0.0,
    ) -> Lane:
        """A lane that frees `free` within `bounds`, starting from `values`; unused slots point at the dummy."""
        if len(free) > slots:
            raise ValueError(f"{len(free)} parameters are to be free but the batch has {slots} slots; ask for more.")
        dummy = len(self.names)
        index = [self.names.index(name) for name in free] + [dummy] * (slots - len(free))
        low = [bounds[name][0] for name in free] + [-1.0] * (slots - len(free))
        high = [bounds[name][1] for name in free] + [1.0] * (slots - len(free))
        runs = self.batch.output.shape[0]
        full = np.ones(runs) if weights is None else weights
        slot = jnp.asarray(index, dtype=int)
        return Lane(slot, *(jnp.asarray(part) for part in (low, high, values, full, tie, 1.0)))

    def with_output(self, output: Float[Array, "run time"] | None) -> Problem:
        """The same with other measured outputs; None: its own."""
        return self if output is None else eqx.tree_at(lambda one: one.batch.output, self, output)

    def system_at(self, values: Float[Array, " parameter"]) -> System:
        return set_vector(self.system, self.names, values[:-1])

    def misfit(self, values: Float[Array, " parameter"]) -> Float[Array, "run time"]:
        """Measured minus simulated, each run's best offset taken off where the experiment declares one; 0 in padding.

        The offset enters linearly, so its best value for any model is the mean misfit: it needs no slot.
        """
        batch = self.batch
        raw = batch.output - simulate_batch(self.system_at(values), batch).reading
        if self.offset:
            # The mask may hold square roots of weights between 0 and 1 (`fit.robust`).
            weight = batch.mask**2
            raw = raw - ((raw * weight).sum(axis=1) / weight.sum(axis=1))[:, None]
        return raw * batch.mask


def values_of(free: Float[Array, " slot"], lane: Lane) -> Float[Array, " parameter"]:
    """The whole parameter vector of a lane."""
    return lane.values.at[lane.slots].set(bounded(free, lane.low, lane.high))


def free_of(lane: Lane) -> Float[Array, " slot"]:
    """Where the solver starts: the lane's own values, moved off their bounds."""
    return unbounded(jnp.asarray(lane.values)[lane.slots], jnp.asarray(lane.low), jnp.asarray(lane.high))


def _weighted(free: Float[Array, " slot"], lane: Lane, problem: Problem) -> Float[Array, " sample"]:
    misfit = problem.misfit(values_of(free, lane)) / problem.noise_sigma
    finite = jnp.where(jnp.isfinite(misfit), misfit, 1e6)  # a lane that blows up loses; it must not stop the others
    runs = (finite * jnp.sqrt(lane.weights)[:, None]).ravel()
    return jnp.concatenate([runs, lane.tie * (free - free_of(lane))]) / lane.scale


@eqx.filter_custom_jvp
def residual(
    free: Float[Array, " slot"], arguments: tuple[Lane, Problem]
) -> tuple[Float[Array, " sample"], Float[Array, ""]]:
    """(misfit over noise and scale, weighted run by run, as one vector; its square): what least squares makes small.

    Its derivative is formed as a whole matrix, in one forward pass: a solver that linearises it then carries that
    matrix and not every intermediate of the simulation, and the model is compiled once instead of three times.
    """
    weighted = _weighted(free, *arguments)
    return weighted, weighted @ weighted


@residual.def_jvp
def _residual_jvp(primals, tangents):  # type: ignore[no-untyped-def]  # the signature is equinox's
    (free, arguments), (towards, _) = primals, tangents

    def with_value(point: Float[Array, " slot"]) -> tuple[Array, Array]:
        value = _weighted(point, *arguments)
        return value, value

    jacobian, value = jax.jacfwd(with_value, has_aux=True)(free)
    change = jacobian @ towards
    return (value, value @ value), (change, 2.0 * value @ change)
