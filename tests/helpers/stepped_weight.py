"""Runs of a dead weight on a voltage of levels, with something hidden in them, and the base model fitted to them."""

from __future__ import annotations

import dataclasses
from functools import cache

import jax
import jax.numpy as jnp
import numpy as np

from smajax.attribution.model_fits import Model, Search
from smajax.core.parameters import parameters
from smajax.core.result_cache import ResultCache
from smajax.fit.levenberg_marquardt import FitSettings, levenberg_marquardt
from smajax.fit.outputs_of_runs import misfits
from smajax.fit.packed_runs import RunBatch, simulate_batch
from smajax.fit.problem import Problem
from smajax.model.effects.base import AbstractEffect
from smajax.model.extended import extended
from smajax.model.presets import build
from smajax.model.system import System

DT, SAMPLES, NOISE = 0.05, 180, 1e-4
BOUNDS = {"convection_coefficient": (50.0, 400.0), "specific_heat": (100.0, 900.0), "recoverable_strain": (0.01, 0.1)}
# Volts, held for 0.75 s each.
LEVELS = (
    (9.0, 9.0, 4.0, 0.0, 8.0, 9.5, 5.5, 3.0, 7.5, 10.0, 2.0, 0.0),
    (7.0, 8.5, 6.0, 4.5, 10.0, 10.0, 5.0, 1.0, 9.0, 6.5, 3.5, 5.0),
    (11.0, 8.0, 6.5, 5.0, 0.0, 0.0, 8.5, 9.5, 7.5, 4.0, 9.0, 3.0),
)


@cache
def base() -> System:
    return build("flexinol_table_3_2", "dead_weight", "voltage")


def _inputs() -> dict[str, jax.Array]:
    return {"voltage": jnp.repeat(jnp.asarray(LEVELS), SAMPLES // len(LEVELS[0]), axis=1)}


def blank(dt: float = DT) -> RunBatch:
    shape = (len(LEVELS), SAMPLES)
    return RunBatch(_inputs(), jnp.zeros(shape), jnp.ones(shape), jnp.zeros((len(LEVELS), 0)), (), dt)


def hidden_in_runs(
    *hidden: AbstractEffect, seed: int = 5, library: tuple[str, ...] = (), dt: float = DT
) -> tuple[Search, Model]:
    """A search, by default without a library, and the base model fitted to runs with something hidden in them."""
    truth = simulate_batch(dataclasses.replace(base(), effects=hidden), blank(dt)).reading
    noise = NOISE * np.random.default_rng(seed).normal(size=truth.shape)
    batch = dataclasses.replace(blank(dt), output=jnp.asarray(truth + noise))
    system = extended(base(), library)
    problem = Problem.build(system, batch, NOISE, False)
    table = parameters(system)
    bounds = {**BOUNDS, **{name: (one.low, one.high) for name, one in table.items() if name.split(".")[0] in library}}
    search = Search(problem, tuple(BOUNDS), bounds, library, ResultCache())
    return search, fitted(search, (), problem.start_values())


def fitted(search: Search, effects: tuple[str, ...], start: np.ndarray) -> Model:
    problem = search.problem
    task = problem.task(search.free(effects), search.bounds, start)
    (fit,) = levenberg_marquardt(problem, [task], FitSettings(tolerance=1e-5))
    (misfit,) = misfits(problem, [fit.values])
    return Model(effects, fit.values, fit.cost, misfit, search.rmse(misfit))
