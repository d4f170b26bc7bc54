"""The machine and the versions that numbers were measured with."""

from __future__ import annotations

import os
import platform
import resource
import shutil
import subprocess
from contextlib import suppress
from importlib import metadata
from pathlib import Path

PACKAGES = ("smajax", "jax", "jaxlib", "numpy", "scipy")


def _processor() -> str:
    """As the system names it."""
    file = Path("/proc/cpuinfo")
    if file.exists():
        named = [
            line.split(":", 1)[1].strip() for line in file.read_text().splitlines() if line.startswith("model name")
        ]
        if named:
            return named[0]
    return platform.processor() or platform.machine()


def _compiler() -> str:
    result = shutil.which("g++")
    return (
        subprocess.run([result, "--version"], capture_output=True, text=True).stdout.splitlines()[0] if result else ""
    )


def machine() -> dict[str, object]:
    """In words, for a table of results."""
    return {
        "processor": _processor(),
        "cores": len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count(),
        "load at the start": round(os.getloadavg()[0], 2),
        "system": f"{platform.system()} {platform.machine()}",
        "python": platform.python_version(),
        "compiler": _compiler(),
        "versions": {name: metadata.version(name) for name in PACKAGES},
    }


def peak_memory() -> int:
    """Most bytes that this process has had in memory so far."""
    unit = 1 if platform.system() == "Darwin" else 1024
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * unit


def available_memory() -> int | None:
    """Bytes that a program may still take without swapping and within its caps; None where the system does not say."""
    limits = [*_free(), *_below_caps()]
    return max(0, min(limits)) if limits else None


def _free() -> list[int]:
    """Of the machine, and of the container that it may be."""
    result = []
    file = Path("/proc/meminfo")
    if file.exists():
        for line in file.read_text().splitlines():
            if line.startswith("MemAvailable:"):
                result.append(1024 * int(line.split()[1]))
    group = Path("/sys/fs/cgroup")
    with suppress(OSError, ValueError):  # no container, or one without a cap
        result.append(int((group / "memory.max").read_text()) - int((group / "memory.current").read_text()))
    return result


def _below_caps() -> list[int]:
    """What `ulimit -v` and `ulimit -d` leave to this process."""
    file, result = Path("/proc/self/statm"), []
    if file.exists():
        pages = [int(part) for part in file.read_text().split()]
        for cap, taken in ((resource.RLIMIT_AS, pages[0]), (resource.RLIMIT_DATA, pages[5])):
            soft = resource.getrlimit(cap)[0]
            if soft != resource.RLIM_INFINITY:
                result.append(soft - taken * resource.getpagesize())
    return result
