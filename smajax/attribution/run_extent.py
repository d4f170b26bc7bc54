"""How far the runs of a problem go: what tells where, and whether, to look for an effect."""

from __future__ import annotations

import jax.numpy as jnp
import numpy as np

from smajax.core.parameters import all_by_numpy, by_numpy, parameters
from smajax.data.readers.resolution_levels import likeliest_increment
from smajax.fit.problem import Problem
from smajax.model.effects.candidate import Extent
from smajax.model.load.base import AbstractMovingLoad

SAME_FORCE = 0.02  # of the force: what it may change by and still be one


def _one_force(problem: Problem, lowest: float, highest: float) -> bool:
    """Whether the load at rest pulls with one force, at both ends of its way and under the inputs of all samples."""
    load, batch = all_by_numpy(problem.system.load), problem.batch
    own = {entry.name for entry in parameters(problem.system).values() if entry.path[0] == "load"}
    if own & {*batch.override_names, *problem.per_run.names}:
        return False  # runs have a load of their own
    mask = batch.measured
    if isinstance(load, AbstractMovingLoad):
        rest, *ends = by_numpy(jnp.asarray([0.0, lowest, highest]))
        inputs = all_by_numpy(batch.inputs)
        at = [np.broadcast_to(load.resistance(end, rest, inputs), mask.shape) for end in ends]
    elif "stress" in batch.inputs:
        at = [np.asarray(batch.inputs["stress"])]
    else:
        return False
    forces = np.concatenate([np.abs(one[mask]) for one in at])
    return bool(np.ptp(forces) <= SAME_FORCE * forces.max())


def _whole_way(problem: Problem, lowest: float, highest: float) -> tuple[float, float]:
    """Between which positions a load moves whose position is not measured; of what does not move `lowest` and `highest`."""
    load, wire = problem.system.load, problem.system.wire
    if not isinstance(load, AbstractMovingLoad):
        return lowest, highest
    start = float(load.start())
    return start, start + float(load.travel(wire, wire.constitutive.recoverable_strain))


def _commands(problem: Problem) -> tuple[float, int]:
    """(the largest of the drive's channel while the runs are measured, in its unit, how many sizes it has beside zero, to a hundredth of that); zeros without a drive."""
    batch = problem.batch
    channels = [np.abs(np.asarray(batch.inputs[name])[batch.measured]) for name in problem.system.drive.inputs_required]
    largest = max((float(one.max()) for one in channels), default=0.0)
    if not largest > 0.0:
        return 0.0, 0
    sizes = np.unique(np.round(np.concatenate(channels) / largest, 2))
    return largest, int((sizes > 0.0).sum())


def extent_of(problem: Problem) -> Extent:
    """Length of a typical run, range of all readings, the increment at which they lie, the lowest and highest of them, whether the load is one force, and the largest command."""
    batch = problem.batch
    names = (problem.system.load.reading[0], "reading")  # effects of a sensor are of the load's own
    which = next((place for place, name in enumerate(batch.outputs) if name in names), None)
    series = slice(which or 0, None, len(batch.outputs))
    mask = np.asarray(batch.mask)[series] > 0
    readings = [row[valid] for row, valid in zip(problem.measured[series], mask, strict=True) if valid.any()]
    noise = np.asarray(problem.noise)[series] / problem.scale_of_series[series]
    stroke = max(float(np.ptp(one)) for one in readings)
    increment = likeliest_increment(readings, float(np.median(noise)))
    lowest, highest = (float(end([end(one) for one in readings])) for end in (np.min, np.max))
    ends = (lowest, highest) if which is not None else _whole_way(problem, lowest, highest)
    one_force = _one_force(problem, *ends)
    seen = batch.measured
    samples = seen.shape[1] - np.argmax(seen[:, ::-1], axis=1)  # to the last measured one
    seconds = float(np.median(samples) * batch.dt)
    largest, sizes = _commands(problem)
    sigma = float(np.median(noise))
    return Extent(seconds, stroke, increment, lowest, highest, one_force, largest, sigma, sizes)
