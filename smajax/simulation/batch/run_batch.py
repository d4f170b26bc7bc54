"""`run_batch`: a system, its inputs and what varies -> a labelled data set, in memory or streamed to a folder."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import closing
from pathlib import Path
from typing import Any

import jax
import numpy as np
import xarray as xr

from smajax.core.operating_system import available_memory
from smajax.core.progress import Progress, Stage, as_progress, quiet
from smajax.core.provenance import digest, provenance
from smajax.engine import Engine
from smajax.model.system import System
from smajax.model.types import Series
from smajax.simulation.batch.axes import Axes
from smajax.simulation.batch.chunks import chunk_size, chunks, result_shapes
from smajax.simulation.batch.impossible import marked
from smajax.simulation.batch.integration import INTEGRATION, as_stored, attributes_of, integrated_recipe
from smajax.simulation.batch.recipe import STORED, BatchSettings, recipe_of
from smajax.simulation.batch.single_run import Recipe, single_run
from smajax.simulation.batch.store import DIGEST, Store
from smajax.simulation.dataset import errors_by_variable
from smajax.simulation.integration_error import AUTO, Tolerance
from smajax.simulation.measures import AbstractMeasure
from smajax.simulation.observers import GOOD, IMPOSSIBLE
from smajax.simulation.simulate import DEFAULT_STEP

BUDGET = 1 << 30  # bytes


def within_memory(budget: int) -> int:
    """The budget, or half of what this program may still take where that is less: a cap makes chunks smaller."""
    free = available_memory()
    return budget if free is None else min(budget, free // 2)


def run_batch(  # the public form: what goes inwards is a `BatchSettings`
    system: System,
    inputs: Mapping[str, Series | float],
    axes: Axes,
    *,
    seconds: float | None = None,
    dt: float = DEFAULT_STEP,
    every: int = 1,
    keep: Sequence[str] = STORED,
    measures: Sequence[AbstractMeasure] = (),
    tolerance: Tolerance = AUTO,
    slopes: Sequence[str] = (),
    budget: int = BUDGET,
    out: Path | str | None = None,
    devices: Sequence[jax.Device] | None = None,
    engine: Engine = "auto",
    progress: Progress = quiet,
) -> xr.Dataset:
    """Simulate every run of `axes` and label the results.

    `axes` (`batch.axes`: `grid`, `zipped`, `sampled`, and their products) names parameters of the system or input
    channels, SI. `inputs` are numbers, or series of shape (n,) shared by all runs. Of each run `keep` is stored every
    `every` steps of `dt` seconds, and `measures`; with `keep=()` no trajectory is stored, whatever the length.

    `dt` is the clock of inputs, results and measures. How finely runs are integrated in between follows from the error, measured on
    sixteen runs of the batch against a far finer integration: the cheapest that leaves less than 3e-4 of a whole transformation in what
    is stored is taken, one step a sample where that is enough. What was reached is the attribute `integration_error` (JSON). With a number
    for `tolerance` a run takes as many steps between two samples as its error asks for: with 1e-4 (of 1 C and of 1 % strain, a step) and
    samples of 50 ms the worst runs are more accurate than with steps of 5 ms, typical ones less (to 1e-3 degrees), and it is several times
    as fast; an end stop met at speed is no better. None is one step a sample, and nothing is measured.

    `slopes` names parameters, and inputs of `axes`: the result then has the derivative of every measure by each of them, as
    `mean_square_position_by_wire_diameter`. They are found along error-controlled steps (forward mode), at a
    tolerance that leaves 2 % of the largest slope of the sixteen runs at most: each parameter costs about one run more, for all measures together. Through equal steps the derivative of
    a run that transforms fully is that of where branches end within the steps, which may have another sign. With a `tolerance` of None, and of a coupon, steps are equal, and slopes
    are found backwards through the run (reverse mode): those of one measure by all parameters together in less than four times the time of the run, in memory that grows as the square
    root of its steps. Take `dt` so small then that half of it changes them little. Those of a run that went wrong mean nothing: `good` leaves them out.

    The result has the dimensions of `axes` and `time`, `status` (0 good, 1 a number that is not finite, 2 runaway heat, 3 a stage that did not converge, 4 impossible parameters) and
    `first_bad_time`. Results take a quarter of `budget` bytes at a time, or of half of the memory that is left. With `out` they are streamed to a Zarr group
    there, and the same call resumes where an earlier one was stopped; the data set returned then reads from disk, as
    `smajax.simulation.batch.run_batch.opened(out)` does by itself.

    On a processor the batch is machine code (`smajax.engine`), five to twenty times as fast as by XLA; `engine="xla"` asks for the other
    (they agree to 1e-12 of a run), and where only XLA can do it, it does.

    A run whose parameters are out of their bounds, or transformation temperatures or end stops in the wrong order, is simulated as it is, with a
    warning and with status 4, whatever else went wrong in it.
    A length that is no multiple of `dt` ends at the nearest one, with a warning. Raises ValueError for what does not fit together, a parameter of `system` out of its bounds, and when `out` holds another batch.
    """
    progress = as_progress(progress)
    settings = BatchSettings(seconds, dt, every, keep, measures, tolerance, slopes)
    recipe, how = begun(recipe_of(system, inputs, axes, settings), axes, tolerance, out)
    several = tuple(devices or jax.local_devices())
    size = chunk_size(single_run, recipe, axes, within_memory(budget), several)
    if out is not None:
        store = created_or_opened(Path(out), recipe, axes, size, how)
        fill(store, recipe, devices, store.missing(), progress, engine)
        return opened(Path(out))
    parts: list[dict[str, np.ndarray]] = []
    count = -(-axes.size // size)
    with closing(chunks(single_run, recipe, axes, size, range(count), devices, engine)) as results:
        for number, result in results:
            parts.append(_of_chunk(recipe, axes, size, number, result))
            progress(Stage("simulating", (number + 1) / count))
    whole = {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}
    time = np.arange(recipe.steps // every + 1) * every * dt
    return labelled(whole, axes, recipe.units(), time, _attributes(recipe, how))


def begun(recipe: Recipe, axes: Axes, tolerance: Tolerance, out: Path | str | None) -> tuple[Recipe, dict[str, str]]:
    """(the recipe with its integration, the attributes of that): as the batch in `out` was begun, if there is one."""
    if out is not None and tolerance == AUTO and (store := _stored_in(Path(out))) is not None:
        return as_stored(recipe, dict(store.group.attrs))
    recipe, error = integrated_recipe(recipe, axes, tolerance)
    return recipe, attributes_of(recipe, error)


def _stored_in(folder: Path) -> Store | None:
    """The store in a folder that says how it is integrated; None where there is none."""
    if not (folder.exists() and any(folder.iterdir())):
        return None
    try:
        store = Store.opened(folder)
    except FileNotFoundError:
        return None
    return store if INTEGRATION in store.group.attrs else None


def _attributes(recipe: Recipe, how: Mapping[str, str]) -> dict[str, str]:
    inputs = {f"input {name}": f"{float(value):.10g}" for name, value in recipe.constants.items()}
    inputs |= {f"input {name}": f"series of {len(run)} samples" for name, run in recipe.series.items()}
    one = recipe.integration.tolerance
    tolerance = "none" if one is None else float(one)
    settings = {
        "dt": float(recipe.dt),
        "tolerance": tolerance,
        "every": recipe.every,
        "steps": recipe.steps,
        "precision": recipe.dt.dtype,
        **how,
    }
    return provenance(recipe.system, **settings, **inputs)


def _flat(values: Mapping[str, np.ndarray]) -> list[str | np.ndarray]:
    return [part for pair in values.items() for part in pair]


def created_or_opened(folder: Path, recipe: Recipe, axes: Axes, size: int, how: Mapping[str, str]) -> Store:
    """The store of this very batch in `folder`, created if there is nothing. ValueError when there is something else."""
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
    shapes = {name: (leaf.shape, leaf.dtype) for name, leaf in result_shapes(single_run, recipe, axes).items()}
    times = {"time step": float(recipe.dt) * recipe.every, "samples": recipe.steps // recipe.every + 1}
    return Store.created(
        folder, axes, size, shapes, {**_attributes(recipe, how), DIGEST: mark, **times}, recipe.units()
    )


def fill(
    store: Store,
    recipe: Recipe,
    devices: Sequence[jax.Device] | None,
    wanted: Sequence[int],
    progress: Progress = quiet,
    engine: Engine = "auto",
) -> None:
    """Compute the chunks `wanted` of a store."""
    with closing(chunks(single_run, recipe, store.axes, store.chunk, wanted, devices, engine)) as results:
        for done, (number, result) in enumerate(results, start=1):
            store.write(number, _of_chunk(recipe, store.axes, store.chunk, number, result))
            progress(Stage("simulating", done / len(wanted)))


def _of_chunk(
    recipe: Recipe, axes: Axes, size: int, number: int, result: Mapping[str, np.ndarray]
) -> dict[str, np.ndarray]:
    """What chunk `number` gave, with the runs marked whose values are impossible."""
    return marked(recipe.system, axes.runs(number * size, min((number + 1) * size, axes.size)), result)


def _with_unit(units: Mapping[str, str], name: str) -> dict[str, str]:
    return {"units": units[name]} if name in units else {}


def labelled(
    values: Mapping[str, Any], axes: Axes, units: Mapping[str, str], time: np.ndarray, attributes: Mapping[str, Any]
) -> xr.Dataset:
    """Arrays of shape (runs, ...) as a data set with the dimensions of `axes`, units and provenance."""
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
    result = xr.Dataset(data, coordinates, dict(attributes))
    return errors_by_variable(result).set_coords(["status", "first_bad_time"])


def opened(folder: Path | str) -> xr.Dataset:
    """The batch in a folder, finished or not; what is not there yet is NaN. Values are read when they are used."""
    store = Store.opened(Path(folder))
    group, axes = store.group, store.axes
    attributes: dict[str, Any] = dict(group.attrs)
    time = np.arange(int(attributes["samples"])) * float(attributes["time step"])
    lazy = xr.open_zarr(Path(folder), consolidated=False, chunks=None, mask_and_scale=False)
    if len(axes.dimensions) == 1:
        one = axes.dimensions[0]
        result = lazy[list(store.names())].rename({lazy["status"].dims[0]: one.name})
        units = store.axis_units
        result = result.assign_coords(
            {name: (one.name, series, _with_unit(units, name)) for name, series in one.values.items()}
        )
        if "time" in result.dims:
            result = result.assign_coords(time=("time", time, {"units": "s"}))
        result.attrs = attributes
        return errors_by_variable(result).set_coords(["status", "first_bad_time"])
    units = store.axis_units | {name: str(group[name].attrs["units"]) for name in store.names()}
    return labelled({name: np.asarray(group[name][:]) for name in store.names()}, axes, units, time, attributes)


def good(result: xr.Dataset) -> xr.Dataset:
    """`result` with runs that went wrong as NaN: what statistics are taken of."""
    return result.where(result["status"] == GOOD)


def status_summary(result: xr.Dataset) -> str:
    """How many runs went wrong, how many of them by parameters that are impossible, and when first, in a sentence."""
    status = np.asarray(result["status"])
    bad = int((status != GOOD).sum())
    if not bad:
        return f"All {status.size:,} runs ran to their end."
    cannot_be = int((status == IMPOSSIBLE).sum())
    why = f"{cannot_be:,} with impossible parameters (out of their bounds, or in the wrong order)" if cannot_be else ""
    if bad > cannot_be:
        on_the_way = (status != GOOD) & (status != IMPOSSIBLE)
        when = float(np.asarray(result["first_bad_time"])[on_the_way].min())
        why = f"{why}, of the others the first after {when:g} s" if why else f"the first after {when:g} s"
    return (
        f"{bad:,} of {status.size:,} runs ({bad / status.size:.2%}) went wrong, {why}: `status` says which, and `good` "
        "leaves them out."
    )
