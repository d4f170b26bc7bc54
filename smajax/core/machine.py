"""The machine and the versions that numbers were measured with."""

from __future__ import annotations

import platform
import shutil
import subprocess
from importlib import metadata

from smajax.core.operating_system import available_cores, load_average, processor_name

PACKAGES = ("smajax", "jax", "jaxlib", "numpy", "scipy")


def _compiler() -> str:
    result = shutil.which("g++")
    return (
        subprocess.run([result, "--version"], capture_output=True, text=True).stdout.splitlines()[0] if result else ""
    )


def machine() -> dict[str, object]:
    """In words, for a table of results."""
    load = load_average()
    return {
        "processor": processor_name() or platform.processor() or platform.machine(),
        "cores": available_cores(),
        "load at the start": None if load is None else round(load, 2),
        "system": f"{platform.system()} {platform.machine()}",
        "python": platform.python_version(),
        "compiler": _compiler(),
        "versions": {name: metadata.version(name) for name in PACKAGES},
    }
