"""What smajax runs on, for a person who asks for help, and what may be wrong with it."""

from __future__ import annotations

import os
import re
from importlib import metadata
from pathlib import Path
from typing import Any

from smajax.core.machine import machine
from smajax.core.operating_system import available_memory
from smajax.core.plugins import PluginError, versions
from smajax.core.runtime import TRIED, kept_programs

PACKAGE = "smajax"
SAME = 1e-6  # C
WORK = ("dev", "docs")  # extras for work on smajax itself: no command uses them


def _requirements() -> dict[str, bool]:
    """Every package that a command uses -> whether it is of an extra."""
    result: dict[str, bool] = {}
    for line in metadata.requires(PACKAGE) or ():
        name = re.match(r"[\w.-]+", line)
        extra = re.search(r"extra == ['\"]([\w.-]+)", line)
        if name is not None and (extra is None or extra[1] not in WORK):
            result[name.group()] = result.get(name.group(), True) and extra is not None
    return result


def _version(name: str) -> str:
    try:
        return metadata.version(name)
    except metadata.PackageNotFoundError:
        return ""


def _size(folder: Path) -> int:
    return sum(one.stat().st_size for one in folder.rglob("*") if one.is_file()) if folder.is_dir() else 0


def _engine() -> dict[str, Any]:
    """Which engine runs the programs and why not the other, shown by a run that is compiled and simulated by each."""
    import jax.numpy as jnp
    import numpy as np

    from smajax.engine import engine_of
    from smajax.engine.facade import VARIABLE, reason
    from smajax.model.presets import build
    from smajax.simulation.compiled import simulate_compiled

    requested = engine_of()
    result: dict[str, Any] = {"runs": "native", "why": "", "vector_bits": None}
    if requested == "xla":
        return {**result, "runs": "xla", "why": f"{VARIABLE} asks for it"}
    system = build("flexinol_table_3_2", "dead_weight", "voltage")
    command = {"voltage": jnp.full(21, 3.0)}
    try:
        from smajax.engine.kernel import vector_bits

        result["vector_bits"] = vector_bits()
        run = simulate_compiled(system, command, 0.01, engine="native")
    except Exception as error:
        return {**result, "runs": "none" if requested == "native" else "xla", "faulty": True, "why": reason(error)}
    try:
        by_xla = simulate_compiled(system, command, 0.01, engine="xla")
    except Exception as error:
        return {**result, "faulty": True, "why": f"XLA, which machine code is compared with, fails: {reason(error)}"}
    off = float(np.abs(run.temperature - by_xla.temperature).max())
    if not off < SAME:
        return {**result, "faulty": True, "why": f"a run is {off:g} C off that of XLA"}
    return result


def _plugin_faults() -> list[str]:
    """What is wrong with the parts that other packages bring: the effects, the loads, and what each does when it is used."""
    faults: list[str] = []
    # Each is imported, and so loads what is plugged in, by itself: one that fails must not hide the other.
    try:
        from smajax.model.presets import LOADS, made_load

        for name in LOADS:
            try:
                made_load(name)
            except PluginError as error:
                faults += str(error).splitlines()
    except PluginError as error:
        faults += str(error).splitlines()
    try:
        import smajax.model.effects.library  # noqa: F401
    except PluginError as error:
        return faults + str(error).splitlines()
    if not faults:  # a run needs a load
        from smajax.attribution.neutral_at_base import not_neutral

        faults += not_neutral()
    return faults


def examine(engine: bool = True) -> dict[str, Any]:
    """Versions, machine, devices, cache and memory. `engine`: also compile and run a small model."""
    import jax

    cache = kept_programs()
    faults = _plugin_faults()
    return {
        "smajax": {"version": _version(PACKAGE), "folder": str(Path(__file__).parents[1])},
        "machine": {**machine(), "cores of the machine": os.cpu_count()},
        "packages": {name: _version(name) for name, extra in _requirements().items() if not extra},
        "packages of extras": {name: _version(name) for name, extra in _requirements().items() if extra},
        "devices": [f"{one.platform}: {one.device_kind}" for one in jax.devices()],
        "float64": bool(jax.config.read("jax_enable_x64")),
        # Without the tables of parts there is no model to try.
        "engine": _engine() if engine and not faults else {},
        "compiled programs": {
            "folder": str(cache),
            "bytes": _size(cache),
            "writable": os.access(
                cache if cache.is_dir() else next(one for one in cache.parents if one.exists()), os.W_OK
            ),
            "clear": "smajax doctor --clear-cache",
        },
        "memory": {"available_bytes": available_memory()},
        "plug-ins": list(versions()),
        "plug-in faults": faults,
    }


def remarks(result: dict[str, Any]) -> list[str]:
    """What is likely to give trouble, each with what to do."""
    lines = [
        f"plug-in: {fault} Until then the commands that need it refuse to work." for fault in result["plug-in faults"]
    ]
    lines += [
        f"{name} is not installed: pip install '{PACKAGE}'"
        for name, version in result["packages"].items()
        if not version
    ]
    jaxlib = result["machine"]["versions"].get("jaxlib", "0.0")
    numbers = tuple(int(part) for part in jaxlib.split(".")[:2])
    if not TRIED[0] <= numbers <= TRIED[1]:
        lines.append(
            f"jaxlib {jaxlib} is none that was tried ({TRIED[0]} to {TRIED[1]}): it compiles with its own defaults."
        )
    if not result["float64"]:
        lines.append("JAX computes in float32 here: jax.config.update('jax_enable_x64', True) before the first array.")
    if result["engine"].get("faulty"):
        lines.append(
            {
                "native": f"machine code gives wrong numbers here ({result['engine']['why']}): set SMAJAX_ENGINE=xla, and please report it.",
                "xla": f"machine code does not work here ({result['engine']['why']}): XLA is used, several times slower.",
                "none": f"machine code does not work here ({result['engine']['why']}), and SMAJAX_ENGINE=native asks for nothing else.",
            }[result["engine"]["runs"]]
        )
    if not result["compiled programs"]["writable"]:
        lines.append(
            "the folder of compiled programs cannot be written: set JAX_COMPILATION_CACHE_DIR to one that can."
        )
    memory = result["memory"]["available_bytes"]
    if memory is not None and memory < 2 << 30:
        lines.append(f"only {memory / 1e9:.1f} GB of memory are free: give `run_batch` a smaller `budget`.")
    return lines


def clear_cache() -> int:
    """Delete the compiled programs, and nothing else that may lie in their folder; the bytes that are free again."""
    folder = kept_programs()
    before = _size(folder)
    for kind in ("*-cache", "*-atime", f"lanes/{'[0-9a-f]' * 64}", f"native/{'[0-9a-f]' * 64}"):
        for one in folder.glob(kind):
            one.unlink(missing_ok=True)
    return before - _size(folder)
