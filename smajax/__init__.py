"""smajax: differentiable shape-memory-alloy actuators, and the loop from measured runs to the missing effect.

    import smajax as sma

    found = sma.simulate_dataset(sma.compose("niti_table_3_1", "arm", "amplified_voltage"), {"voltage": volts})

The names below are imported when they are first asked for, so that a command which needs none of them starts at once.
JAX's precision is the caller's choice: `sma.prepare()` before the first array asks for float64, and keeps compiled programs
from one process to the next; `jax.config.update("jax_enable_x64", True)` asks for float64 alone.
"""

from __future__ import annotations

import sys
from importlib import import_module
from types import ModuleType
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from smajax import control_presets as control_presets
    from smajax import effects as effects
    from smajax import measure as measure
    from smajax import presets as presets
    from smajax import reference as reference
    from smajax import units as units
    from smajax.batch.axes import grid as grid
    from smajax.batch.axes import sampled as sampled
    from smajax.batch.axes import zipped as zipped
    from smajax.batch.run import good as good
    from smajax.batch.run import run_batch as run_batch
    from smajax.batch.run import told_of as told_of
    from smajax.close_loop import close_loop as close_loop
    from smajax.closed_loop import simulate_closed_loop as simulate_closed_loop
    from smajax.compiled import simulate_compiled as simulate_compiled
    from smajax.compose import compose as compose
    from smajax.control_presets import CONTROLLERS as CONTROLLERS
    from smajax.controller.base import AbstractController as AbstractController
    from smajax.dataset import simulate_dataset as simulate_dataset
    from smajax.effects.base import AbstractEffect as AbstractEffect
    from smajax.effects.library import LIBRARY as LIBRARY
    from smajax.extended import extended as extended
    from smajax.identify import identify as identify
    from smajax.load.base import AbstractMovingLoad as AbstractMovingLoad
    from smajax.loop import Loop as Loop
    from smajax.loop import simulate_loop_dataset as simulate_loop_dataset
    from smajax.measured_state import Sensor as Sensor
    from smajax.merit import merit as merit
    from smajax.open_experiment import open_experiment as open_experiment
    from smajax.parameters import check_bounds as check_bounds
    from smajax.parameters import get_parameters as get_parameters
    from smajax.parameters import parameter as parameter
    from smajax.parameters import parameter_values as parameter_values
    from smajax.parameters import set_parameters as set_parameters
    from smajax.plot import plot as plot
    from smajax.presets import DRIVES as DRIVES
    from smajax.presets import LOADS as LOADS
    from smajax.presets import WIRES as WIRES
    from smajax.presets import build as build
    from smajax.report.identify_page import write_identified as write_identified
    from smajax.report.write import write_report as write_report
    from smajax.runtime import prepare as prepare
    from smajax.simulate import simulate as simulate
    from smajax.system import System as System
    from smajax.wire.laws import under_law as under_law

    EFFECTS, load_experiment = LIBRARY, open_experiment
    __version__: str

# Name -> the module that has it, and its name there.
NAMES = {
    "AbstractController": ("smajax.controller.base", "AbstractController"),
    "AbstractEffect": ("smajax.effects.base", "AbstractEffect"),
    "AbstractMovingLoad": ("smajax.load.base", "AbstractMovingLoad"),
    "CONTROLLERS": ("smajax.control_presets", "CONTROLLERS"),
    "DRIVES": ("smajax.presets", "DRIVES"),
    "EFFECTS": ("smajax.effects.library", "LIBRARY"),
    "LOADS": ("smajax.presets", "LOADS"),
    "Loop": ("smajax.loop", "Loop"),
    "Sensor": ("smajax.measured_state", "Sensor"),
    "System": ("smajax.system", "System"),
    "WIRES": ("smajax.presets", "WIRES"),
    "build": ("smajax.presets", "build"),
    "check_bounds": ("smajax.parameters", "check_bounds"),
    "close_loop": ("smajax.close_loop", "close_loop"),
    "compose": ("smajax.compose", "compose"),
    "extended": ("smajax.extended", "extended"),
    "get_parameters": ("smajax.parameters", "get_parameters"),
    "good": ("smajax.batch.run", "good"),
    "grid": ("smajax.batch.axes", "grid"),
    "identify": ("smajax.identify", "identify"),
    "load_experiment": ("smajax.open_experiment", "open_experiment"),
    "merit": ("smajax.merit", "merit"),
    "parameter": ("smajax.parameters", "parameter"),
    "parameter_values": ("smajax.parameters", "parameter_values"),
    "plot": ("smajax.plot", "plot"),
    "prepare": ("smajax.runtime", "prepare"),
    "run_batch": ("smajax.batch.run", "run_batch"),
    "sampled": ("smajax.batch.axes", "sampled"),
    "set_parameters": ("smajax.parameters", "set_parameters"),
    "simulate": ("smajax.simulate", "simulate"),
    "simulate_closed_loop": ("smajax.closed_loop", "simulate_closed_loop"),
    "simulate_compiled": ("smajax.compiled", "simulate_compiled"),
    "simulate_dataset": ("smajax.dataset", "simulate_dataset"),
    "simulate_loop_dataset": ("smajax.loop", "simulate_loop_dataset"),
    "told_of": ("smajax.batch.run", "told_of"),
    "under_law": ("smajax.wire.laws", "under_law"),
    "write_identified": ("smajax.report.identify_page", "write_identified"),
    "write_report": ("smajax.report.write", "write_report"),
    "zipped": ("smajax.batch.axes", "zipped"),
}
# A public name that was renamed -> (the new one, the version that will not have the old one): it works and warns till then.
RENAMED: dict[str, tuple[str, str]] = {}
# Modules that are asked for by their own name.
MODULES = ("control_presets", "effects", "measure", "presets", "reference", "units")


def _found(name: str) -> Any:
    module, own = NAMES[name]
    return getattr(import_module(module), own)


def __getattr__(name: str) -> Any:
    """PEP 562: what is not here yet."""
    if name == "__version__":
        from importlib.metadata import version

        return version("smajax")
    if name in MODULES:
        return import_module(f"smajax.{name}")
    if name in RENAMED:
        import warnings

        now, gone = RENAMED[name]
        warnings.warn(f"smajax.{name} is smajax.{now} now; it goes in version {gone}", DeprecationWarning, stacklevel=2)
        return _found(now)
    if name not in NAMES:
        raise AttributeError(
            f"module 'smajax' has no attribute {name!r}; it has {', '.join(sorted([*NAMES, *MODULES]))}"
        )
    return _found(name)


def __dir__() -> list[str]:
    own = (name for name in globals() if name.startswith("__"))
    return sorted({*own, *NAMES, *MODULES, "__version__"})


class _Package(ModuleType):
    """The package, in which a function goes before the module of its name.

    Importing a module puts it into its package under its own name: without this `smajax.simulate` would be the function
    or the module, as it happens what was imported before. `from smajax.simulate import ...` finds the module as ever.
    """

    def __setattr__(self, name: str, value: Any) -> None:
        if not (isinstance(value, ModuleType) and name in NAMES):
            super().__setattr__(name, value)


sys.modules[__name__].__class__ = _Package
