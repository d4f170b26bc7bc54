"""Runs, model and noise as one least-squares problem; each fit of a batch frees its own parameters."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import Any, NamedTuple, TypeVar

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from smajax.core.names_of_runs import of_run, parameter_of
from smajax.core.parameters import by_numpy, get_parameters, parameters, set_vector
from smajax.data.experiment.record import Prior
from smajax.fit.packed_runs import RunBatch, predict_batch
from smajax.fit.priors import Priors
from smajax.model.system import System, with_mean_slopes

ArrayOf = TypeVar("ArrayOf", bound=Any)
# How near to a bound the logit that regularises a parameter is taken, as a share of the range.
NEAREST = 1e-3


class FitTask(NamedTuple):
    """One fit of many: what it frees, within which bounds, and its initial guess. F free parameters."""

    slots: np.ndarray  # (F,), index into the parameter vector
    low: np.ndarray  # (F,)
    high: np.ndarray  # (F,)
    values: np.ndarray  # every parameter of the problem, (P,)
    weights: np.ndarray  # (R,): 0 leaves a run out
    regularisation: np.ndarray  # (F,): pull back to the initial guess, in the residual's unit per range
    goal: float = math.inf  # cost that it has to promise to come to (`FitSettings`)
    priors: Priors | None = None  # None: those of the problem

    @property
    def initial_guess(self) -> np.ndarray:
        """In shares of the range between the bounds, (F,)."""
        return np.clip((self.values[self.slots] - self.low) / (self.high - self.low), 0.0, 1.0)

    def values_at(self, y: np.ndarray) -> np.ndarray:
        """The whole parameter vector, (P,), at shares `y` (F,) of the range."""
        values = np.array(self.values)
        values[self.slots] = self.low + y * (self.high - self.low)
        return values


class PerRun(eqx.Module):
    """Parameters that have one value for each run; those in `single` are fitted in some runs alone, and zero in all others."""

    names: tuple[str, ...] = eqx.field(static=True)
    runs: tuple[str, ...] = eqx.field(static=True)
    start: Float[Array, "run parameter"]
    single: tuple[str, ...] = eqx.field(static=True, default=())

    @property
    def full_names(self) -> tuple[str, ...]:
        """`convection_coefficient[Step01]`, those of the first run first."""
        return tuple(of_run(name, run) for run in self.runs for name in self.names)

    def of_first_run(self, name: str) -> str:
        """The same value in the first of these runs, whose bounds and prior are those of every run: of `name`, a value of any run."""
        return of_run(parameter_of(name), self.runs[0])


class Problem(eqx.Module):
    """A model that carries all candidate effects at their base values, and the runs to fit it to.

    P parameters: those of the model, then those with one value for each run.
    """

    system: System
    names: tuple[str, ...] = eqx.field(static=True)
    batch: RunBatch
    noise_sigma: Float[Array, "*output"]  # of the one output, or of each
    offset: tuple[bool, ...] = eqx.field(static=True)  # of each output
    per_run: PerRun
    priors: Priors
    # What the misfits of each output are multiplied by (`in_first_noises`); None: nothing.
    scale: Float[Array, " output"] | None = None

    @classmethod
    def build(
        cls,
        system: System,
        batch: RunBatch,
        noise_sigma: float | np.ndarray | Array,
        offset: bool | tuple[bool, ...],
        per_run: PerRun | None = None,
        priors: Mapping[str, Prior] = MappingProxyType({}),
    ) -> Problem:
        """`offset`: whether each run has an unknown zero of an output, one for all or one each."""
        per_run = per_run or PerRun((), tuple(str(run) for run in range(batch.runs)), np.zeros((batch.runs, 0)))
        names = (*parameters(system), *per_run.full_names)
        zero = (offset,) * len(batch.outputs) if isinstance(offset, bool) else offset
        return cls(system, names, batch, jnp.asarray(noise_sigma), zero, per_run, Priors.of(names, priors))

    def with_system(
        self,
        system: System,
        batch: RunBatch | None = None,
        per_run: PerRun | None = None,
        priors: Mapping[str, Prior] = MappingProxyType({}),
    ) -> Problem:
        """The same outputs, their noise and zeros, by another model; `batch`: of other runs, which have no values of their own but `per_run`."""
        own = self.per_run if batch is None and per_run is None else per_run
        whole = Problem.build(system, batch or self.batch, self.noise_sigma, self.offset, own, priors)
        return dataclasses.replace(whole, scale=self.scale)

    def with_mean_slopes(self) -> Problem:
        """The same with derivatives of a sensor that shows levels by what its readings tell, and not by what pulls at a fit."""
        noise = float(np.ravel(by_numpy(self.noise_sigma))[0])
        return dataclasses.replace(self, system=with_mean_slopes(self.system, noise))

    def in_first_noises(self) -> Problem:
        """The same with the misfits of every output in the unit of the first: over their own noise, times the noise of the first.

        One number is then the noise of all. Of one output nothing changes.
        """
        outputs = len(self.batch.outputs)
        if outputs == 1:
            return self
        sigma = np.broadcast_to(np.asarray(self.noise_sigma), (outputs,))
        return dataclasses.replace(self, noise_sigma=jnp.asarray(sigma[0]), scale=jnp.asarray(sigma[0] / sigma))

    @property
    def owner(self) -> np.ndarray:
        """Number of the run of each series, (series,)."""
        return np.repeat(np.arange(self.batch.runs), len(self.batch.outputs))

    @property
    def scale_of_series(self) -> np.ndarray:
        """What the misfits of each series are multiplied by, (series, 1)."""
        each = np.ones(len(self.batch.outputs)) if self.scale is None else np.asarray(self.scale)
        return np.tile(each, self.batch.runs)[:, None]

    def by_run(self, series: np.ndarray) -> np.ndarray:
        """(series, N) -> (runs, outputs N): the outputs of a run after one another."""
        return series.reshape(self.batch.runs, -1)

    @property
    def noise(self) -> Float[Array, "series 1"]:
        """Sigma of every series; NumPy's where it is known, since a fit asks for it thousands of times."""
        known = not isinstance(self.noise_sigma, jax.core.Tracer)
        own: Any = np if known else jnp
        each = own.broadcast_to(own.asarray(self.noise_sigma), (len(self.batch.outputs),))
        return own.tile(each, self.batch.runs)[:, None]

    @property
    def shared(self) -> tuple[str, ...]:
        """The names of the model's parameters, which all runs share."""
        return self.names[: len(self.names) - self.per_run.start.size]

    def start_values(self) -> np.ndarray:
        """The model's values in the order of `names`, then each run's: shape (P,)."""
        return np.concatenate([np.asarray(get_parameters(self.system, self.shared)), np.ravel(self.per_run.start)])

    def task(
        self,
        free: Sequence[str],
        bounds: Mapping[str, tuple[float, float]],
        values: np.ndarray,
        weights: np.ndarray | None = None,
        regularisation: float = 0.0,
    ) -> FitTask:
        """A task that frees `free` within `bounds`, starting from `values`.

        `regularisation`: of the parameters' logits between their bounds, so that one near a bound may change by its size.
        """
        slots = np.asarray([self.names.index(name) for name in free], dtype=int)
        low, high = (np.asarray([bounds[name][side] for name in free], dtype=float) for side in (0, 1))
        full = np.ones(self.batch.runs) if weights is None else np.asarray(weights, dtype=float)
        loose = FitTask(slots, low, high, np.asarray(values, dtype=float), full, np.zeros(len(free)))
        share = np.clip(loose.initial_guess, NEAREST, 1.0 - NEAREST)
        return loose._replace(regularisation=regularisation / (share * (1.0 - share)))

    def with_output(self, output: Float[Array, "series time"]) -> Problem:
        """The same with other measured outputs."""
        return eqx.tree_at(lambda one: one.batch.output, self, output)

    def with_noise(self, sigma: float | np.ndarray | Array) -> Problem:
        """The same with another noise: of the one output or all, or of each, SI."""
        return eqx.tree_at(lambda one: one.noise_sigma, self, jnp.asarray(sigma))

    @property
    def measured(self) -> np.ndarray:
        """The outputs, (series, N), SI."""
        return np.asarray(self.batch.output)

    def system_at(self, values: Float[Array, " parameter"]) -> System:
        """The model, without the values of single runs."""
        return set_vector(self.system, self.shared, by_numpy(values)[: len(self.shared)])

    def per_run_at(self, values: Float[Array, " parameter"]) -> Float[Array, "run parameter"]:
        """The values of each run."""
        return by_numpy(values)[len(self.shared) :].reshape(self.per_run.start.shape)

    def with_own_values(self, values: np.ndarray) -> RunBatch:
        """The runs with their own values at `values` (P,), where a simulation of the model alone finds them."""
        names = self.per_run.names
        if not names:
            return self.batch
        overrides = jnp.concatenate([self.batch.overrides, self.per_run_at(jnp.asarray(values))], axis=1)
        return dataclasses.replace(self.batch, overrides=overrides, override_names=(*self.batch.override_names, *names))

    def predict(self, values: Float[Array, " parameter"]) -> Float[Array, "series time"]:
        """Sensor outputs of the simulated runs."""
        return predict_batch(self.system_at(values), self.batch, self.per_run.names, self.per_run_at(values))

    def misfit(self, values: Float[Array, " parameter"]) -> Float[Array, "series time"]:
        """Measured minus simulated, each run's best offset taken off where the experiment declares one; 0 in padding."""
        return self.misfit_of(self.predict(values))

    def misfit_of(self, predicted: Float[Array, "series time"]) -> Float[Array, "series time"]:
        """`misfit` of predicted sensor outputs."""
        return self.centred(self.batch.output - predicted)

    def centred(self, raw: ArrayOf) -> ArrayOf:
        """(..., series, N) with each run's best offset taken off where the experiment declares one; 0 in padding.

        The offset enters linearly, so its best value for any model is the mean misfit: it needs no slot. Of numpy's and
        of JAX's arrays alike.
        """
        xp = raw.__array_namespace__()
        mask = xp.asarray(self.batch.mask)
        if any(self.offset):
            # The mask may hold square roots of weights between 0 and 1 (`fit.robust`).
            weight = mask**2
            total = xp.sum(weight, axis=-1)
            best = xp.sum(raw * weight, axis=-1) / xp.where(total > 0.0, total, 1.0)
            raw = raw - xp.where(xp.asarray(np.tile(self.offset, self.batch.runs)), best, 0.0)[..., None]
        scaled = raw if self.scale is None else raw * xp.tile(xp.asarray(self.scale), self.batch.runs)[:, None]
        return scaled * mask
