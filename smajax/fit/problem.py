"""Runs, model and noise as one least-squares problem; each lane of a batch frees its own parameters."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int

from smajax.experiment.record import Prior
from smajax.fit.batch import RunBatch, shown_batch
from smajax.fit.bounds import bounded, unbounded
from smajax.fit.priors import Priors
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


class Own(eqx.Module):
    """Parameters of which each run has a value of its own."""

    names: tuple[str, ...] = eqx.field(static=True)
    runs: tuple[str, ...] = eqx.field(static=True)
    start: Float[Array, "run own"]

    @property
    def in_full(self) -> tuple[str, ...]:
        """`convection_coefficient[Step01]`, those of the first run first."""
        return tuple(f"{name}[{run}]" for run in self.runs for name in self.names)


class Problem(eqx.Module):
    """A model that carries all candidate effects at their base values, and the runs to fit it to.

    P parameters: those of the model, then each run's own.
    """

    system: System
    names: tuple[str, ...] = eqx.field(static=True)
    batch: RunBatch
    noise_sigma: Float[Array, "*output"]  # of the one output, or of each
    offset: tuple[bool, ...] = eqx.field(static=True)  # of each output
    own: Own
    priors: Priors

    @classmethod
    def build(
        cls,
        system: System,
        batch: RunBatch,
        noise_sigma: float | Array,
        offset: bool | tuple[bool, ...],
        own: Own | None = None,
        known: Mapping[str, Prior] = MappingProxyType({}),
    ) -> Problem:
        """`offset`: whether each run has an unknown zero of an output, one for all or one each. `known`: priors."""
        own = own or Own((), tuple(str(run) for run in range(batch.runs)), jnp.zeros((batch.runs, 0)))
        names = (*parameters(system), *own.in_full)
        zero = (offset,) * len(batch.outputs) if isinstance(offset, bool) else offset
        return cls(system, names, batch, jnp.asarray(noise_sigma), zero, own, Priors.of(names, known))

    @property
    def noise(self) -> Float[Array, "series 1"]:
        """Sigma of every series."""
        each = jnp.broadcast_to(self.noise_sigma, (len(self.batch.outputs),))
        return jnp.tile(each, self.batch.runs)[:, None]

    @property
    def shared(self) -> tuple[str, ...]:
        """The names of the model's parameters, which all runs share."""
        return self.names[: len(self.names) - self.own.start.size]

    def start_values(self) -> np.ndarray:
        """The model's own values in the order of `names`, each run's, and the dummy: shape (P + 1,)."""
        return np.concatenate([np.asarray(get_parameters(self.system, self.shared)), np.ravel(self.own.start), [0.0]])

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
        full = np.ones(self.batch.runs) if weights is None else weights
        slot = jnp.asarray(index, dtype=int)
        return Lane(slot, *(jnp.asarray(part) for part in (low, high, values, full, tie, 1.0)))

    def with_output(self, output: Float[Array, "run time"] | None) -> Problem:
        """The same with other measured outputs; None: its own."""
        return self if output is None else eqx.tree_at(lambda one: one.batch.output, self, output)

    def system_at(self, values: Float[Array, " parameter"]) -> System:
        """The model, without what is each run's own."""
        return set_vector(self.system, self.shared, values[: len(self.shared)])

    def own_at(self, values: Float[Array, " parameter"]) -> Float[Array, "run own"]:
        """Each run's own values."""
        return values[len(self.shared) : -1].reshape(self.own.start.shape)

    def shown(self, values: Float[Array, " parameter"]) -> Float[Array, "series time"]:
        """What the sensors show of the simulated runs."""
        return shown_batch(self.system_at(values), self.batch, self.own.names, self.own_at(values))

    def misfit(self, values: Float[Array, " parameter"]) -> Float[Array, "series time"]:
        """Measured minus simulated, each run's best offset taken off where the experiment declares one; 0 in padding."""
        return self.misfit_of(self.shown(values))

    def misfit_of(self, shown: Float[Array, "series time"]) -> Float[Array, "series time"]:
        """`misfit` of what the sensors show.

        The offset enters linearly, so its best value for any model is the mean misfit: it needs no slot.
        """
        batch = self.batch
        raw = batch.output - shown
        if any(self.offset):
            # The mask may hold square roots of weights between 0 and 1 (`fit.robust`).
            weight = batch.mask**2
            total = weight.sum(axis=1)
            best = (raw * weight).sum(axis=1) / jnp.where(total > 0.0, total, 1.0)
            raw = raw - jnp.where(np.tile(self.offset, batch.runs), best, 0.0)[:, None]
        return raw * batch.mask

    def residual(
        self, values: Float[Array, " parameter"], weights: Float[Array, " run"], lost: float | None = None
    ) -> Float[Array, " sample"]:
        """Misfit over noise, run by run times the root of its weight, and the priors': what least squares makes small.

        `lost`: what stands for a misfit that is not finite.
        """
        return self.residual_of(self.shown(values), values, weights, lost)

    def residual_of(
        self,
        shown: Float[Array, "series time"],
        values: Float[Array, " parameter"],
        weights: Float[Array, " run"],
        lost: float | None = None,
    ) -> Float[Array, " sample"]:
        """`residual` of what the sensors show at `values`."""
        misfit = self.misfit_of(shown) / self.noise
        misfit = misfit if lost is None else jnp.where(jnp.isfinite(misfit), misfit, lost)
        by_series = jnp.repeat(weights, len(self.batch.outputs), total_repeat_length=len(misfit))
        return jnp.concatenate([(misfit * jnp.sqrt(by_series)[:, None]).ravel(), self.priors.rows(values)])


def values_of(free: Float[Array, " slot"], lane: Lane) -> Float[Array, " parameter"]:
    """The whole parameter vector of a lane."""
    return lane.values.at[lane.slots].set(bounded(free, lane.low, lane.high))


def free_of(lane: Lane) -> Float[Array, " slot"]:
    """Where the solver starts: the lane's own values, moved off their bounds."""
    return unbounded(jnp.asarray(lane.values)[lane.slots], jnp.asarray(lane.low), jnp.asarray(lane.high))


def _weighted(free: Float[Array, " slot"], lane: Lane, problem: Problem) -> Float[Array, " sample"]:
    # A lane that blows up loses; it must not stop the others.
    found = problem.residual(values_of(free, lane), lane.weights, lost=1e6)
    return jnp.concatenate([found, lane.tie * (free - free_of(lane))]) / lane.scale


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
