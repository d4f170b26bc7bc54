"""What a fit was made with, for its record."""

from __future__ import annotations

import platform
from importlib import metadata

import jax

PACKAGES = ("smajax", "jax", "equinox", "numpy", "scipy")


def made_with() -> dict[str, str]:
    """Versions, Python and the machine, in words."""
    return {
        **{f"version of {name}": metadata.version(name) for name in PACKAGES},
        "python": platform.python_version(),
        "machine": f"{platform.system()} {platform.machine()}, {jax.default_backend()}",
    }
