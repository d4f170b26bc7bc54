"""Keys of an experiment file that this loop would otherwise pass over in silence."""

from __future__ import annotations

import numpy as np

from smajax.data.experiment.errors import ExperimentError
from smajax.data.experiment.record import RUN_STARTS, Experiment
from smajax.model.presets import build


def refuse_keys_of_identify(experiment: Experiment) -> None:
    """ExperimentError for the keys of an experiment file that this loop would otherwise pass over in silence."""

    def refuse(key: str, what: str) -> None:
        raise ExperimentError(experiment.path, key, f"close-loop {what}; `smajax identify` does, or remove it")

    if len(experiment.outputs) > 1:
        others = ", ".join(output.name for output in experiment.outputs[1:])
        refuse("channels", f"fits one output and got {len(experiment.outputs)} (also {others})")
    own = build(experiment.wire, experiment.load, experiment.drive).load.reading[0]
    if experiment.output_name != own:
        refuse(f"channels.{experiment.output_name}", f"fits the load's own sensor, {own!r}, and no other")
    for unknown in experiment.unknowns:
        place = "nuisance" if unknown.name in RUN_STARTS else "unknown"
        if unknown.per_run:
            refuse(f"{place}.{unknown.name}", "knows no value of each run's own but the offset")
        if unknown.prior is not None:
            refuse(f"{place}.{unknown.name}.prior", "takes no prior")
    for run in experiment.runs:
        if not np.isfinite(run.output).all():
            refuse(
                f"channels.{experiment.output_name}.missing", f"leaves out no sample, and run {run.name!r} lacks some"
            )
