"""Measured runs of unequal length, packed into one padded batch over which the simulator can be mapped."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Sequence
from functools import partial
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from smajax.core.parameters import set_parameters
from smajax.data.experiment.record import RUN_STARTS, Run
from smajax.model.system import System, initial_state
from smajax.model.types import Scalar, State, Trajectory
from smajax.simulation.compiled import compiled_run
from smajax.simulation.sensors import sensor_output
from smajax.simulation.simulate import simulate
from smajax.simulation.steppers import ONE_STEP, Integration


class RunBatch(eqx.Module):
    """R runs on N samples each; a shorter run is padded by holding its last input, with mask 0.

    A series is one output of one run: those of the first run first. A missing sample has mask 0 as well.
    """

    inputs: dict[str, Float[Array, "run time"]]
    output: Float[Array, "series time"]
    mask: Float[Array, "series time"]
    overrides: Float[Array, "run override"]  # values of `override_names`, run by run; also of `RUN_STARTS`
    override_names: tuple[str, ...] = eqx.field(static=True)
    dt: float = eqx.field(static=True)
    outputs: tuple[str, ...] = eqx.field(static=True, default=("reading",))
    integration: Integration = ONE_STEP  # how finely between two samples

    @property
    def runs(self) -> int:
        return self.output.shape[0] // len(self.outputs)

    @property
    def measured(self) -> np.ndarray:
        """Where a run has a sample of any output, (runs, N)."""
        present = (np.asarray(self.mask) > 0).reshape(self.runs, len(self.outputs), -1)
        return np.asarray(
            present.any(axis=1)
        )  # an array by every NumPy's types: those for Python 3.11 also allow a single truth value


def pack(runs: Sequence[Run], dt: float, defaults: dict[str, float], integration: Integration = ONE_STEP) -> RunBatch:
    """Pack `runs` (all with the same channels). `defaults` holds a value for every parameter a run overrides.

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
    values = [{**defaults, **run.parameters} for run in runs]

    def padded(values: np.ndarray, mode: str) -> np.ndarray:
        short = longest - len(values)
        return np.pad(values, (0, short), mode="edge") if mode == "edge" else np.pad(values, (0, short))

    def stacked(rows: Sequence[Any]) -> Array:
        # One array that is handed over: of a list JAX compiles a program.
        return jnp.asarray(np.asarray(rows, dtype=float), dtype=float)

    return RunBatch(
        inputs={name: stacked([padded(run.inputs[name], "edge") for run in runs]) for name in channels},
        output=stacked([padded(np.nan_to_num(series), "zero") for run in runs for series in run.outputs.values()]),
        mask=stacked(
            [padded(np.isfinite(series).astype(float), "zero") for run in runs for series in run.outputs.values()]
        ),
        overrides=stacked([[own[name] for name in names] for own in values]),
        override_names=names,
        dt=dt,
        outputs=tuple(runs[0].outputs),
        integration=integration,
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


def _started(
    system: System,
    names: Sequence[str],
    values: Float[Array, " name"] | Sequence[Scalar],
    inputs: dict[str, Float[Array, " time"]],
) -> tuple[System, State | None]:
    """`system` with one run's values of `names`, and the state it starts in where the model does not say it."""
    overrides = dict(zip(names, values, strict=True))
    celsius = overrides.pop("initial_temperature", None)
    here = set_parameters(system, {RUN_STARTS.get(name, name): value for name, value in overrides.items()})
    if celsius is None:
        return here, None
    # A wire that was not at the air's temperature: at rest as if the air had been as warm.
    first = {name: series[0] for name, series in inputs.items()}
    return here, initial_state(here, {**first, "ambient_temperature": celsius})


def predict_run(
    system: System,
    inputs: dict[str, Float[Array, " time"]],
    values: Float[Array, " name"],
    names: Sequence[str],
    dt: Scalar | float,
    outputs: Sequence[str],
    integration: Integration,
    once: bool = False,
) -> Float[Array, "output time"]:
    """Predicted sensor outputs of one run, with its `values` of `names`. `once`: as of `simulate`."""
    here, initial = _started(system, names, values, inputs)
    run = simulate(here, inputs, dt, initial, integration, once=once)
    return jnp.stack([sensor_output(here, run, name) for name in outputs])


def _compiled_runs(
    system: System, batch: RunBatch, names: Sequence[str], values: np.ndarray
) -> Iterator[tuple[System, Trajectory]]:
    """Each run's system, with its `values` (R, names), and its trajectory."""
    series = {name: np.asarray(one) for name, one in batch.inputs.items()}
    for number in range(batch.runs):
        inputs = {name: jnp.asarray(one[number]) for name, one in series.items()}
        here, initial = _started(system, names, [jnp.asarray(one) for one in values[number]], inputs)
        yield here, compiled_run(here, inputs, batch.dt, batch.integration, initial)


def simulate_batch(system: System, batch: RunBatch) -> Trajectory:
    """One trajectory per run, numpy's arrays of shape (R, N); outside of `jit`, `vmap` and `grad`."""
    runs = [run for _, run in _compiled_runs(system, batch, batch.override_names, np.asarray(batch.overrides))]
    return _stacked(runs)


def simulate_with_outputs(system: System, batch: RunBatch) -> tuple[Trajectory, np.ndarray]:
    """(one trajectory per run, its leaves of shape (R, N); what the sensors of `batch` show, (series, N)), numpy's arrays."""
    runs = list(_compiled_runs(system, batch, batch.override_names, np.asarray(batch.overrides)))
    outputs = [np.asarray(sensor_output(here, run, name)) for here, run in runs for name in batch.outputs]
    return _stacked([run for _, run in runs]), np.stack(outputs)


def _stacked(runs: Sequence[Trajectory]) -> Trajectory:
    return jax.tree.map(lambda *leaves: np.stack(leaves), *runs)


def states_by_run(packed: Trajectory, runs: Sequence[Run], names: Sequence[str]) -> dict[str, dict[str, np.ndarray]]:
    """Of what `simulate_batch` returned of these R `runs`, the states `names` of each, (n,) without the padding, by the run's name."""
    series = {name: np.asarray(getattr(packed, name)) for name in names}
    return {
        run.name: {name: values[number, : len(run.time)] for name, values in series.items()}
        for number, run in enumerate(runs)
    }


def predict_compiled(
    system: System, batch: RunBatch, more_names: Sequence[str] = (), more: np.ndarray | None = None
) -> np.ndarray:
    """`predict_batch` for a call by itself, outside of `jit`, `vmap` and `grad`: (series, N), numpy."""
    names, values = (*batch.override_names, *more_names), np.asarray(batch.overrides)
    if more is not None:
        values = np.concatenate([values, np.asarray(more)], axis=1)
    runs = _compiled_runs(system, batch, names, values)
    return np.stack([np.asarray(sensor_output(here, run, name)) for here, run in runs for name in batch.outputs])


def predict_batch(
    system: System, batch: RunBatch, more_names: Sequence[str] = (), more: Float[Array, "run name"] | None = None
) -> Float[Array, "series time"]:
    """Predicted sensor outputs of the batch. `more`: each run's values of `more_names`, beside its overrides."""
    names = (*batch.override_names, *more_names)
    values = batch.overrides if more is None else jnp.concatenate([batch.overrides, more], axis=1)
    one = partial(predict_run, system, names=names, dt=batch.dt, outputs=batch.outputs, integration=batch.integration)
    return jax.vmap(lambda inputs, row: one(inputs, row))(batch.inputs, values).reshape(batch.output.shape[0], -1)
