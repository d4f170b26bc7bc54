"""What a draft leaves to the presets, by how much the outputs of its runs depend on it: what is worth measuring first."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from smajax.core.parameters import Parameter, parameters
from smajax.data.experiment.record import Experiment
from smajax.fit.experiment_problem import declared_problem
from smajax.fit.preset_priors import RELATIVE
from smajax.fit.problem import Problem
from smajax.fit.sensitivity import Sensitivity, sensitivity

SIZE = 0.05  # of the value: sizes of wire, load and drive, of which no table has a width
KELVINS = 2.0  # of a temperature, whose zero means nothing
PARTS = ("wire", "load", "drive")
# Where the model hardly moves nothing matters, and more heat is tried: less convection, within its bounds.
MOVES = 0.5  # of the measured range of the outputs
COOLED = "convection_coefficient"
LESS = (1.0, 0.5, 0.25)


@dataclass(frozen=True)
class PresetInfluence:
    """A value of the presets, SI: what it may be off by (`change`; of its value where `relative`), and what that does to the outputs.

    noises: root mean square over the samples of all fit runs, in standard deviations of the noise.
    """

    name: str
    unit: str
    value: float
    change: float
    relative: bool
    noises: float


@dataclass(frozen=True)
class PresetRanking:
    """The presets' values, most important first, and where the runs were simulated.

    changed: an unknown that is not at its start there, by name: its value, SI, and unit. moves: range of the outputs there over the measured one, median
    over the runs.
    """

    influences: tuple[PresetInfluence, ...]
    changed: Mapping[str, tuple[float, str]]
    moves: float


def _width(entry: Parameter, value: float) -> tuple[float, bool]:
    """(what a value may be off by, whether that is a share of it)."""
    if entry.unit == "degC":
        return KELVINS, False
    return RELATIVE.get(entry.name, (SIZE, ""))[0], True


def _moves(problem: Problem, at: Sensitivity) -> float:
    """Range of the predicted outputs over that of the measured ones, median of the series."""
    assert at.predicted is not None
    shares = []
    for predicted, measured, mask in zip(at.predicted, problem.measured, at.mask > 0, strict=True):
        if mask.any() and np.ptp(measured[mask]) > 0.0:
            shares.append(np.ptp(predicted[mask]) / np.ptp(measured[mask]))
    return float(np.median(shares)) if shares else 0.0


def rank_presets(experiment: Experiment) -> PresetRanking | None:
    """What the fit runs of `experiment` depend on, of the values that are neither given nor to be fitted.

    By the derivatives at the start of the unknowns; where the model moves by less than half of what was measured, with less convection.
    None where the model has no number there.
    """
    runs = [run for run in experiment.runs if run.role == "fit"]
    problem = declared_problem(experiment, runs)
    table = parameters(problem.system)
    given = {*experiment.parameters, *(one.name for one in experiment.unknowns)}
    given |= set.intersection(*(set(run.parameters) for run in runs))
    if experiment.model_file is not None:
        given |= {*experiment.model_file.errors, *experiment.model_file.bounds}
    names = [name for name, one in table.items() if one.path[0] in PARTS and name not in given]
    start = problem.start_values()
    free = next((one for one in experiment.unknowns if one.name == COOLED and not one.per_run), None)
    found: tuple[Sensitivity, dict[str, tuple[float, str]], float] | None = None
    for share in LESS if free is not None else LESS[:1]:
        values = np.array(start)
        changed: dict[str, tuple[float, str]] = {}
        if free is not None and share < 1.0:
            values[problem.names.index(COOLED)] = less = max(share * free.start, free.low)
            changed = {COOLED: (less, free.unit)}
        at = sensitivity(problem, values, names)
        moves = _moves(problem, at)
        if np.isfinite(at.jacobian).all() and (found is None or moves > found[2]):
            found = at, changed, moves
        if moves >= MOVES:
            break
    if found is None:
        return None
    at, changed, moves = found
    influences = []
    for name in names:
        value = float(start[problem.names.index(name)])
        change, relative = _width(table[name], value)
        step = change * abs(value) if relative else change
        noises = float(np.sqrt(np.mean((at.columns([name]) * step) ** 2)))
        influences.append(PresetInfluence(name, table[name].unit, value, change, relative, noises))
    return PresetRanking(tuple(sorted(influences, key=lambda one: -one.noises)), changed, moves)
