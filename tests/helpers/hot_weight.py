"""A small bench for the joint search: runs of a hung weight by a wire with chosen effects, and the candidates to look among."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from types import MappingProxyType

import jax.numpy as jnp
import numpy as np

from smajax.attribution.fitted_sets import JointSearch
from smajax.attribution.joint_parameters import JointParameters
from smajax.attribution.run_extent import extent_of
from smajax.core.parameters import parameter_values, parameters, set_parameters
from smajax.fit.levenberg_marquardt import FitSettings
from smajax.fit.packed_runs import RunBatch, simulate_batch
from smajax.fit.problem import Problem
from smajax.model.extended import extended
from smajax.model.presets import build

DT, SAMPLES, NOISE = 0.1, 200, 5e-5
CANDIDATES = ("latent_heat", "rising_convection", "phase_resistance", "asymmetric_transformation", "sensor_gain")
UNKNOWNS = ("convection_coefficient", "recoverable_strain")
VOLTS = ((8.0, 0.0), (6.5, 0.0), (9.0, 4.0), (7.0, 5.5))  # of the first and the second half of each run


def hot_weight(
    truth: Mapping[str, float],
    candidates: Sequence[str] = CANDIDATES,
    seed: int = 3,
    factors: Mapping[str, float] = MappingProxyType({}),
    steps: Sequence[tuple[float, float]] = VOLTS,
) -> JointSearch:
    """A search among `candidates` in runs of a wire whose effects have the coefficients `truth`.

    `factors`: of parameters of the wire that made the runs, over the preset's. `steps`: V, of the first and the second half of each run.
    """
    volts = jnp.stack([jnp.repeat(jnp.asarray(pair), SAMPLES // 2) for pair in steps])
    base = build("flexinol_table_3_2", "dead_weight", "voltage")
    count = len(steps)
    blank = RunBatch(
        {"voltage": volts}, jnp.zeros((count, SAMPLES)), jnp.ones((count, SAMPLES)), jnp.zeros((count, 0)), (), DT
    )
    hidden = tuple(dict.fromkeys(name.split(".")[0] for name in truth))
    own = parameter_values(base)
    wire = set_parameters(base, {name: factor * own[name] for name, factor in factors.items()})
    exact = simulate_batch(extended(wire, hidden, dict(truth)), blank).reading
    noise = NOISE * np.random.default_rng(seed).standard_normal(exact.shape)
    batch = dataclasses.replace(blank, output=jnp.asarray(exact + noise))
    problem = Problem.build(extended(base, tuple(candidates)), batch, NOISE, False)
    table = parameters(problem.system)
    bounds = {name: (entry.low, entry.high) for name, entry in table.items()}
    bounds |= {"convection_coefficient": (50.0, 400.0), "recoverable_strain": (0.03, 0.06)}
    extent = extent_of(problem)
    joint = JointParameters.of(problem, UNKNOWNS, bounds, candidates, extent)
    return JointSearch(joint, extent, FitSettings(), NOISE)
