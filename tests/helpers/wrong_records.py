"""Records that are wrong: a demo's bench, an error of one of its runs, and an input that was written down too early."""

from __future__ import annotations

from importlib import resources

import jax
import jax.numpy as jnp

from smajax.attribution.record_error import RecordError
from smajax.data.experiment.load import load_experiment
from smajax.data.experiment.record import Experiment
from smajax.data.model_catalogue import CATALOGUE

FOUND = RecordError("steps", "voltage", "input_delay.delay", 0.8, 1e-3, 50.0, ("draught",), 60.0)


def demo() -> Experiment:
    """The bench of the demo that nothing is missing of."""
    with resources.as_file(resources.files("smajax") / "data" / "demo" / "complete") as folder:
        return load_experiment(folder / "experiment.toml", CATALOGUE)


def early(volts: jax.Array) -> jax.Array:
    """Written down six samples before it acted, 0.6 s."""
    return jnp.concatenate([volts[6:], jnp.full(6, volts[-1])])
