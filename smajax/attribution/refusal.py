"""Keys of an experiment file that this loop would otherwise pass over in silence."""

from __future__ import annotations

from smajax.data.experiment.errors import ExperimentError
from smajax.data.experiment.record import RUN_STARTS, Experiment


def refuse_keys_of_identify(experiment: Experiment) -> None:
    """ExperimentError for the keys of an experiment file that this loop would otherwise pass over in silence."""

    def refuse(key: str, what: str) -> None:
        raise ExperimentError(experiment.path, key, f"close-loop {what}; `smajax identify` does, or remove it")

    for unknown in experiment.unknowns:
        place = "nuisance" if unknown.name in RUN_STARTS else "unknown"
        if unknown.per_run:
            refuse(f"{place}.{unknown.name}", "knows no value of each run's own but the offset")
