"""Module paths of version 0.1: they lead to today's modules for one minor version, with a DeprecationWarning that names the new path.

`from smajax.parameters import parameter` gives the object of `smajax.core.parameters`: an old path is a second name of the same
module, so its classes are the same and `isinstance` holds. Names within a module that changed do not come back by this.
"""

from __future__ import annotations

import sys
import warnings
from collections.abc import Sequence
from importlib import import_module
from importlib.machinery import ModuleSpec
from types import ModuleType

UNTIL = "0.3"  # the version that will not have the old paths

# Old package -> new one, both below `smajax`: the modules in it keep their names, but for those of MODULES.
PACKAGES = {
    "batch": "simulation.batch",
    "command": "cli.commands",
    "controller": "control.controllers",
    "drive": "model.drive",
    "effects": "model.effects",
    "estimator": "control.estimators",
    "experiment": "data.experiment",
    "lanes": "engine",
    "load": "model.load",
    "measured": "data.readers",
    "residual": "attribution",
    "tune": "control.tune",
    "unknown": "attribution.unknown",
    "wire": "model.wire",
}
# Old module -> new one, both below `smajax`.
MODULES = {
    "adaptive": "simulation.adaptive_steps",
    "attribution.assumed": "attribution.assumed_parameters",
    "attribution.extent": "attribution.run_extent",
    "attribution.found": "attribution.final_model_findings",
    "attribution.judging": "attribution.model_fits",
    "attribution.lone_run": "attribution.outlier_run",
    "attribution.places": "attribution.nuisance_grid",
    "attribution.rivals": "attribution.confounders",
    "attribution.screen": "attribution.score_test",
    "attribution.steady": "attribution.step_size_check",
    "attribution.unknown_words": "report.narrative.unknown",
    "batch.engine": "simulation.batch.chunks",
    "batch.member": "simulation.batch.single_run",
    "batch.provenance": "core.provenance",
    "batch.run": "simulation.batch.run_batch",
    "bench": "cli.benchmark",
    "catalogue": "data.model_catalogue",
    "checkpointed": "core.checkpointed_scan",
    "close_loop": "attribution.close_loop",
    "closed_loop": "control.closed_loop",
    "command.base": "cli.options",
    "command.complete": "cli.completion",
    "command.folder": "cli.result_folder",
    "command.listing": "cli.commands.presets",
    "command.machine": "cli.commands.doctor",
    "command.positional": "cli.positional",
    "command.renamed": "cli.renamed",
    "compiled": "simulation.compiled",
    "compiling": "core.compiling",
    "compose": "control.compose",
    "control_presets": "control.presets",
    "cosine": "model.wire.cosine",
    "dataset": "simulation.dataset",
    "declared": "fit.experiment_problem",
    "design": "fit.design",
    "doctor": "cli.installation",
    "effects.every": "attribution.every_effect",
    "effects.neutral": "attribution.neutral_at_base",
    "experiment.asked": "data.experiment.fingerprint",
    "experiment.folder": "data.experiment.data_folder",
    "experiment.guess": "data.experiment.column_guess",
    "experiment.own_columns": "data.experiment.column_overrides",
    "experiment.readings": "data.experiment.reading_limits",
    "experiment.template": "data.experiment.draft",
    "explicit_arm": "cli.benchmark_arm",
    "extended": "fit.base_model",
    "fit.batch": "fit.packed_runs",
    "fit.box": "fit.levenberg_marquardt",
    "fit.kept": "core.result_cache",
    "fit.progress": "core.progress",
    "fit.shown": "fit.outputs_of_runs",
    "friction": "model.load.friction",
    "gain_search": "control.gain_search",
    "gains_file": "control.gains_file",
    "identified": "fit.identify_result",
    "identify": "fit.identify",
    "lanes.disk": "engine.cache",
    "lanes.evaluate": "engine.native",
    "levels": "data.text_input",
    "limited": "core.limited",
    "loop": "control.loop_dataset",
    "machine": "core.machine",
    "made_with": "core.provenance",
    "measure": "simulation.measures",
    "measured.columns_file": "data.readers.parquet_netcdf",
    "measured.extras": "data.readers.optional_packages",
    "measured.levels": "data.readers.resolution_levels",
    "measured.mat_sound": "data.readers.mat_integrity",
    "measured.moments": "data.readers.clock_times",
    "measured.names": "core.names",
    "measured.repeated": "data.readers.duplicate_times",
    "measured_state": "control.measured_state",
    "merit": "control.figures_of_merit",
    "mismatch": "control.mismatch",
    "open_experiment": "data.open_experiment",
    "origins": "model.preset_sources",
    "parameters": "core.parameters",
    "plot": "report.plot",
    "plugins": "core.plugins",
    "presets": "model.presets",
    "progress": "cli.progress_display",
    "reading": "model.sensor_reading",
    "recorded": "simulation.input_delay",
    "reference": "control.reference",
    "reference_file": "control.reference_file",
    "report.display": "core.display_units",
    "report.files": "core.files",
    "report.findings": "attribution.findings",
    "residual.noise_like": "core.whiteness",
    "residual.portrait": "attribution.residual_diagnostics",
    "runtime": "core.runtime",
    "sensors": "simulation.sensors",
    "simulate": "simulation.simulate",
    "single": "control.run_request",
    "source_mark": "core.provenance",
    "stage_equations": "simulation.stage_equations",
    "stage_solver": "simulation.stage_solver",
    "step": "simulation.step",
    "sweep": "control.sweep",
    "sweep_dataset": "report.sweep_dataset",
    "sweep_report": "report.sweep_page",
    "sweep_run": "report.sweep_folder",
    "system": "model.system",
    "tune.descent": "control.tune.multistart",
    "tune.evolve": "control.tune.cma_es",
    "tune.folder": "report.tune_folder",
    "tune.members": "control.tune.scenarios",
    "tune.page": "report.tune_page",
    "tune.pictures": "report.tune_pictures",
    "tune.tune": "control.tune.tuning",
    "types": "model.types",
    "units": "core.units",
    "wire.kept": "model.wire.history",
    "wire.mixture": "model.wire.two_populations",
    "wire.renewal": "model.wire.branch_amplitude",
    "words": "core.wording",
}
# Old module or package that is not in smajax any more -> what to do.
REMOVED = {
    "figures": "the source's figures are no part of smajax now: `smajax figures` draws them, their code is studies/source of a "
    "checkout and smajax_studies of a wheel, and the rigs are smajax.model.rigs",
}


def new_path(name: str) -> str | None:
    """Today's path of a module of version 0.1; None for any other."""
    root, _, old = name.partition(".")
    if root != "smajax" or not old:
        return None
    if old in MODULES:
        return f"smajax.{MODULES[old]}"
    package, _, module = old.partition(".")
    if package not in PACKAGES:
        return None
    return f"smajax.{PACKAGES[package]}" + (f".{module}" if module else "")


class _Loader:
    """Puts today's module into the place of the one that was asked for."""

    def create_module(self, spec: ModuleSpec) -> None:
        """None: a module that `exec_module` throws away. The real one would get the old spec."""

    def exec_module(self, module: ModuleType) -> None:
        name = module.__name__
        new = new_path(name)
        assert new is not None
        # Attributed to the line with the import: frames of the import system are not counted.
        warnings.warn(
            f"{name} is {new} now; the old path is removed in version {UNTIL}", DeprecationWarning, stacklevel=2
        )
        sys.modules[name] = import_module(new)


class _Finder:
    """First on `sys.meta_path`: in an old package the path finder would load a file once more, under its old name."""

    @classmethod
    def find_spec(
        cls, name: str, path: Sequence[str] | None = None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        if not name.startswith("smajax."):
            return None
        package = name.split(".")[1]
        if package in REMOVED and name.removeprefix("smajax.") not in MODULES:
            raise ModuleNotFoundError(f"{name}: {REMOVED[package]}", name=name)
        return ModuleSpec(name, _Loader()) if new_path(name) else None  # type: ignore[arg-type]


class _Package(ModuleType):
    """smajax, in which a public function goes before the module of its name.

    Importing a module puts it into its package under its own name: without this `smajax.simulate` would be the function or,
    once `smajax.simulate` was imported as a module, that module.
    """

    def __setattr__(self, name: str, value: object) -> None:
        if not (isinstance(value, ModuleType) and name in self.NAMES):
            super().__setattr__(name, value)


def install(package: ModuleType) -> None:
    """Have the old paths lead to today's modules; `package` is smajax, its `NAMES` the public functions and classes."""
    package.__class__ = _Package
    sys.meta_path.insert(0, _Finder)
