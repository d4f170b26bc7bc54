"""`run_batch`: a system, its inputs and what varies -> a labelled data set, in memory or streamed to a folder."""

from __future__ import annotations

import warnings
from collections.abc import Collection, Mapping, Sequence
from pathlib import Path
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import xarray as xr

from smajax.core.machine import available_memory
from smajax.core.names import listed
from smajax.core.parameters import Parameter, check_bounds, parameters
from smajax.core.progress import Progress, Stage, as_progress, quiet
from smajax.core.provenance import digest, provenance
from smajax.engine import Engine
from smajax.model.load.coupon import AbstractCoupon
from smajax.model.system import System
from smajax.model.types import Series
from smajax.model.wire.order import check_order
from smajax.simulation.batch.axes import Axes
from smajax.simulation.batch.chunks import chunk_size, chunks, result_shapes
from smajax.simulation.batch.single_run import GOOD, Recipe, member
from smajax.simulation.batch.store import DIGEST, Store
from smajax.simulation.measures import SHOWN, AbstractMeasure
from smajax.simulation.simulate import DEFAULT_STEP, check_kinds, check_scalars

KEPT = ("position", "temperature", "martensite_fraction", "stress")
BUDGET = 1 << 30  # bytes


def within_memory(budget: int) -> int:
    """The budget, or half of what this program may still take where that is less: a cap makes chunks smaller."""
    free = available_memory()
    return budget if free is None else min(budget, free // 2)


def _tell_beyond(axes: Axes, table: Mapping[str, Parameter]) -> None:
    """Warns of values that no wire or load has: what comes of them may look like a result."""
    for dimension in axes.dimensions:
        for name, values in dimension.values.items():
            if name not in table:
                continue
            low, high = table[name].low, table[name].high
            beyond = values[~((values >= low) & (values <= high))]
            if beyond.size:
                warnings.warn(
                    f"{beyond.size} of {values.size} values of `{name}` are out of its bounds, {low:g} to {high:g} {table[name].unit}, "
                    f"such as {beyond[0]:g}: such members are run all the same, and what comes of them means nothing.",
                    stacklevel=4,
                )


def recipe_of(
    system: System,
    inputs: Mapping[str, Series | float],
    axes: Axes,
    *,
    seconds: float | None = None,
    dt: float = DEFAULT_STEP,
    every: int = 1,
    keep: Sequence[str] = KEPT,
    measures: Sequence[AbstractMeasure] = (),
    tolerance: float | None = None,
    slopes: Sequence[str] = (),
) -> Recipe:
    """What `run_batch` runs. Raises ValueError naming what does not fit together."""
    check_kinds(system, inputs)
    if not isinstance(axes, Axes):
        raise TypeError(f"`axes` is {type(axes).__name__}; expected what `grid`, `zipped` or `sampled` gives.")
    strange: list[object] = [measure for measure in measures if not isinstance(measure, AbstractMeasure)]
    if strange:
        raise TypeError(
            f"`measures` holds {strange[0]!r}; expected measures, such as `sma.measure.Largest('position')`."
        )
    if not axes.names:
        raise ValueError("`axes` varies nothing: for a single run use `simulate`, or give `grid(voltage=[6.0])`.")
    drive, load = system.drive, system.load
    known = drive.inputs_required | load.inputs_required | drive.inputs_optional | load.inputs_optional
    known = known | {"ambient_temperature"}
    table = parameters(system)
    check_scalars(system, dt)
    check_bounds(system)
    check_order(system)
    _tell_beyond(axes, table)
    # A name that is both (ambient_temperature) is the parameter, unless it is an input already.
    channels = tuple(name for name in axes.names if name in known and name not in table)
    unknown = [name for name in axes.names if name not in table and name not in channels]
    if unknown:
        raise ValueError(
            f"{listed(unknown)}: neither parameters ({listed(sorted(table))}) nor inputs ({listed(sorted(known))}) of the system."
        )
    twice = sorted(set(axes.names) & set(inputs))
    if twice:
        raise ValueError(f"{listed(twice)}: varied by `axes` and given in `inputs` as well: leave them out of one.")
    given = set(inputs) | set(channels)
    required = drive.inputs_required | load.inputs_required
    if not required <= given or not given <= known:
        raise ValueError(
            f"the system needs the inputs {listed(sorted(required))} and may have {listed(sorted(known - required))}, but there are "
            f"{listed(sorted(given))}, from `inputs` and `axes`."
        )
    series = {name: jnp.asarray(values, dtype=float) for name, values in inputs.items() if np.ndim(values) == 1}
    constants = {name: jnp.asarray(values, dtype=float) for name, values in inputs.items() if np.ndim(values) == 0}
    odd = {name: np.shape(values) for name, values in inputs.items() if np.ndim(values) > 1}
    if odd:
        raise ValueError(
            f"an input is a number or a series of shape (n,), but {odd}. What differs by member is an axis."
        )
    lengths = {name: len(values) for name, values in series.items()}
    if len(set(lengths.values())) > 1:
        raise ValueError(f"input series must be of one length, but there are {lengths}.")
    if seconds is None and not lengths:
        raise ValueError("no input is a series: give `seconds`, the length of the run.")
    steps = next(iter(lengths.values())) - 1 if lengths else round(float(seconds or 0.0) / dt)
    if lengths and seconds is not None and steps != round(seconds / dt):
        raise ValueError(f"series of {steps + 1} samples last {steps * dt:g} s at {dt:g} s, not {seconds:g} s.")
    if steps < 1 or every < 1 or steps % every:
        raise ValueError(f"{steps} steps cannot be kept every {every}: give a divisor of the number of steps.")
    wrong = sorted(set(keep) - set(SHOWN))
    if wrong:
        raise ValueError(f"`keep` names what a state shows, {listed(sorted(SHOWN))}, not {listed(wrong)}.")
    names = [one.name for one in measures]
    if len(set(names)) < len(names):
        raise ValueError(f"measures must have names of their own, but there are {names}.")
    for one in measures:
        one.check(steps)
    if tolerance is not None and (not tolerance > 0.0 or isinstance(load, AbstractCoupon)):
        raise ValueError(
            f"`tolerance` is a share of 1 C and of 1 % strain a step, for a load that moves; got {tolerance} and "
            f"{type(load).__name__}. Take 1e-4, or leave it out."
        )
    _check_slopes(slopes, table, channels, inputs, measures, tolerance)
    return Recipe(
        system=system,
        series=series,
        constants=constants,
        dt=jnp.asarray(dt, dtype=float),
        measures=tuple(measures),
        tolerance=None if tolerance is None else jnp.asarray(tolerance, dtype=float),
        channels=channels,
        steps=steps,
        every=every,
        keep=tuple(keep),
        slopes=tuple(slopes),
    )


def _check_slopes(
    slopes: Sequence[str],
    table: Mapping[str, Parameter],
    channels: Sequence[str],
    inputs: Collection[str],
    measures: Sequence[AbstractMeasure],
    tolerance: float | None,
) -> None:
    wrong = [name for name in slopes if name not in table and name not in channels]
    if wrong:
        raise ValueError(
            f"`slopes` names parameters ({listed(sorted(table))}) or inputs that `axes` vary ({listed(sorted(channels))}), "
            f"not {listed(wrong)}. An input that is the same for all may be an axis of one value."
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
    if slopes and tolerance is not None:
        raise ValueError(
            "slopes are found backwards through fixed steps, and a `tolerance` makes their number depend on the parameters: "
            "leave `tolerance` out, or `slopes`."
        )


def run_batch(
    system: System,
    inputs: Mapping[str, Series | float],
    axes: Axes,
    *,
    seconds: float | None = None,
    dt: float = DEFAULT_STEP,
    every: int = 1,
    keep: Sequence[str] = KEPT,
    measures: Sequence[AbstractMeasure] = (),
    tolerance: float | None = None,
    slopes: Sequence[str] = (),
    budget: int = BUDGET,
    out: Path | str | None = None,
    devices: Sequence[jax.Device] | None = None,
    engine: Engine = "auto",
    progress: Progress = quiet,
) -> xr.Dataset:
    """Simulate every member of `axes` and label the results.

    `axes` (`batch.axes`: `grid`, `zipped`, `sampled`, and their products) names parameters of the system or input
    channels, SI. `inputs` are numbers, or series of shape (n,) shared by all members. Of each run `keep` is kept every
    `every` steps of `dt` seconds, and `measures`; with `keep=()` no trajectory is stored, whatever the length.

    With a `tolerance` a run takes as many steps between two samples, `dt` apart, as its error asks for: with 1e-4 (of 1 C and
    of 1 % strain, a step) and samples of 50 ms the worst members are more accurate than with fixed steps of 5 ms, typical
    ones less (to 1e-3 degrees), and it is several times as fast; an end stop met at speed is no better. Then measures see
    the samples only, and there are no slopes.

    `slopes` names parameters, and inputs of `axes`: the result then has the derivative of every measure by each of them, as
    `mean_square_position_by_wire_diameter`. They are found backwards through the run (reverse mode): those of one measure by all
    parameters together in less than four times the time of the run, those of each further measure in two or three times more, in memory
    that grows as the square root of its steps. Those of a member that went wrong mean nothing: `good` leaves them out.

    The result has the dimensions of `axes` and `time`, `status` (0 good, 1 a number that is none, 2 runaway heat) and
    `first_bad_time`. Results take a quarter of `budget` bytes at a time, or of half of the memory that is left. With `out` they are streamed to a Zarr group
    there, and the same call goes on where an earlier one was stopped; the data set returned then reads from disk, as
    `smajax.simulation.batch.run_batch.opened(out)` does by itself.

    On a processor the batch is machine code (`smajax.engine`), five to twenty times as fast as by XLA; `engine="xla"` asks for the other
    (they agree to 1e-12 of a run), and where only XLA can do it, it does.

    A member whose values are out of their bounds is run as it is, with a warning: `status` tells of numbers that are none and of
    runaway heat, not of what cannot be.
    Raises ValueError for what does not fit together, a parameter of `system` out of its bounds, and when `out` holds another batch.
    """
    progress = as_progress(progress)
    recipe = recipe_of(
        system,
        inputs,
        axes,
        seconds=seconds,
        dt=dt,
        every=every,
        keep=keep,
        measures=measures,
        tolerance=tolerance,
        slopes=slopes,
    )
    several = tuple(devices or jax.local_devices())
    size = chunk_size(member, recipe, axes, within_memory(budget), several)
    if out is not None:
        store = created_or_opened(Path(out), recipe, axes, size)
        fill(store, recipe, devices, store.missing(), progress, engine)
        return opened(Path(out))
    parts: list[dict[str, np.ndarray]] = []
    count = -(-axes.size // size)
    for number, found in chunks(member, recipe, axes, size, range(count), devices, engine):
        parts.append(found)
        progress(Stage("simulating", (number + 1) / count))
    whole = {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}
    return labelled(whole, axes, recipe.units(), np.arange(recipe.steps // every + 1) * every * dt, _told(recipe))


def _told(recipe: Recipe) -> dict[str, str]:
    inputs = {f"input {name}": f"{float(value):.10g}" for name, value in recipe.constants.items()}
    inputs |= {f"input {name}": f"series of {len(run)} samples" for name, run in recipe.series.items()}
    tolerance = "none" if recipe.tolerance is None else float(recipe.tolerance)
    settings = {
        "dt": float(recipe.dt),
        "tolerance": tolerance,
        "every": recipe.every,
        "steps": recipe.steps,
        "precision": recipe.dt.dtype,
    }
    return provenance(recipe.system, **settings, **inputs)


def _flat(values: Mapping[str, np.ndarray]) -> list[str | np.ndarray]:
    return [part for pair in values.items() for part in pair]


def created_or_opened(folder: Path, recipe: Recipe, axes: Axes, size: int) -> Store:
    """The store of this very batch in `folder`, begun if there is nothing. ValueError when there is something else."""
    mark = digest(recipe, [part for one in axes.dimensions for part in (one.name, *_flat(one.values))])
    if folder.exists() and any(folder.iterdir()):
        try:
            store = Store.opened(folder)
        except FileNotFoundError:
            store = None
        if store is not None and store.digest == mark:
            return store
        raise ValueError(
            f"{folder} holds another batch (other values, inputs, model or code) or something else: give an empty folder, "
            "or delete that one."
        )
    shapes = {name: (leaf.shape, leaf.dtype) for name, leaf in result_shapes(member, recipe, axes).items()}
    times = {"time step": float(recipe.dt) * recipe.every, "samples": recipe.steps // recipe.every + 1}
    return Store.created(folder, axes, size, shapes, {**_told(recipe), DIGEST: mark, **times}, recipe.units())


def fill(
    store: Store,
    recipe: Recipe,
    devices: Sequence[jax.Device] | None,
    wanted: Sequence[int],
    progress: Progress = quiet,
    engine: Engine = "auto",
) -> None:
    """Compute the chunks `wanted` of a store."""
    for done, (number, found) in enumerate(
        chunks(member, recipe, store.axes, store.chunk, wanted, devices, engine), start=1
    ):
        store.write(number, found)
        progress(Stage("simulating", done / len(wanted)))


def _with_unit(units: Mapping[str, str], name: str) -> dict[str, str]:
    return {"units": units[name]} if name in units else {}


def labelled(
    values: Mapping[str, Any], axes: Axes, units: Mapping[str, str], time: np.ndarray, attributes: Mapping[str, Any]
) -> xr.Dataset:
    """Arrays of shape (members, ...) as a data set with the dimensions of `axes`, units and provenance."""
    dims = [one.name for one in axes.dimensions]
    coordinates: dict[str, Any] = {
        name: (one.name, np.asarray(series), _with_unit(units, name))
        for one in axes.dimensions
        for name, series in one.values.items()
    }
    data = {}
    for name, array in values.items():
        rest = ["time"] if array.ndim > 1 else []
        data[name] = ([*dims, *rest], array.reshape(*axes.shape, *array.shape[1:]), {"units": units[name]})
        if rest:
            coordinates["time"] = ("time", time, {"units": "s"})
    # A coordinate that shares its name with a result keeps it apart by a prefix.
    clash = sorted(set(coordinates) & set(data))
    coordinates = {f"axis_{name}" if name in clash else name: entry for name, entry in coordinates.items()}
    found = xr.Dataset(data, coordinates, dict(attributes))
    return found.set_coords(["status", "first_bad_time"])


def opened(folder: Path | str) -> xr.Dataset:
    """The batch in a folder, finished or not; what is not there yet is NaN. Values are read when they are asked for."""
    store = Store.opened(Path(folder))
    group, axes = store.group, store.axes
    attributes: dict[str, Any] = dict(group.attrs)
    time = np.arange(int(attributes["samples"])) * float(attributes["time step"])
    lazy = xr.open_zarr(Path(folder), consolidated=False, chunks=None, mask_and_scale=False)
    if len(axes.dimensions) == 1:
        one = axes.dimensions[0]
        found = lazy[list(store.names())].rename(member=one.name)
        units = store.axis_units
        found = found.assign_coords(
            {name: (one.name, series, _with_unit(units, name)) for name, series in one.values.items()}
        )
        if "time" in found.dims:
            found = found.assign_coords(time=("time", time, {"units": "s"}))
        found.attrs = attributes
        return found.set_coords(["status", "first_bad_time"])
    units = store.axis_units | {name: str(group[name].attrs["units"]) for name in store.names()}
    return labelled({name: np.asarray(group[name][:]) for name in store.names()}, axes, units, time, attributes)


def good(found: xr.Dataset) -> xr.Dataset:
    """`found` with members that went wrong as NaN: what statistics are taken of."""
    return found.where(found["status"] == GOOD)


def told_of(found: xr.Dataset) -> str:
    """How many members went wrong, and when first, in a sentence."""
    status = np.asarray(found["status"])
    bad = int((status != GOOD).sum())
    if not bad:
        return f"All {status.size:,} members ran to their end."
    when = float(np.nanmin(np.where(status != GOOD, np.asarray(found["first_bad_time"]), np.nan)))
    return (
        f"{bad:,} of {status.size:,} members ({bad / status.size:.2%}) went wrong, the first after {when:g} s: `status` "
        "says which, and `good` leaves them out."
    )
