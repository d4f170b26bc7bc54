"""Measured runs of unequal length, packed into one padded batch that the simulator can be mapped over."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from smajax.experiment.record import Run
from smajax.parameters import set_vector
from smajax.simulate import simulate
from smajax.system import System
from smajax.types import Trajectory


class RunBatch(eqx.Module):
    """R runs on N samples each; a shorter run is padded by holding its last input, with mask 0."""

    inputs: dict[str, Float[Array, "run time"]]
    output: Float[Array, "run time"]
    mask: Float[Array, "run time"]
    overrides: Float[Array, "run override"]  # values of `override_names`, run by run
    override_names: tuple[str, ...] = eqx.field(static=True)
    dt: float = eqx.field(static=True)

    @property
    def lengths(self) -> np.ndarray:
        """Samples of each run, shape (R,)."""
        return np.asarray(self.mask.sum(axis=1)).astype(int)


def pack(runs: Sequence[Run], dt: float, defaults: dict[str, float]) -> RunBatch:
    """Pack `runs` (all with the same input channels). `defaults` holds a value for every parameter a run overrides.

    Raises ValueError when the runs' input channels differ, naming the first run that does.
    """
    if not runs:
        raise ValueError("A batch needs at least one run, but `runs` is empty.")
    channels = sorted(runs[0].inputs)
    for run in runs:
        if sorted(run.inputs) != channels:
            raise ValueError(
                f"All runs must have the same input channels; `{runs[0].name}` has {channels}, `{run.name}` has "
                f"{sorted(run.inputs)}. Give every run the same channels (a constant one is fine)."
            )
    longest = max(len(run.time) for run in runs)
    names = tuple(sorted({name for run in runs for name in run.parameters}))

    def padded(values: np.ndarray, mode: str) -> np.ndarray:
        short = longest - len(values)
        return np.pad(values, (0, short), mode="edge") if mode == "edge" else np.pad(values, (0, short))

    return RunBatch(
        inputs={name: jnp.asarray([padded(run.inputs[name], "edge") for run in runs]) for name in channels},
        output=jnp.asarray([padded(run.output, "zero") for run in runs]),
        mask=jnp.asarray([padded(np.ones(len(run.time)), "zero") for run in runs]),
        overrides=jnp.asarray([[run.parameters.get(name, defaults[name]) for name in names] for run in runs]),
        override_names=names,
        dt=dt,
    )


def halved(batch: RunBatch) -> RunBatch:
    """The same runs at half the step, for inputs that hold over a step; sample i of `batch` is sample 2 i."""
    return dataclasses.replace(
        batch,
        inputs={name: jnp.repeat(series, 2, axis=1) for name, series in batch.inputs.items()},
        output=jnp.repeat(batch.output, 2, axis=1),
        mask=jnp.repeat(batch.mask, 2, axis=1),
        dt=0.5 * batch.dt,
    )


def simulate_batch(system: System, batch: RunBatch) -> Trajectory:
    """One trajectory per run, every array of shape (R, N)."""

    def one(inputs: dict[str, Float[Array, " time"]], override: Float[Array, " override"]) -> Trajectory:
        here = set_vector(system, batch.override_names, override) if batch.override_names else system
        return simulate(here, inputs, batch.dt)

    return jax.vmap(one)(batch.inputs, batch.overrides)
