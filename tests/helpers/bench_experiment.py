"""An experiment file of a bench, its logs, and a catalogue of models that needs no model."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from smajax.data.experiment.catalogue import Catalogue, ModelDescription, ParameterInfo
from smajax.data.experiment.load import load_experiment
from smajax.data.experiment.record import Experiment


def describe(wire: str, load: str, drive: str, law: str = "") -> ModelDescription:
    if load == "coupon" and drive != "none":
        raise ValueError("a coupon has no drive; write drive = 'none'")
    parameters = {
        "wire_length": ParameterInfo("m", 1e-3, 1e2),
        "specific_heat": ParameterInfo("J/(kg K)", 50.0, 5e3),
        "ambient_temperature": ParameterInfo("degC", -100.0, 150.0),
        "stress_slope_austenite": ParameterInfo("Pa/K", 1e6, 1e8),
    }
    if load == "coupon":
        return ModelDescription(parameters, frozenset({"temperature", "stress"}), frozenset(), {"strain": "-"})
    optional = frozenset({"ambient_temperature"})
    return ModelDescription(parameters, frozenset({"duty"}), optional, {"position": "m", "temperature": "degC"})


CATALOGUE = Catalogue(
    wires={"flexinol", "niti"},
    loads={"bias_spring", "coupon"},
    drives={"duty", "none"},
    laws={"liang", "enhanced"},
    effects={"latent_heat", "friction"},
    describe=describe,
)
BENCH = """
title = "Bench"
[model]
wire = "flexinol"
load = "bias_spring"
drive = "duty"
[model.parameters]
wire_length = "96 cm"
[unknown.specific_heat]
low = "300 J/(kg K)"
high = "0.5 cal/(g degC)"
start = "0.2 cal/(g degC)"
[nuisance]
offset = true
[sampling]
step = "50 ms"
[time]
column = "time"
unit = "ms"
[channels.duty]
role = "input"
column = "duty"
unit = "%"
[channels.position]
role = "output"
column = "pos"
unit = "mm"
noise = "0.01 mm"
[[runs]]
name = "A"
role = "fit"
file = "a.csv"
[[runs]]
name = "B"
role = "held-out"
file = "b.csv"
[runs.parameters]
ambient_temperature = "297.15 K"
"""


ONE_FIT = "only 1 fit run: how far the fitted values differ from run to run cannot be seen; give at least three of different kinds"


def write_run(path: Path, count: int = 500, seed: int = 0, header: str = "time,duty,pos") -> None:
    """A run at 100 Hz (time in ms, duty in percent, position in mm with 0.01 mm of noise)."""
    time = 10.0 * np.arange(count)
    duty = np.where(time < 1000.0, 0.0, 20.0)
    position = 0.002 * np.maximum(time - 1000.0, 0.0) + np.random.default_rng(seed).normal(scale=0.01, size=count)
    np.savetxt(path, np.stack([time, duty, position], axis=1), delimiter=",", header=header, comments="")


def changed(folder: Path, old: str, new: str) -> Path:
    text = (folder / "experiment.toml").read_text()
    assert old in text
    (folder / "experiment.toml").write_text(text.replace(old, new, 1))
    return folder


def load(folder: Path) -> Experiment:
    return load_experiment(folder / "experiment.toml", CATALOGUE)


def rewrite(path: Path, duty: float = 20.0, position: np.ndarray | None = None, count: int = 500) -> None:
    """The run of `write_run` in one of its wrong forms."""
    time = 10.0 * np.arange(count)
    noisy = 0.01 * np.random.default_rng(7).normal(size=count) + 0.002 * time
    columns = [time, np.where(time < 100, 0, duty), noisy if position is None else position]
    np.savetxt(path, np.stack(columns, axis=1), delimiter=",", header="time,duty,pos", comments="")
