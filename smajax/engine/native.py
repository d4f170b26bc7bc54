"""A function of one run as machine code: traced by JAX, translated and compiled once for each kind of arguments."""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import Future, wait
from threading import Event
from typing import Any

import equinox as eqx
import jax
import numpy as np

from smajax.core.beside import begun
from smajax.core.compiling import compiling
from smajax.engine import cache
from smajax.engine.arguments import ONE_DIRECTION, Along, is_array
from smajax.engine.kernel import Kernel, compiled, divides_slowly, has_wide_vectors, vector_bits
from smajax.engine.traced import Traced, plain
from smajax.engine.translate import VECTORS, Translated, translate

BITS = 60  # of the number by which runs are put in order
MOST_SORTED = 6  # numbers of a run that are looked at for that


class NativeProgram:
    """`function(model, own)` of one run as a function of whole arrays, for models with arrays of the same shapes."""

    def __init__(
        self,
        traced: Traced,
        alone: bool,
        beside: bool = False,
        quickly: bool = False,
        along: Along = ONE_DIRECTION,
    ) -> None:
        """`alone`: for one run at a time. `beside`: compiled by another thread, for which the first call waits. `quickly`, `along`: as of `program`.

        Raises Unsupported for what has no translation, and whatever LLVM raises: beside, at the first call.
        """
        program = traced.program
        kinds = [str(aval.dtype) for aval in program.in_avals]
        dtypes = {*kinds, *(str(aval.dtype) for aval in program.out_avals)}
        own = [False] * traced.shared + [True] * len(traced.names)
        vectors = 1 if alone else VECTORS
        each = [False] * traced.shared + [name in along.names for name in traced.names]
        translated = translate(
            program,
            own,
            lanes_of(dtypes),
            divides_slowly(),
            vectors,
            mask_of(dtypes),
            along=each,
            directions=along.number,
        )
        self.scratch = translated.scratch  # memory that a thread works in, bytes
        self._kernel = _begun(translated, quickly) if beside else _done(translated, quickly)
        self._tree, self._names, self._dtype = traced.tree, traced.names, traced.number
        self._along, self._several = along, translated.several
        self._shared = [np.dtype(kind) for kind in kinds[: traced.shared]]

    def wait(self) -> None:
        """Until it is compiled, or that has failed."""
        if not self._kernel.done():
            with compiling():
                wait([self._kernel])

    def __call__(self, model: Any, own: dict[str, np.ndarray], threads: int, stop: Event | None = None) -> Any:
        """What the function gives, every leaf with one row a run; `own` are arrays of shape (runs,), of `along` (runs, directions).

        Leaves then have shape (runs, directions, ...). Raises Stopped once `stop` is set.
        """
        leaves = jax.tree.leaves(eqx.filter(model, is_array))
        shared = [
            np.ascontiguousarray(plain(leaf), dtype=dtype) for leaf, dtype in zip(leaves, self._shared, strict=True)
        ]
        by_run = [own[name] for name in self._names if name not in self._along.names]
        order = alike(by_run) if by_run else np.arange(len(own[self._names[0]]))
        columns = [column for name in self._names for column in np.atleast_2d(own[name].T)]
        values = [np.ascontiguousarray(column[order], dtype=self._dtype) for column in columns]
        back = np.argsort(order)
        found = self._kernel.result()(shared, values, threads, stop)
        if not self._along.names:
            return jax.tree.unflatten(self._tree, [one[back] for one in found])
        return jax.tree.unflatten(self._tree, self._by_direction(found, back))

    def _by_direction(self, found: list[np.ndarray], back: np.ndarray) -> list[np.ndarray]:
        """Leaves of shape (runs, directions, ...) of what the program gives, which is emptied on the way.

        What is the same in all directions is there once, to be read and not written.
        """
        count, leaves = self._along.number, []
        for each in self._several:
            one = found.pop(0)
            shape = (len(back), count, *one.shape[1:])
            if not each:
                leaves.append(np.broadcast_to(one[back][:, None], shape))
                continue
            leaf = np.empty(shape, one.dtype)
            leaf[:, 0] = one[back]
            for number in range(1, count):
                leaf[:, number] = found.pop(0)[back]
            leaves.append(leaf)
        return leaves


def _done(translated: Translated, quickly: bool) -> Future[Kernel]:
    """Compiled now."""
    made: Future[Kernel] = Future()
    with compiling():
        made.set_result(_kernel(translated, quickly))
    return made


def _begun(translated: Translated, quickly: bool) -> Future[Kernel]:
    """Compiled by another thread: LLVM lets Python go on."""
    return begun(_kernel, translated, quickly) or _done(translated, quickly)


def _kernel(translated: Translated, quickly: bool) -> Kernel:
    """Loaded from the disk, or compiled and stored there."""
    key = cache.key_of(translated.text, quickly)
    code = cache.load(key)
    if code is None:
        code = compiled(translated, quickly)
        cache.save(key, code)
    return Kernel(code, translated.lanes, translated.results, translated.scratch, translated.vectors)


def alike(series: Sequence[np.ndarray]) -> np.ndarray:
    """An order of runs in which neighbours have nearly the same numbers, as indices.

    Side by side they take the same ways through the program, and none waits for another. The bits of the ranks by each
    number, interleaved (Morton's order).
    """
    count = len(series[0])
    varied = [one for one in series if one.min() < one.max()][:MOST_SORTED]
    if not varied:
        return np.arange(count)
    bits = min(BITS // len(varied), max(1, (count - 1).bit_length()))
    code = np.zeros(count, np.int64)
    for place, one in enumerate(varied):
        _, rank = np.unique(one, return_inverse=True)
        rank = rank * (1 << bits) // (int(rank.max()) + 1)
        for bit in range(bits):
            code |= ((rank >> bit) & 1) << (bit * len(varied) + place)
    return np.argsort(code, kind="stable")


def lanes_of(dtypes: set[str]) -> int:
    """Runs side by side for a program of these kinds of numbers, of which the floating ones fill the vectors."""
    size = max((np.dtype(dtype).itemsize for dtype in dtypes if dtype.startswith("float")), default=8)
    return vector_bits() // (8 * size)


def mask_of(dtypes: set[str]) -> str:
    """LLVM's kind of a truth value in memory: what the processor compares to."""
    return "i1" if has_wide_vectors() else f"i{vector_bits() // lanes_of(dtypes)}"
