"""A function of one member, evaluated for many: traced, translated and compiled once for each kind of arguments."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Sequence
from typing import Any, TypeVar

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from smajax.compiling import compiling
from smajax.lanes import disk
from smajax.lanes.kernel import Kernel, compiled, divides_slowly, has_wide_vectors, vector_bits
from smajax.lanes.text import Unsupported
from smajax.lanes.translate import VECTORS, translate

KEPT = 128  # compiled functions
BITS = 60  # of the number by which members are put in order
MOST_SORTED = 6  # numbers of a member that are looked at for that

Made = TypeVar("Made")

_kept: dict[Hashable, Evaluator | str] = {}


class Evaluator:
    """`function(model, own)` of one member as a function of whole arrays, for models with arrays of the same shapes."""

    def __init__(
        self, kernel: Kernel, tree: Any, names: tuple[str, ...], dtype: np.dtype, shared: Sequence[np.dtype]
    ) -> None:
        self._kernel, self._tree, self._names, self._dtype, self._shared = kernel, tree, names, dtype, shared

    @property
    def scratch(self) -> int:
        """Memory that a thread works in, bytes."""
        return self._kernel.scratch

    def __call__(self, model: Any, own: dict[str, np.ndarray], threads: int) -> Any:
        """What the function gives, every leaf with one row a member; `own` are arrays of shape (members,)."""
        leaves = jax.tree.leaves(eqx.filter(model, _is_array))
        shared = [
            np.ascontiguousarray(_plain(leaf), dtype=dtype) for leaf, dtype in zip(leaves, self._shared, strict=True)
        ]
        order = alike([own[name] for name in self._names])
        values = [np.ascontiguousarray(own[name][order], dtype=self._dtype) for name in self._names]
        back = np.argsort(order)
        return jax.tree.unflatten(self._tree, [one[back] for one in self._kernel(shared, values, threads)])


def alike(series: Sequence[np.ndarray]) -> np.ndarray:
    """An order of members in which neighbours have nearly the same numbers, as indices.

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


def _is_array(leaf: Any) -> bool:
    return isinstance(leaf, jax.Array | np.ndarray)


def _is_key(leaf: Any) -> bool:
    return jnp.issubdtype(leaf.dtype, jax.dtypes.prng_key)


def _plain(leaf: Any) -> Any:
    """The numbers of a random key; anything else as it is."""
    return jax.random.key_data(leaf) if _is_key(leaf) else leaf


def _like(leaf: Any, plain: Any) -> Any:
    return jax.random.wrap_key_data(plain) if _is_key(leaf) else plain


def lanes_of(dtypes: set[str]) -> int:
    """Members side by side for a program of these kinds of numbers, of which the floating ones fill the vectors."""
    size = max((np.dtype(dtype).itemsize for dtype in dtypes if dtype.startswith("float")), default=8)
    return vector_bits() // (8 * size)


def mask_of(dtypes: set[str]) -> str:
    """LLVM's kind of a truth value in memory: what the processor compares to."""
    return "i1" if has_wide_vectors() else f"i{vector_bits() // lanes_of(dtypes)}"


def kind_of(function: Callable[[Any, Any], Any], model: Any, names: tuple[str, ...]) -> Hashable:
    """What a traced program depends on: not on the values of the model's arrays."""
    arrays, static = eqx.partition(model, _is_array)
    leaves, tree = jax.tree.flatten(arrays)
    settled, settled_tree = jax.tree.flatten(static)
    kinds = tuple((leaf.shape, str(leaf.dtype), getattr(leaf, "weak_type", False)) for leaf in leaves)
    # To Python 1, 1.0 and True are one key; to a traced program they are not.
    told = tuple((type(one), repr(one)) if isinstance(one, bool | int | float | complex) else one for one in settled)
    return function, tree, settled_tree, told, kinds, names, str(jnp.zeros(()).dtype)


def recalled(kept: dict[Hashable, Made], key: Hashable, make: Callable[[], Made]) -> Made:
    """What was made for a key before, or now; what was not asked for longest makes room."""
    found = kept.pop(key) if key in kept else make()
    while len(kept) >= KEPT:
        kept.pop(next(iter(kept)), None)
    kept[key] = found
    return found


def evaluator(
    function: Callable[[Any, Any], Any], model: Any, names: tuple[str, ...], alone: bool = False
) -> Evaluator:
    """`function` compiled; `names` are those of the numbers that a member has of its own. `alone`: for one member at a time.

    Raises Unsupported, which says what of the function cannot be translated.
    """

    def made() -> Evaluator | str:
        arrays, static = eqx.partition(model, _is_array)
        key = disk.key_of(function, model, names, alone) if disk.folder() else None
        known = disk.load(key) if key else None
        if known is not None:
            return _evaluator(known, names)
        try:
            with compiling():
                program = _compiled(function, arrays, static, names, alone)
            if key:
                disk.save(key, program)
            return _evaluator(program, names)
        except Unsupported as reason:
            return str(reason)

    found = recalled(_kept, (kind_of(function, model, names), alone), made)
    if isinstance(found, str):
        raise Unsupported(found)
    return found


def _evaluator(program: disk.Stored, names: tuple[str, ...]) -> Evaluator:
    kernel = Kernel(program.code, program.lanes, program.results, program.scratch)
    shared = [np.dtype(kind) for kind in program.shared]
    return Evaluator(kernel, program.tree, names, np.dtype(jnp.zeros(()).dtype), shared)


def _compiled(
    function: Callable[[Any, Any], Any], arrays: Any, static: Any, names: tuple[str, ...], alone: bool
) -> disk.Stored:
    leaves, tree = jax.tree.flatten(arrays)
    none = jnp.zeros(())
    shape: list[Any] = []

    def member(*flat: jax.Array) -> list[jax.Array]:
        given = [_like(leaf, one) for leaf, one in zip(leaves, flat, strict=False)]
        whole = eqx.combine(jax.tree.unflatten(tree, given), static)
        found = function(whole, dict(zip(names, flat[len(leaves) :], strict=True)))
        results, out = jax.tree.flatten(found)
        shape[:] = [out]
        return results

    program = jax.make_jaxpr(member)(*map(_plain, leaves), *(none for _ in names))
    dtypes = {str(aval.dtype) for aval in (*program.in_avals, *program.out_avals)}
    own = [False] * len(leaves) + [True] * len(names)
    vectors = 1 if alone else VECTORS
    translated = translate(program, own, lanes_of(dtypes), divides_slowly(), vectors, mask_of(dtypes))
    try:
        code = compiled(translated)
    except RuntimeError as reason:  # LLVM's words for a text that makes no sense to it
        raise Unsupported(f"something in this program ({str(reason).splitlines()[-1]})") from None
    shared = tuple(str(aval.dtype) for aval in program.in_avals[: len(leaves)])
    return disk.Stored(code, translated.lanes, translated.results, translated.scratch, shared, shape[0])
