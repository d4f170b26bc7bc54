"""Members in chunks over all devices: the same numbers on one core, on several, and on a graphics card.

A chunk is divided over the devices, and a device's part into blocks whose state fits the cache of a core: one block
after the other runs to its end.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax import lax
from jax.sharding import Mesh, PartitionSpec

from smajax.batch.axes import Axes

BLOCK = 512  # members at once on a core: about 100 numbers each fit its second-level cache
LEAST_BLOCK = 8
SMALL = 8  # a small batch is cut into so many blocks
MOST = 1 << 15  # members a chunk, however little is kept of each: what an interruption loses
ON_CARD = 1 << 17  # on a graphics card everything runs at once
Results = Any  # arrays by name: a dictionary, or one of records
Function = Callable[[Any, dict[str, jax.Array]], Results]


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


def member_bytes(function: Function, model: Any, axes: Axes) -> int:
    """What is kept of one member, bytes."""
    one = {name: jnp.zeros(()) for name in axes.names}
    shapes = eqx.filter_eval_shape(function, model, one)
    return sum(int(np.prod(leaf.shape, dtype=np.int64)) * leaf.dtype.itemsize for leaf in jax.tree.leaves(shapes))


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
) -> Iterator[tuple[int, Results]]:
    """(number, results) of the chunks `wanted`, each of `size` members but for the last, arrays of shape (members, ...).

    A chunk is filled up by repeating its last member, so that one compilation serves all. While the caller writes
    one chunk the devices work on the next.
    """
    several = tuple(devices or jax.local_devices())
    block = block_size(axes.size, several)
    room = rounded(size, block, several)
    ahead: tuple[int, int, Results] | None = None
    for number in wanted:
        start, stop = number * size, min((number + 1) * size, axes.size)
        values = {
            name: jnp.asarray(np.concatenate([own, np.full(room - len(own), own[-1])]), dtype=float)
            for name, own in axes.members(start, stop).items()
        }
        running = number, stop - start, _evaluated(function, model, values, several, block)
        if ahead is not None:
            yield _fetched(*ahead)
        ahead = running
    if ahead is not None:
        yield _fetched(*ahead)


def _fetched(number: int, count: int, found: Results) -> tuple[int, Results]:
    return number, jax.tree.map(lambda leaf: np.asarray(leaf)[:count], found)
