"""Runs of a batch in chunks over all cores or devices, by whichever engine runs them.

By machine code a run's numbers are the same to the last bit whatever runs beside it; XLA's are on as many devices as there are.
"""

from __future__ import annotations

from collections.abc import Callable, Generator, Hashable, Sequence
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from smajax.core.operating_system import available_cores
from smajax.engine import ON_CARD, Coming, Engine, block_size, cached, key_of, on_card, program, rounded
from smajax.simulation.batch.axes import Axes

MOST = 1 << 15  # runs a chunk, however little is stored of each: what an interruption loses
Results = Any  # arrays by name: a dictionary, or one of records
Function = Callable[[Any, dict[str, jax.Array]], Results]

_shapes: dict[Hashable, Any] = {}


def result_shapes(function: Function, model: Any, axes: Axes) -> Any:
    """Shapes and kinds of what one run gives; traced once for each kind of arguments."""
    one = {name: jnp.zeros(()) for name in axes.names}
    key = key_of(function, model, tuple(axes.names))
    return cached(_shapes, key, lambda: eqx.filter_eval_shape(function, model, one))


def run_bytes(function: Function, model: Any, axes: Axes) -> int:
    """What is stored of one run, bytes."""
    leaves = jax.tree.leaves(result_shapes(function, model, axes))
    return sum(int(np.prod(leaf.shape, dtype=np.int64)) * leaf.dtype.itemsize for leaf in leaves)


def chunk_size(function: Function, model: Any, axes: Axes, budget: int, devices: Sequence[jax.Device]) -> int:
    """Runs a chunk, so that its results take at most a quarter of `budget` bytes, and `MOST` at most (`ON_CARD` on each graphics card); chunks are even.

    A quarter: blocks and their concatenation on the device, and the copy that is written while the next chunk runs.
    Raises ValueError when not even one block fits.
    """
    each = run_bytes(function, model, axes)
    card = on_card(devices)
    whole = rounded(1, 1 if card else block_size(axes.size), devices)
    most = budget // 4 // max(each, 1)
    if most < whole:
        raise ValueError(
            f"one run stores {each:,} bytes, and {budget:,} bytes have no room for {whole} at once (4 copies): store "
            "fewer values, every so many steps only (`every`), or measures in the place of trajectories."
        )
    wholes = -(-axes.size // whole)
    count = -(-wholes // max(1, min(most, ON_CARD * len(devices) if card else MOST) // whole))
    return whole * -(-wholes // count)


def chunks(
    function: Function,
    model: Any,
    axes: Axes,
    size: int,
    wanted: Sequence[int],
    devices: Sequence[jax.Device] | None = None,
    engine: Engine = "auto",
) -> Generator[tuple[int, Results], None, None]:
    """(number, results) of the chunks `wanted`, each of `size` runs but for the last, arrays of shape (runs, ...).

    While the caller writes one chunk the next is on its way. `devices` are those of XLA, and as many threads otherwise;
    all that there are where they are not given. Closed before its end, it stops the next. Raises Unsupported where `engine` is "native" and the function is not for it.
    """
    several = tuple(devices or jax.local_devices())
    run = program(function, model, tuple(axes.names), engine=engine, devices=several)
    threads = len(several) if devices else available_cores()
    block = -(-size // len(several)) if on_card(several) else block_size(axes.size)
    waiting: list[tuple[int, Coming]] = []
    try:
        for number in wanted:
            start, stop = number * size, min((number + 1) * size, axes.size)
            waiting.append((number, run.begin(model, axes.runs(start, stop), threads, several, block, size)))
            if len(waiting) > 1:
                yield waiting[0][0], waiting[0][1]()
                del waiting[0]
        for number, coming in waiting:
            yield number, coming()
    finally:  # Ctrl-C, or a caller that ends: without this the process would wait for results that nobody reads
        for _, coming in waiting:
            coming.stop()
