"""What our own commands ask of JAX."""

from __future__ import annotations

import jax
import pytest

from smajax.core.runtime import require_float64


def test_single_precision_is_refused_with_what_to_do() -> None:
    require_float64("identify")
    before = jax.config.read("jax_enable_x64")
    jax.config.update("jax_enable_x64", False)
    try:
        with pytest.raises(ValueError, match=r"identify needs float64, .* call `smajax\.prepare\(\)` first"):
            require_float64("identify")
    finally:
        jax.config.update("jax_enable_x64", before)
