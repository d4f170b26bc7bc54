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
from typing import TYPE_CHECKING, Any

from smajax.core.moved_modules import install as _old_paths

if TYPE_CHECKING:
    from smajax.attribution.close_loop import close_loop as close_loop
    from smajax.control import presets as _control_presets
    from smajax.control import reference as reference
    from smajax.control.closed_loop import simulate_closed_loop as simulate_closed_loop
    from smajax.control.compose import compose as compose
    from smajax.control.controllers.base import AbstractController as AbstractController
    from smajax.control.figures_of_merit import merit as merit
    from smajax.control.loop_around import loop_around as loop_around
    from smajax.control.loop_dataset import Loop as Loop
    from smajax.control.loop_dataset import simulate_loop_dataset as simulate_loop_dataset
    from smajax.control.measured_state import Sensor as Sensor
    from smajax.control.presets import CONTROLLERS as CONTROLLERS
    from smajax.control.tune.settings import TuneSettings as TuneSettings
    from smajax.control.tune.tuning_folder import tune_in_folder as tune_in_folder
    from smajax.core import units as units
    from smajax.core.parameters import check_bounds as check_bounds
    from smajax.core.parameters import get_parameters as get_parameters
    from smajax.core.parameters import parameter as parameter
    from smajax.core.parameters import parameter_values as parameter_values
    from smajax.core.parameters import parameters as parameters
    from smajax.core.parameters import set_parameters as set_parameters
    from smajax.core.runtime import prepare as prepare
    from smajax.data.model_file.actuator_model import ActuatorModel as ActuatorModel
    from smajax.data.model_file.read import load_model as load_model
    from smajax.data.open_experiment import open_experiment as open_experiment
    from smajax.fit.base_model import base_model as base_model
    from smajax.fit.experiment_check import check_experiment as check_experiment
    from smajax.fit.identify import identify as identify
    from smajax.fit.predict import predict as predict
    from smajax.fit.uncertain_presets import with_uncertain_presets as with_uncertain_presets
    from smajax.model import contracts as contracts
    from smajax.model import effects as effects
    from smajax.model import presets as presets
    from smajax.model.effects.base import AbstractEffect as AbstractEffect
    from smajax.model.effects.candidate import Candidate as Candidate
    from smajax.model.effects.library import LIBRARY as LIBRARY
    from smajax.model.extended import extended as extended
    from smajax.model.load.base import AbstractMovingLoad as AbstractMovingLoad
    from smajax.model.presets import DRIVES as DRIVES
    from smajax.model.presets import LOADS as LOADS
    from smajax.model.presets import WIRES as WIRES
    from smajax.model.presets import build as build
    from smajax.model.system import System as System
    from smajax.model.types import Scalar as Scalar
    from smajax.model.wire.form import IntegratedForm as IntegratedForm
    from smajax.model.wire.laws import under_law as under_law
    from smajax.report.identify_page import write_identified as write_identified
    from smajax.report.narrative import narrate as narrate
    from smajax.report.plot import plot as plot
    from smajax.report.predict_page import write_prediction as write_prediction
    from smajax.report.tune_folder import write_tuning as write_tuning
    from smajax.report.write import write_report as write_report
    from smajax.simulation import measures as _measures
    from smajax.simulation.batch.axes import grid as grid
    from smajax.simulation.batch.axes import sampled as sampled
    from smajax.simulation.batch.axes import zipped as zipped
    from smajax.simulation.batch.run_batch import good as good
    from smajax.simulation.batch.run_batch import run_batch as run_batch
    from smajax.simulation.batch.run_batch import status_summary as status_summary
    from smajax.simulation.compiled import simulate_compiled as simulate_compiled
    from smajax.simulation.dataset import simulate_dataset as simulate_dataset
    from smajax.simulation.simulate import simulate as simulate

    EFFECTS, load_experiment, control_presets, measure = LIBRARY, open_experiment, _control_presets, _measures
    __version__: str

# Name -> the module that has it, and its name there.
NAMES = {
    "AbstractController": ("smajax.control.controllers.base", "AbstractController"),
    "AbstractEffect": ("smajax.model.effects.base", "AbstractEffect"),
    "AbstractMovingLoad": ("smajax.model.load.base", "AbstractMovingLoad"),
    "ActuatorModel": ("smajax.data.model_file.actuator_model", "ActuatorModel"),
    "CONTROLLERS": ("smajax.control.presets", "CONTROLLERS"),
    "Candidate": ("smajax.model.effects.candidate", "Candidate"),
    "DRIVES": ("smajax.model.presets", "DRIVES"),
    "EFFECTS": ("smajax.model.effects.library", "LIBRARY"),
    "IntegratedForm": ("smajax.model.wire.form", "IntegratedForm"),
    "LOADS": ("smajax.model.presets", "LOADS"),
    "Loop": ("smajax.control.loop_dataset", "Loop"),
    "Scalar": ("smajax.model.types", "Scalar"),
    "Sensor": ("smajax.control.measured_state", "Sensor"),
    "System": ("smajax.model.system", "System"),
    "TuneSettings": ("smajax.control.tune.settings", "TuneSettings"),
    "WIRES": ("smajax.model.presets", "WIRES"),
    "base_model": ("smajax.fit.base_model", "base_model"),
    "build": ("smajax.model.presets", "build"),
    "check_bounds": ("smajax.core.parameters", "check_bounds"),
    "check_experiment": ("smajax.fit.experiment_check", "check_experiment"),
    "close_loop": ("smajax.attribution.close_loop", "close_loop"),
    "compose": ("smajax.control.compose", "compose"),
    "extended": ("smajax.model.extended", "extended"),
    "get_parameters": ("smajax.core.parameters", "get_parameters"),
    "good": ("smajax.simulation.batch.run_batch", "good"),
    "grid": ("smajax.simulation.batch.axes", "grid"),
    "identify": ("smajax.fit.identify", "identify"),
    "load_experiment": ("smajax.data.open_experiment", "open_experiment"),
    "load_model": ("smajax.data.model_file.read", "load_model"),
    "loop_around": ("smajax.control.loop_around", "loop_around"),
    "merit": ("smajax.control.figures_of_merit", "merit"),
    "narrate": ("smajax.report.narrative", "narrate"),
    "parameter": ("smajax.core.parameters", "parameter"),
    "parameter_values": ("smajax.core.parameters", "parameter_values"),
    "parameters": ("smajax.core.parameters", "parameters"),
    "plot": ("smajax.report.plot", "plot"),
    "predict": ("smajax.fit.predict", "predict"),
    "prepare": ("smajax.core.runtime", "prepare"),
    "run_batch": ("smajax.simulation.batch.run_batch", "run_batch"),
    "sampled": ("smajax.simulation.batch.axes", "sampled"),
    "set_parameters": ("smajax.core.parameters", "set_parameters"),
    "simulate": ("smajax.simulation.simulate", "simulate"),
    "simulate_closed_loop": ("smajax.control.closed_loop", "simulate_closed_loop"),
    "simulate_compiled": ("smajax.simulation.compiled", "simulate_compiled"),
    "simulate_dataset": ("smajax.simulation.dataset", "simulate_dataset"),
    "simulate_loop_dataset": ("smajax.control.loop_dataset", "simulate_loop_dataset"),
    "status_summary": ("smajax.simulation.batch.run_batch", "status_summary"),
    "tune_in_folder": ("smajax.control.tune.tuning_folder", "tune_in_folder"),
    "under_law": ("smajax.model.wire.laws", "under_law"),
    "with_uncertain_presets": ("smajax.fit.uncertain_presets", "with_uncertain_presets"),
    "write_identified": ("smajax.report.identify_page", "write_identified"),
    "write_prediction": ("smajax.report.predict_page", "write_prediction"),
    "write_report": ("smajax.report.write", "write_report"),
    "write_tuning": ("smajax.report.tune_folder", "write_tuning"),
    "zipped": ("smajax.simulation.batch.axes", "zipped"),
}
# A public name that was renamed -> (the new one, the version that will not have the old one): it works and warns till then.
RENAMED: dict[str, tuple[str, str]] = {"told_of": ("status_summary", "0.3")}
# Modules that are asked for by their own name.
MODULES = {
    "contracts": "smajax.model.contracts",
    "control_presets": "smajax.control.presets",
    "effects": "smajax.model.effects",
    "measure": "smajax.simulation.measures",
    "presets": "smajax.model.presets",
    "reference": "smajax.control.reference",
    "units": "smajax.core.units",
}


def _found(name: str) -> Any:
    module, own = NAMES[name]
    return getattr(import_module(module), own)


def __getattr__(name: str) -> Any:
    """PEP 562: what is not here yet."""
    if name == "__version__":
        from importlib.metadata import version

        return version("smajax")
    if name in MODULES:
        return import_module(MODULES[name])
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


# Module paths of version 0.1, and functions before modules of their name.
_old_paths(sys.modules[__name__])
