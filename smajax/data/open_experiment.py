"""An experiment file, read against everything that smajax can simulate."""

from __future__ import annotations

from pathlib import Path

from smajax.data.experiment.load import load_experiment
from smajax.data.experiment.record import Experiment
from smajax.data.model_catalogue import CATALOGUE


def open_experiment(path: str | Path) -> Experiment:
    """`load_experiment` with the presets, effects and parameters that there are. Raises ExperimentError."""
    return load_experiment(path, CATALOGUE)
