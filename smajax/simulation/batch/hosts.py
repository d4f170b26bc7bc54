"""One batch on several hosts: JAX's distributed runtime numbers the processes, and each fills its chunks of one store.

Processes share a folder and nothing else: no number travels between them while they compute, so the time falls as one
over their count, and one that is lost takes no more with it than the chunk it was at.
"""

from __future__ import annotations

import time as clock
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import jax
import xarray as xr

from smajax.core.progress import Progress, as_progress, quiet
from smajax.model.system import System
from smajax.model.types import Series
from smajax.simulation.batch.axes import Axes
from smajax.simulation.batch.chunks import chunk_size
from smajax.simulation.batch.integration import as_stored
from smajax.simulation.batch.recipe import BatchSettings, recipe_of
from smajax.simulation.batch.run_batch import BUDGET, begun, created_or_opened, fill, opened
from smajax.simulation.batch.single_run import single_run
from smajax.simulation.batch.store import Store
from smajax.simulation.simulate import DEFAULT_STEP

CHUNKS = 4  # a process, at least
PATIENCE = 120.0  # s that a process waits for the first one to lay out the store


def join(coordinator: str | None = None, processes: int | None = None, process: int | None = None) -> tuple[int, int]:
    """(number of this process, how many there are). Before anything else of JAX.

    Under SLURM, Open MPI or MPICH with mpi4py nothing needs to be given: `jax.distributed` finds it. Elsewhere
    `coordinator` is `host:port` of process 0.
    """
    jax.distributed.initialize(coordinator, processes, process)
    return jax.process_index(), jax.process_count()


def run_batch_here(  # the public form, as `run_batch`
    system: System,
    inputs: Mapping[str, Series | float],
    axes: Axes,
    out: Path | str,
    process: int,
    processes: int,
    *,
    budget: int = BUDGET,
    dt: float = DEFAULT_STEP,
    progress: Progress = quiet,
    **settings: Any,
) -> xr.Dataset:
    """This process's share of `run_batch(..., out=out)`: chunks whose number leaves `process` when divided by `processes`.

    The folder must be one that all processes see. Raises TimeoutError when process 0 does not lay the store out.
    Run again, with any number of processes, it resumes with the chunks that are missing.
    """
    progress = as_progress(progress)
    folder = Path(out)
    asked = BatchSettings(dt=dt, **settings)
    recipe = recipe_of(system, inputs, axes, asked)
    devices = tuple(jax.local_devices())
    size = chunk_size(single_run, recipe, axes, budget, devices)
    # Several chunks a process, so that a lost one takes little with it; the size must not depend on the process.
    size = min(size, max(1, -(-axes.size // (CHUNKS * processes))))
    if process == 0:
        recipe, how = begun(recipe, axes, asked.tolerance, folder)
        store = created_or_opened(folder, recipe, axes, size, how)
    else:  # as process 0 chose to integrate
        store = _awaited(folder)
        recipe, _ = as_stored(recipe, dict(store.group.attrs))
    wanted = [number for number in store.missing() if number % processes == process]
    fill(store, recipe, None, wanted, progress)
    return opened(folder)


def _awaited(folder: Path) -> Store:
    end = clock.monotonic() + PATIENCE
    while clock.monotonic() < end:
        try:
            return Store.opened(folder)
        except FileNotFoundError:
            clock.sleep(0.1)
    raise TimeoutError(
        f"process 0 has not laid out {folder} within {PATIENCE:g} s: is it running, and is the folder the same on all hosts?"
    )
