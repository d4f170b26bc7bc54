"""Measured runs of unequal length, packed into one padded batch over which the simulator can be mapped."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Sequence
from functools import partial
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from smajax.core.parameters import set_parameters
from smajax.data.experiment.record import RUN_STARTS, Run
from smajax.model.sensor_reading import LevelTerm
from smajax.model.system import System, initial_state, without_levels
from smajax.model.types import Scalar, State, Trajectory
from smajax.simulation.compiled import begin_compiled_run, compiled_run
from smajax.simulation.sensors import own_sensor, sensor_output
from smajax.simulation.simulate import simulate
from smajax.simulation.steppers import ONE_STEP, Integration


class Seen(NamedTuple):
    """What was measured of every run, by output: the samples (runs, outputs, N), NaN where one is missing, and a reading at one of its levels (runs, outputs)."""

    samples: Array | np.ndarray
    level: Array | np.ndarray


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
    # What was measured at one of the levels of a sensor that shows levels; None of runs that nobody has measured.
    level: Float[Array, " series"] | None = None

    def seen_by(self, system: System) -> Seen | None:
        """What was measured; None where no sensor of `system` shows levels."""
        if self.level is None or without_levels(system)[1] is None:
            return None
        known = not any(isinstance(one, jax.core.Tracer) for one in (self.mask, self.output, self.level))
        own: Any = np if known else jnp
        mask, output, level = map(own.asarray, (self.mask, self.output, self.level))
        shape = self.runs, len(self.outputs)
        return Seen(own.where(mask > 0, output, own.nan).reshape(*shape, -1), level.reshape(shape))

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
        level=stacked([commonest(series) for run in runs for series in run.outputs.values()]),
    )


def commonest(readings: np.ndarray) -> float:
    """The reading (n,) about which most of them lie: the half-sample mode (Bickel and Frühwirth 2006); 0 without any."""
    left = np.sort(readings[np.isfinite(readings)])
    while left.size > 2:
        half = (left.size + 1) // 2
        first = int(np.argmin(left[half - 1 :] - left[: left.size - half + 1]))
        left = left[first : first + half]
    return float(left.mean()) if left.size else 0.0


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
    seen: bool = False,
) -> tuple[System, State | None, LevelTerm | None]:
    """`system` with one run's values of `names`, the state it starts in where the model does not say it, and where it was `seen` what shows levels of its reading."""
    overrides = dict(zip(names, values, strict=True))
    celsius = overrides.pop("initial_temperature", None)
    here = set_parameters(system, {RUN_STARTS.get(name, name): value for name, value in overrides.items()})
    here, levels = without_levels(here) if seen else (here, None)
    if celsius is None:
        return here, None, levels
    # A wire that was not at the air's temperature: at rest as if the air had been as warm.
    first = {name: series[0] for name, series in inputs.items()}
    return here, initial_state(here, {**first, "ambient_temperature": celsius}), levels


def predict_run(  # a run, how it is integrated, and what was measured of it
    system: System,
    inputs: dict[str, Float[Array, " time"]],
    values: Float[Array, " name"],
    names: Sequence[str],
    dt: Scalar | float,
    outputs: Sequence[str],
    integration: Integration,
    once: bool = False,
    seen: tuple[Array | np.ndarray, Array | np.ndarray] | None = None,
) -> Float[Array, "output time"]:
    """Predicted sensor outputs of one run, with its `values` of `names`. `once`: as of `simulate`. `seen`: what was measured of it, (outputs, N) and (outputs,), as of `Seen`."""
    here, initial, levels = _started(system, names, values, inputs, seen is not None)
    run = simulate(here, inputs, dt, initial, integration, once=once)
    return jnp.stack([_shown(here, run, name, levels, seen, k) for k, name in enumerate(outputs)])


def _shown(
    system: System, run: Trajectory, name: str, levels: LevelTerm | None, seen: Any, number: int
) -> Float[Array, " time"]:
    """What a sensor shows of a run, the own one of the load beside what it has `seen` as output `number`."""
    output = sensor_output(system, run, name)
    if levels is None or not own_sensor(system, name):
        return output
    samples, level = seen
    return levels.near(output, samples[number], level[number])


class _StartedRun(NamedTuple):
    """One run before it is simulated: its model, state at the start and inputs, and what its sensor shows levels by."""

    system: System
    initial: State | None
    inputs: dict[str, Array]
    levels: LevelTerm | None
    own: tuple[Array | np.ndarray, Array | np.ndarray] | None


def _started_runs(
    system: System, batch: RunBatch, names: Sequence[str], values: np.ndarray, shown: bool = True
) -> Iterator[_StartedRun]:
    """Each run with its `values` (R, names). `shown`: whether what its sensors show is asked for."""
    series = {name: np.asarray(one) for name, one in batch.inputs.items()}
    seen = batch.seen_by(system) if shown else None
    for number in range(batch.runs):
        inputs = {name: jnp.asarray(one[number]) for name, one in series.items()}
        own = None if seen is None else (seen.samples[number], seen.level[number])
        row = [jnp.asarray(one) for one in values[number]]
        here, initial, levels = _started(system, names, row, inputs, own is not None)
        yield _StartedRun(here, initial, inputs, levels, own)


def _compiled_runs(
    system: System, batch: RunBatch, names: Sequence[str], values: np.ndarray, shown: bool = True
) -> Iterator[tuple[Trajectory, list[np.ndarray]]]:
    """Of each run, with its `values` (R, names): its trajectory, and what its sensors show, where that is asked for."""
    outputs = batch.outputs if shown else ()
    for one in _started_runs(system, batch, names, values, shown):
        run = compiled_run(one.system, one.inputs, batch.dt, batch.integration, one.initial)
        yield run, [np.asarray(_shown(one.system, run, name, one.levels, one.own, k)) for k, name in enumerate(outputs)]


def simulate_batch(system: System, batch: RunBatch) -> Trajectory:
    """One trajectory per run, numpy's arrays of shape (R, N); outside of `jit`, `vmap` and `grad`."""
    values = np.asarray(batch.overrides)
    return _stacked([run for run, _ in _compiled_runs(system, batch, batch.override_names, values, shown=False)])


def simulate_with_outputs(system: System, batch: RunBatch) -> tuple[Trajectory, np.ndarray]:
    """(one trajectory per run, its leaves of shape (R, N); what the sensors of `batch` show, (series, N)), numpy's arrays."""
    runs = list(_compiled_runs(system, batch, batch.override_names, np.asarray(batch.overrides)))
    return _stacked([run for run, _ in runs]), np.stack([one for _, outputs in runs for one in outputs])


def _stacked(runs: Sequence[Trajectory]) -> Trajectory:
    return jax.tree.map(lambda *leaves: np.stack(leaves), *runs)


def states_by_run(packed: Trajectory, runs: Sequence[Run], names: Sequence[str]) -> dict[str, dict[str, np.ndarray]]:
    """Of what `simulate_batch` returned of these R `runs`, the states `names` of each, (n,) without the padding, by the run's name."""
    series = {name: np.asarray(getattr(packed, name)) for name in names}
    return {
        run.name: {name: values[number, : len(run.time)] for name, values in series.items()}
        for number, run in enumerate(runs)
    }


def _values(batch: RunBatch, more_names: Sequence[str], more: np.ndarray | None) -> tuple[tuple[str, ...], np.ndarray]:
    """(what each run has values of, these, (R, names)): its overrides, and `more` of `more_names`."""
    own = np.asarray(batch.overrides)
    return (*batch.override_names, *more_names), own if more is None else np.concatenate(
        [own, np.asarray(more)], axis=1
    )


def predict_compiled(
    system: System, batch: RunBatch, more_names: Sequence[str] = (), more: np.ndarray | None = None
) -> np.ndarray:
    """`predict_batch` for a call by itself, outside of `jit`, `vmap` and `grad`: (series, N), numpy."""
    runs = _compiled_runs(system, batch, *_values(batch, more_names, more))
    return np.stack([one for _, outputs in runs for one in outputs])


def begin_compiled(
    system: System, batch: RunBatch, more_names: Sequence[str] = (), more: np.ndarray | None = None
) -> None:
    """Have a second process, where there is one, make the program of `predict_compiled` with these arguments: it is one for all runs."""
    one = next(_started_runs(system, batch, *_values(batch, more_names, more)))
    begin_compiled_run(one.system, one.inputs, batch.dt, batch.integration, one.initial)


def predict_batch(
    system: System, batch: RunBatch, more_names: Sequence[str] = (), more: Float[Array, "run name"] | None = None
) -> Float[Array, "series time"]:
    """Predicted sensor outputs of the batch. `more`: each run's values of `more_names`, beside its overrides."""
    names = (*batch.override_names, *more_names)
    values = batch.overrides if more is None else jnp.concatenate([batch.overrides, more], axis=1)
    one = partial(predict_run, system, names=names, dt=batch.dt, outputs=batch.outputs, integration=batch.integration)
    seen = batch.seen_by(system)
    predicted = jax.vmap(lambda inputs, row, own: one(inputs, row, seen=own))(batch.inputs, values, seen)
    return predicted.reshape(batch.output.shape[0], -1)
