"""Many runs by XLA: divided over the devices, and a device's part into blocks whose state fits the cache of a core."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax import lax
from jax.sharding import Mesh, PartitionSpec

BLOCK = 512  # runs at once on a core: about 100 numbers each fit its second-level cache
LEAST_BLOCK = 8
SMALL = 8  # a small batch is cut into so many blocks
ENOUGH_TO_COMPILE = 400.0  # blocks of 8 runs (`BlockLengths`)
ON_CARD = 1 << 17  # runs at once on a graphics card, which has no blocks: all of a chunk
Function = Callable[[Any, dict[str, jax.Array]], Any]


def on_card(devices: Sequence[jax.Device]) -> bool:
    """Whether these are graphics cards."""
    return devices[0].platform != "cpu"


def block_size(runs: int) -> int:
    """Runs that a core does at once.

    Not a matter of how many devices there are: in blocks of another length more than the last bits would round otherwise.
    """
    return min(BLOCK, max(LEAST_BLOCK, 1 << max(0, -(-runs // SMALL) - 1).bit_length()))


def rounded(count: int, block: int, devices: Sequence[jax.Device]) -> int:
    """The least number of runs that is no less than `count` and the same number of blocks on every device."""
    whole = block * len(devices)
    return whole * -(-count // whole)


@eqx.filter_jit
def _evaluated(
    function: Function, model: Any, values: dict[str, jax.Array], devices: tuple[jax.Device, ...], block: int
) -> Any:
    arrays, static = eqx.partition(model, eqx.is_array)

    def part(arrays: Any, values: dict[str, jax.Array]) -> Any:
        whole = eqx.combine(arrays, static)
        run = jax.vmap(lambda own: function(whole, own))
        blocks = jax.tree.map(lambda leaf: leaf.reshape(-1, block, *leaf.shape[1:]), values)
        result = lax.map(run, blocks)
        return jax.tree.map(lambda leaf: leaf.reshape(-1, *leaf.shape[2:]), result)

    # Over one device as well: it is then the same program that every device runs.
    mesh = Mesh(np.asarray(devices), ("runs",))
    over = PartitionSpec("runs")
    spread = jax.shard_map(part, mesh=mesh, in_specs=(PartitionSpec(), over), out_specs=over, check_vma=False)
    return spread(arrays, values)


@eqx.filter_jit
def _single(function: Function, model: Any, own: dict[str, jax.Array]) -> Any:
    return function(model, own)


def started(
    function: Function,
    model: Any,
    own: dict[str, np.ndarray],
    devices: tuple[jax.Device, ...],
    block: int,
    room: int | None = None,
) -> Callable[[], Any]:
    """The results when they are there, arrays of shape (runs, ...); `own` are arrays of shape (runs,).

    Filled up to `room` runs by repeating the last one, so that one compilation serves chunks of every size.
    """
    count = len(next(iter(own.values())))
    whole = rounded(max(room or 0, count), block, devices)
    filled = {
        name: jnp.asarray(np.concatenate([one, np.full(whole - count, one[-1])]), dtype=float)
        for name, one in own.items()
    }
    running = _evaluated(function, model, filled, devices, block)
    return lambda: jax.tree.map(lambda leaf: np.asarray(leaf)[:count], running)


class BlockLengths:
    """The block lengths for which one program was compiled, and how much they cost more than the best ones would have.

    To compile takes as long as some 400 blocks of 8 runs (10 s and 0.027 s for the arm, 166 s and 0.31 s for the model with every
    effect): a length that is there is taken until it has cost `ENOUGH_TO_COMPILE` more than the best one would have.
    """

    def __init__(self) -> None:
        self._compiled: list[int] = []
        self._beyond = 0.0

    def of(self, count: int) -> int:
        """The length to take for so many runs; it is then among those compiled."""
        best = next((size for size in (SMALL, 8 * SMALL) if count <= SMALL * size), BLOCK)
        if best not in self._compiled:
            usable = min(self._compiled, key=lambda block: _cost(count, block), default=None)
            if usable is not None:
                beyond = max(0.0, _cost(count, usable) - _cost(count, best))
                if self._beyond + beyond <= ENOUGH_TO_COMPILE:
                    self._beyond += beyond
                    return usable
            self._compiled.append(best)
        return best


def _cost(count: int, block: int) -> float:
    """Time of so many runs, in blocks of 8: a block of 64 takes three and a half times as long as one of 8."""
    return -(-count // block) * (1.0 + block / 16.0) / 1.5


def evaluated(
    function: Function, model: Any, own: dict[str, np.ndarray], alone: bool = False, blocks: BlockLengths | None = None
) -> Any:
    """What the function gives, every leaf with one row a run, on JAX's default device.

    Block after block, so that at most three programs are compiled whatever the numbers of runs; `blocks` remembers which
    there are. `alone`: each run by itself.
    """
    names, count = list(own), len(next(iter(own.values())))
    if alone:
        each = [
            _single(function, model, {name: jnp.asarray(own[name][k], dtype=float) for name in names})
            for k in range(count)
        ]
        return jax.tree.map(lambda *leaves: np.stack([np.asarray(leaf) for leaf in leaves]), *each)
    block = (BlockLengths() if blocks is None else blocks).of(count)
    device = jnp.zeros(()).device
    parts = [
        started(function, model, {name: one[first : first + block] for name, one in own.items()}, (device,), block)()
        for first in range(0, count, block)
    ]
    return jax.tree.map(lambda *leaves: np.concatenate(leaves), *parts)
