"""Members in chunks over all cores or devices.

On a processor a chunk runs through `smajax.lanes`, in as many threads as there are cores: a member's numbers are then the
same to the last bit whatever runs beside it. What cannot be translated, and everything on a graphics card, is XLA's: a
chunk is divided over the devices, and a device's part into blocks whose state fits the cache of a core.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Hashable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import Any, Literal

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax import lax
from jax.sharding import Mesh, PartitionSpec

from smajax.batch.axes import Axes
from smajax.lanes.evaluate import Evaluator, evaluator, kind_of, recalled
from smajax.lanes.text import Unsupported

BLOCK = 512  # members at once on a core: about 100 numbers each fit its second-level cache
LEAST_BLOCK = 8
SMALL = 8  # a small batch is cut into so many blocks
MOST = 1 << 15  # members a chunk, however little is kept of each: what an interruption loses
ON_CARD = 1 << 17  # on a graphics card everything runs at once
Results = Any  # arrays by name: a dictionary, or one of records
Function = Callable[[Any, dict[str, jax.Array]], Results]
Engine = Literal["auto", "lanes", "xla"]


def block_size(members: int, devices: Sequence[jax.Device]) -> int:
    """Members that a device runs at once.

    Not a matter of how many devices there are: in blocks of another length more than the last bits would round otherwise.
    """
    if devices[0].platform != "cpu":
        return ON_CARD
    return min(BLOCK, max(LEAST_BLOCK, 1 << max(0, -(-members // SMALL) - 1).bit_length()))


@eqx.filter_jit
def _evaluated(
    function: Function, model: Any, values: dict[str, jax.Array], devices: tuple[jax.Device, ...], block: int
) -> Results:
    arrays, static = eqx.partition(model, eqx.is_array)

    def part(arrays: Any, values: dict[str, jax.Array]) -> Results:
        whole = eqx.combine(arrays, static)
        run = jax.vmap(lambda own: function(whole, own))
        blocks = jax.tree.map(lambda leaf: leaf.reshape(-1, block, *leaf.shape[1:]), values)
        found = lax.map(run, blocks)
        return jax.tree.map(lambda leaf: leaf.reshape(-1, *leaf.shape[2:]), found)

    # Over one device as well: it is then the same program that every device runs.
    mesh = Mesh(np.asarray(devices), ("members",))
    over = PartitionSpec("members")
    spread = jax.shard_map(part, mesh=mesh, in_specs=(PartitionSpec(), over), out_specs=over, check_vma=False)
    return spread(arrays, values)


def rounded(count: int, block: int, devices: Sequence[jax.Device]) -> int:
    """The least number of members that is no less than `count` and the same number of blocks on every device."""
    whole = block * len(devices)
    return whole * -(-count // whole)


_shapes: dict[Hashable, Any] = {}


def result_shapes(function: Function, model: Any, axes: Axes) -> Any:
    """Shapes and kinds of what one member gives; traced once for each kind of arguments."""
    one = {name: jnp.zeros(()) for name in axes.names}
    key = kind_of(function, model, tuple(axes.names))
    return recalled(_shapes, key, lambda: eqx.filter_eval_shape(function, model, one))


def member_bytes(function: Function, model: Any, axes: Axes) -> int:
    """What is kept of one member, bytes."""
    leaves = jax.tree.leaves(result_shapes(function, model, axes))
    return sum(int(np.prod(leaf.shape, dtype=np.int64)) * leaf.dtype.itemsize for leaf in leaves)


def chunk_size(function: Function, model: Any, axes: Axes, budget: int, devices: Sequence[jax.Device]) -> int:
    """Members a chunk, so that its results take at most a quarter of `budget` bytes, and `MOST` at most; chunks are even.

    A quarter: blocks and their concatenation on the device, and the copy that is written while the next chunk runs.
    Raises ValueError when not even one block fits.
    """
    each = member_bytes(function, model, axes)
    whole = rounded(1, block_size(axes.size, devices), devices)
    most = budget // 4 // max(each, 1)
    if most < whole:
        raise ValueError(
            f"one member keeps {each:,} bytes, and {budget:,} bytes have no room for {whole} at once (4 copies): keep "
            "fewer values, every so many steps only (`every`), or measures in the place of trajectories."
        )
    wholes = -(-axes.size // whole)
    count = -(-wholes // max(1, min(most, MOST) // whole))
    return whole * -(-wholes // count)


def chunks(
    function: Function,
    model: Any,
    axes: Axes,
    size: int,
    wanted: Sequence[int],
    devices: Sequence[jax.Device] | None = None,
    engine: Engine = "auto",
) -> Iterator[tuple[int, Results]]:
    """(number, results) of the chunks `wanted`, each of `size` members but for the last, arrays of shape (members, ...).

    While the caller writes one chunk the next is on its way. `devices` are those of XLA, and as many threads otherwise;
    all that there are where they are not given. ValueError where `engine` is "lanes" and the function is not for it.
    """
    several = tuple(devices or jax.local_devices())
    found = _translated(function, model, axes, several, engine)
    threads = len(several) if devices else available_cores()
    with ThreadPoolExecutor(1) as pool:
        ahead: tuple[int, int, Callable[[], Results]] | None = None
        for number in wanted:
            start, stop = number * size, min((number + 1) * size, axes.size)
            values = axes.members(start, stop)
            if found is None:
                coming = _dispatched(function, model, values, several, size, axes.size)
            else:
                coming = pool.submit(found, model, values, threads).result
            if ahead is not None:
                yield _fetched(*ahead)
            ahead = number, stop - start, coming
        if ahead is not None:
            yield _fetched(*ahead)


def available_cores() -> int:
    """Cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def _translated(
    function: Function, model: Any, axes: Axes, devices: Sequence[jax.Device], engine: Engine
) -> Evaluator | None:
    """The function for `smajax.lanes`; None where it is XLA's."""
    if engine == "xla" or (engine == "auto" and devices[0].platform != "cpu"):
        return None
    try:
        return evaluator(function, model, tuple(axes.names))
    except Unsupported as reason:
        if engine == "lanes":
            raise ValueError(f"the engine `lanes` has no translation for {reason}: leave `engine` at `auto`.") from None
        return None


def _dispatched(
    function: Function,
    model: Any,
    values: dict[str, np.ndarray],
    devices: tuple[jax.Device, ...],
    size: int,
    members: int,
) -> Callable[[], Results]:
    """One chunk given to XLA, filled up by repeating its last member, so that one compilation serves all."""
    block = block_size(members, devices)
    room = rounded(size, block, devices)
    filled = {
        name: jnp.asarray(np.concatenate([own, np.full(room - len(own), own[-1])]), dtype=float)
        for name, own in values.items()
    }
    running = _evaluated(function, model, filled, devices, block)
    return lambda: running


def _fetched(number: int, count: int, coming: Callable[[], Results]) -> tuple[int, Results]:
    return number, jax.tree.map(lambda leaf: np.asarray(leaf)[:count], coming())
