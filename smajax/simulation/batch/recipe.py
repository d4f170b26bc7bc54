"""What a batch runs: checks that a system, its inputs, axes and settings fit together, and the `Recipe` of them."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import jax.numpy as jnp
import numpy as np

from smajax.core.names import close_matches, listed, of_many
from smajax.core.parameters import Parameter, check_bounds, parameters
from smajax.model.system import System
from smajax.model.types import Scalar, Series
from smajax.simulation.batch.axes import Axes
from smajax.simulation.batch.impossible import warn_of_impossible
from smajax.simulation.batch.single_run import Recipe
from smajax.simulation.compiled import check_tolerance
from smajax.simulation.integration_error import AUTO, Tolerance, with_tolerance
from smajax.simulation.measures import SHOWN, AbstractMeasure
from smajax.simulation.simulate import DEFAULT_STEP, check_kinds, check_scalars, warn_of_length
from smajax.simulation.steppers import ONE_STEP

STORED = ("position", "temperature", "martensite_fraction", "stress")
Parameters = Mapping[str, Parameter]


@dataclass(frozen=True)
class BatchSettings:
    """How long and in which steps runs go on, and what is stored of them; fields as the arguments of `run_batch`."""

    seconds: float | None = None
    dt: float = DEFAULT_STEP
    every: int = 1
    keep: Sequence[str] = STORED
    measures: Sequence[AbstractMeasure] = ()
    tolerance: Tolerance = AUTO
    slopes: Sequence[str] = ()


DEFAULTS = BatchSettings()


@dataclass(frozen=True)
class _Inputs:
    """The inputs of a batch, by what they are."""

    series: dict[str, Series]  # the same for all runs, each of shape (n,)
    constants: dict[str, Scalar]
    channels: tuple[str, ...]  # varied


def recipe_of(
    system: System, inputs: Mapping[str, Series | float], axes: Axes, settings: BatchSettings = DEFAULTS
) -> Recipe:
    """What `run_batch` runs, with one step a sample where the error is to choose (`batch.integration`).

    Raises ValueError naming what does not fit together, TypeError for what is of another kind.
    """
    check_kinds(system, inputs)
    _check_axes(axes)
    _check_measures(settings.measures)
    table = parameters(system)
    check_scalars(system, settings.dt)
    check_bounds(system)
    warn_of_impossible(system, axes)
    sorted_inputs = _sorted_inputs(system, inputs, axes, table)
    steps = _steps(sorted_inputs.series, settings)
    _check_stored(settings, steps)
    check_tolerance(system, settings.tolerance)
    _check_slopes(settings, table, sorted_inputs.channels, inputs)
    return Recipe(
        system=system,
        series=sorted_inputs.series,
        constants=sorted_inputs.constants,
        dt=jnp.asarray(settings.dt, dtype=float),
        measures=tuple(settings.measures),
        integration=ONE_STEP if settings.tolerance in (None, AUTO) else with_tolerance(float(settings.tolerance)),
        channels=sorted_inputs.channels,
        steps=steps,
        every=settings.every,
        keep=tuple(settings.keep),
        slopes=tuple(settings.slopes),
    )


def _check_axes(axes: object) -> None:
    if not isinstance(axes, Axes):
        raise TypeError(f"`axes` is {type(axes).__name__}; expected what `grid`, `zipped` or `sampled` gives.")
    if not axes.names:
        raise ValueError("`axes` varies nothing: for a single run use `simulate`, or give `grid(voltage=[6.0])`.")


def _check_measures(measures: Sequence[object]) -> None:
    other = [measure for measure in measures if not isinstance(measure, AbstractMeasure)]
    if other:
        raise TypeError(f"`measures` holds {other[0]!r}; expected measures, such as `sma.measure.Largest('position')`.")


def _lists(inputs: Collection[str]) -> str:
    """Where the names of parameters and inputs are."""
    return f"`smajax.parameter_values(system)` lists its parameters, and its inputs are {listed(sorted(inputs))}"


def _sorted_inputs(system: System, inputs: Mapping[str, Series | float], axes: Axes, table: Parameters) -> _Inputs:
    drive, load = system.drive, system.load
    required = drive.inputs_required | load.inputs_required
    known = required | drive.inputs_optional | load.inputs_optional | {"ambient_temperature"}
    # A name that is both (ambient_temperature) is the parameter, unless it is an input already.
    channels = tuple(name for name in axes.names if name in known and name not in table)
    unknown = [name for name in axes.names if name not in table and name not in channels]
    if unknown:
        raise ValueError(
            f"`{unknown[0]}` is neither a parameter nor an input of the system{of_many(unknown[0], [*table, *known], _lists(known))}."
        )
    twice = sorted(set(axes.names) & set(inputs))
    if twice:
        raise ValueError(f"{listed(twice)}: varied by `axes` and given in `inputs` as well: leave them out of one.")
    present = set(inputs) | set(channels)
    if not required <= present or not present <= known:
        raise ValueError(
            f"the system needs the inputs {listed(sorted(required))} and may have {listed(sorted(known - required))}, but there are "
            f"{listed(sorted(present))}, from `inputs` and `axes`."
        )
    odd = {name: np.shape(values) for name, values in inputs.items() if np.ndim(values) > 1}
    if odd:
        raise ValueError(f"an input is a number or a series of shape (n,), but {odd}. What differs by run is an axis.")
    arrays = {name: jnp.asarray(values, dtype=float) for name, values in inputs.items()}
    series = {name: values for name, values in arrays.items() if values.ndim == 1}
    return _Inputs(series, {name: values for name, values in arrays.items() if values.ndim == 0}, channels)


def _is_length(seconds: Any) -> bool:
    if isinstance(seconds, str | bool) or np.ndim(seconds) != 0:
        return False
    return bool(0.0 < np.asarray(seconds, dtype=float) < np.inf)


def _steps(series: Mapping[str, Series], settings: BatchSettings) -> int:
    """How many steps a run has."""
    seconds, dt, every = settings.seconds, settings.dt, settings.every
    lengths = {name: len(values) for name, values in series.items()}
    if len(set(lengths.values())) > 1:
        raise ValueError(f"input series must be of one length, but there are {lengths}.")
    if seconds is None and not lengths:
        raise ValueError("no input is a series: give `seconds`, the length of the run.")
    if seconds is not None and not _is_length(seconds):
        raise ValueError(f"`seconds` is the length of the run, a number above zero, not {seconds!r}.")
    steps = next(iter(lengths.values())) - 1 if lengths else round(float(seconds or 0.0) / dt)
    if lengths and seconds is not None and steps != round(seconds / dt):
        raise ValueError(f"series of {steps + 1} samples last {steps * dt:g} s at {dt:g} s, not {seconds:g} s.")
    if seconds is not None and steps < 1:
        raise ValueError(
            f"a run of {seconds:g} s is shorter than a step of {dt:g} s: give a smaller `dt`, or more `seconds`."
        )
    if seconds is not None:
        warn_of_length(seconds, steps * dt, dt, stacklevel=5)
    if steps < 1 or every < 1 or steps % every:
        raise ValueError(f"{steps} steps cannot be stored every {every}: give a divisor of the number of steps.")
    return steps


def _check_stored(settings: BatchSettings, steps: int) -> None:
    wrong = sorted(set(settings.keep) - set(SHOWN))
    if wrong:
        raise ValueError(
            f"`keep` names what a state shows, not {wrong[0]!r}{close_matches(wrong[0], sorted(SHOWN), 'there are')}."
        )
    names = [one.name for one in settings.measures]
    if len(set(names)) < len(names):
        raise ValueError(f"measures must have names of their own, but there are {names}.")
    for one in settings.measures:
        one.check(steps)


def _check_slopes(settings: BatchSettings, table: Parameters, channels: Sequence[str], inputs: Collection[str]) -> None:
    slopes, measures = settings.slopes, settings.measures
    wrong = [name for name in slopes if name not in table and name not in channels]
    if wrong:
        raise ValueError(
            f"`slopes` names parameters or inputs that `axes` vary ({listed(sorted(channels))}), not `{wrong[0]}`"
            f"{of_many(wrong[0], [*table, *channels], '`smajax.parameter_values(system)` lists the parameters')}. "
            "An input that is the same for all may be an axis of one value."
        )
    if len(set(slopes)) < len(slopes):
        raise ValueError(f"`slopes` names something twice: {listed(slopes)}.")
    hidden = sorted(set(slopes) & set(inputs))
    if hidden:
        raise ValueError(
            f"an input stands in for the parameter {listed(hidden)}: leave it out of `inputs`, or of `slopes`."
        )
    jumping = [one.name for one in measures if not one.smooth]
    if slopes and jumping:
        raise ValueError(f"{listed(jumping)} moves by whole steps and has no slope: leave it out, or `slopes`.")
    if slopes and not measures:
        raise ValueError("`slopes` are those of measures: give `measures`, as `smajax.simulation.measures.MeanSquare`.")
