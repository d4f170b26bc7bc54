"""What our own commands, studies and tests ask of JAX; a user's own program asks what it likes."""

from __future__ import annotations

import gc
import os
from importlib.metadata import version
from pathlib import Path

from smajax.core.operating_system import user_cache

# XLA's newer way of compiling loops for a CPU takes two to four times as long for a fit, which runs as fast either way; a
# batch of many members runs up to three times as fast by it, and a little faster in the widest vectors. A flag that a version does not know ends the process: each has the versions of jaxlib with which it was tried.
FLAG = "--xla_cpu_use_fusion_emitters=false"
WIDE = "--xla_cpu_prefer_vector_width=512"
KNOWS = {FLAG: ((0, 7), (0, 10)), WIDE: ((0, 7), (0, 12))}
TRIED = ((0, 7), (0, 12))  # versions of jaxlib that the tests ran with
# Python's collector of garbage looks after 700 new objects, or 2,000. JAX makes millions that stay: to look at them again and again takes 3 % of an attribution.
RARELY = (50_000, 20, 20)


def kept_programs() -> Path:
    """Where compiled programs are kept: `JAX_COMPILATION_CACHE_DIR`, or `smajax` in the user's cache. May be deleted."""
    own = os.environ.get("JAX_COMPILATION_CACHE_DIR")
    return Path(own) if own else user_cache() / "smajax" / "programs"


def prepare(cores: bool = False) -> None:
    """Float64, and compiled programs kept from one process to the next (`kept_programs`). Before the first array of JAX.

    `cores` is for large batches: every core is a device of its own, and programs are compiled to run fast instead.
    """
    import jax

    major, minor = (int(part) for part in version("jaxlib").split(".")[:2])
    flags = os.environ.get("XLA_FLAGS", "")
    if cores:
        jax.config.update("jax_num_cpu_devices", os.cpu_count() or 1)
    flag = WIDE if cores else FLAG
    first, last = KNOWS[flag]
    if flag.split("=")[0] not in flags and first <= (major, minor) <= last:
        os.environ["XLA_FLAGS"] = f"{flags} {flag}".strip()
    jax.config.update("jax_enable_x64", True)
    jax.config.update("jax_compilation_cache_dir", str(kept_programs()))
    # Small ones too: a command has dozens of them.
    jax.config.update("jax_persistent_cache_min_compile_time_secs", 0.0)
    jax.config.update("jax_persistent_cache_min_entry_size_bytes", -1)


def require_float64(what: str) -> None:
    """Raise ValueError where JAX computes in single precision."""
    import jax.numpy as jnp

    if jnp.zeros(()).dtype != jnp.float64:
        raise ValueError(
            f"{what} needs float64, and JAX computes in float32: call `smajax.prepare()` first, before any array of JAX."
        )


def collect_rarely() -> None:
    """Have Python look for garbage seldom (`RARELY`); of a process of ours alone."""
    gc.set_threshold(*RARELY)
