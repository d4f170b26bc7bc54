"""An experiment file, read against everything that smajax can simulate."""

from __future__ import annotations

from pathlib import Path

from smajax.catalogue import CATALOGUE
from smajax.experiment.load import load_experiment
from smajax.experiment.record import Experiment


def open_experiment(path: str | Path) -> Experiment:
    """`load_experiment` with the presets, effects and parameters that there are. Raises ExperimentError."""
    return load_experiment(path, CATALOGUE)
