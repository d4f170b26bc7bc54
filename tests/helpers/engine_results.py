"""A function by the translator and by XLA, and when two batches are the same."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from smajax.engine.kernel import Kernel, compiled
from smajax.engine.translate import VECTORS, translate

Function = Callable[..., jax.Array]


def by_machine_code(
    function: Function,
    *own: np.ndarray,
    lanes: int = 8,
    wide: bool = False,
    vectors: int = VECTORS,
    mask: str = "i1",
    quickly: bool = False,
) -> np.ndarray:
    """`function` of every member by the translator."""
    program = jax.make_jaxpr(function)(*(jnp.zeros((), one.dtype) for one in own))
    translated = translate(program, [True] * len(own), lanes, wide, vectors, mask)
    kernel = Kernel(compiled(translated.text, quickly), translated.lanes, translated.results, translated.scratch)
    return kernel([], [np.ascontiguousarray(one) for one in own], threads=1)[0]


def by_xla(function: Function, *own: np.ndarray) -> np.ndarray:
    """As XLA optimises it: other tests do without (tests/conftest.py), and a product and a sum are then rounded one by one."""
    return np.asarray(jax.jit(jax.vmap(function), compiler_options={"xla_backend_optimization_level": 3})(*own))


def same_batch(ours, theirs, share):
    """Every series and measure to a share of its largest value, and the same members gone wrong."""
    assert set(ours) == set(theirs)
    for name in ours:
        scale = float(np.abs(theirs[name]).max())
        np.testing.assert_allclose(ours[name], theirs[name], rtol=0.0, atol=share * scale, err_msg=str(name))
    np.testing.assert_array_equal(ours["status"], theirs["status"])


def summed(model: Any, own: dict[str, Any]) -> Any:
    """A program of one addition."""
    return model + own["a"]
