"""A function of one run as machine code: traced by JAX, translated and compiled once for each kind of arguments."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import Future, wait
from threading import Event
from typing import Any, NamedTuple

import equinox as eqx
import jax
import numpy as np

from smajax.core.beside import begun
from smajax.core.compiling import compiling
from smajax.engine import cache
from smajax.engine.arguments import Along, is_array
from smajax.engine.kernel import Kernel, compiled, divides_slowly, has_wide_vectors, vector_bits
from smajax.engine.text import Array
from smajax.engine.traced import Function, Traced, collector_paused, plain
from smajax.engine.translate import VECTORS, translate

BITS = 60  # of the number by which runs are put in order
MOST_SORTED = 6  # numbers of a run that are looked at for that


class Layout(NamedTuple):
    """What the caller of a program's machine code has to know: of its arguments, its results and the memory that it works in."""

    lanes: int  # runs of a vector
    group: int  # vectors that go side by side
    scratch: int  # bytes a thread needs
    results: tuple[Array, ...]
    several: tuple[bool, ...]  # which results are one for each direction
    shared: tuple[str, ...]  # dtypes of the model's arrays
    own: str  # dtype of the numbers that a run has of its own
    # The results put together, a number in the place of each: their structure does not go from process to process, since in that of an equinox
    # module an object stands for none, and a copy of it does not.
    example: Any


class MachineCode(NamedTuple):
    """A compiled program as it goes from one process to another."""

    code: bytes
    layout: Layout


@collector_paused()
def machine_code(
    function: Function, model: Any, names: tuple[str, ...], alone: bool, quickly: bool, along: Along
) -> MachineCode:
    """A function of one run, traced, translated and compiled; raises whatever stands in the way. Arguments as of `NativeProgram`."""
    text, layout = _translated(Traced(function, model, names), alone, along)
    return MachineCode(_code(text, quickly), layout)


def _translated(traced: Traced, alone: bool, along: Along) -> tuple[str, Layout]:
    """LLVM's text of a program, and its layout."""
    program = traced.program
    kinds = [str(aval.dtype) for aval in program.in_avals]
    dtypes = {*kinds, *(str(aval.dtype) for aval in program.out_avals)}
    own = [False] * traced.shared + [True] * len(traced.names)
    each = [False] * traced.shared + [name in along.names for name in traced.names]
    vectors = 1 if alone else VECTORS
    found = translate(
        program, own, lanes_of(dtypes), divides_slowly(), vectors, mask_of(dtypes), along=each, directions=along.number
    )
    shared = tuple(kinds[: traced.shared])
    sizes = found.lanes, found.vectors, found.scratch
    example = jax.tree.unflatten(traced.tree, range(traced.tree.num_leaves))
    return found.text, Layout(*sizes, found.results, found.several, shared, str(traced.number), example)


class NativeProgram:
    """`function(model, own)` of one run as a function of whole arrays, for models with arrays of the same shapes."""

    def __init__(
        self, made: Traced | MachineCode, names: tuple[str, ...], alone: bool, along: Along, beside: bool, quickly: bool
    ) -> None:
        """`made`: the function as JAX traces it, or its machine code. `alone`: for one run at a time. `beside`: compiled by another thread, for which the first call waits. `quickly`, `along`: as of `program`.

        Raises Unsupported for what has no translation, and whatever LLVM raises: beside, at the first call.
        """
        if isinstance(made, MachineCode):
            layout = made.layout
            self._kernel = _done(_kernel, made.code, layout)
        else:
            text, layout = _translated(made, alone, along)
            make = _begun if beside else _done
            self._kernel = make(_compiled_kernel, text, layout, quickly)
        self.scratch = layout.scratch  # memory that a thread works in, bytes
        self._names, self._along, self._layout, self._tree = names, along, layout, jax.tree.structure(layout.example)
        self._shared = [np.dtype(kind) for kind in layout.shared]

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
        values = [np.ascontiguousarray(column[order], dtype=self._layout.own) for column in columns]
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
        for each in self._layout.several:
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


def _done(make: Callable[..., Kernel], *arguments: Any) -> Future[Kernel]:
    """Compiled now."""
    made: Future[Kernel] = Future()
    with compiling():
        made.set_result(make(*arguments))
    return made


def _begun(make: Callable[..., Kernel], *arguments: Any) -> Future[Kernel]:
    """Compiled by another thread: LLVM lets Python go on."""
    return begun(make, *arguments) or _done(make, *arguments)


def _compiled_kernel(text: str, layout: Layout, quickly: bool) -> Kernel:
    return _kernel(_code(text, quickly), layout)


def _kernel(code: bytes, layout: Layout) -> Kernel:
    return Kernel(code, layout.lanes, layout.results, layout.scratch, layout.group)


def _code(text: str, quickly: bool) -> bytes:
    """Loaded from the disk, or compiled and stored there."""
    key = cache.key_of(text, quickly)
    code = cache.load(key)
    if code is None:
        code = compiled(text, quickly)
        cache.save(key, code)
    return code


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
