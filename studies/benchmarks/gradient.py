"""The gradient of a tracking cost by every parameter of the arm: `python -m studies.benchmarks.gradient --steps N`.

Prints JSON: of a batch of `--members`, on one core, the time of the cost and of its reverse-mode gradient, as machine code
(`run_batch` with `slopes`) and by XLA (the same with `engine="xla"`), of the forward-mode Jacobian by XLA, and the memory that
each needs. With `--tracking FILE` it is the problem of the peers of `gradient_peer.py` and its members, and how far the gradient
is off is told too.
"""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from smajax.core.parameters import get_parameters, parameters, set_vector
from smajax.core.runtime import prepare
from smajax.engine import program
from smajax.model.rigs import arm
from smajax.model.system import System
from smajax.simulation.batch.axes import grid
from smajax.simulation.batch.recipe import BatchSettings, recipe_of
from smajax.simulation.batch.single_run import Recipe, single_run, slope_name
from smajax.simulation.measures import MeanSquare
from smajax.simulation.simulate import DEFAULT_STEP
from studies.benchmarks import tracking
from studies.benchmarks.timed import timed

REPEATS = 3
LONGEST_REPEATED = 20000  # steps


def _recipe(system: System, steps: int, slopes: tuple[str, ...] = ()) -> Recipe:
    """The cost of tracking a ramp over so many of the default steps, and its slopes."""
    dt = DEFAULT_STEP
    wanted = jnp.linspace(float(system.load.start()), tracking.ENDS_AT, steps + 1)
    measures = (MeanSquare("position", wanted, tracking.SCALE),)
    axes = grid(voltage=[8.0])
    return recipe_of(system, {}, axes, BatchSettings(steps * dt, dt, keep=(), measures=measures, slopes=slopes))


def cost_of(system: System, names: tuple[str, ...], steps: int) -> Callable[[jax.Array, jax.Array], jax.Array]:
    """(values of `names`, volts) -> the cost, for XLA."""
    recipe = _recipe(system, steps)

    def cost(vector: jax.Array, volts: jax.Array) -> jax.Array:
        changed = eqx.tree_at(lambda one: one.system, recipe, set_vector(system, names, vector))
        return single_run(changed, {"voltage": volts})["mean_square_position"]

    return cost


def _by_machine_code(
    system: System, names: tuple[str, ...], steps: int, volts: np.ndarray, repeats: int
) -> dict[str, Any]:
    """Time and memory of the cost, and of it with its slopes; `slopes` (members, names) too."""
    record: dict[str, Any] = {}
    for name, by in (("cost", ()), ("gradient", names)):
        recipe = _recipe(system, steps, by)
        begin = time.perf_counter()
        run = program(single_run, recipe, ("voltage",), engine="native")
        record[f"{name}_compile_s"] = time.perf_counter() - begin
        assert run.native is not None  # or there would have been an error
        times = []
        for _ in range(repeats):
            begin = time.perf_counter()
            results = run(recipe, {"voltage": volts}, 1)
            times.append(time.perf_counter() - begin)
        record |= {f"{name}_s": min(times), f"{name}_memory_MB": run.native.scratch / 1e6}
    record["slopes"] = np.stack([results[slope_name("mean_square_position", name)] for name in names], axis=1)
    return record | {"gradient_over_cost": record["gradient_s"] / record["cost_s"]}


def _by_xla(
    system: System, names: tuple[str, ...], steps: int, volts: np.ndarray, repeats: int, forward: bool
) -> dict[str, float]:
    record: dict[str, float] = {}
    for name, by in (("cost", ()), ("gradient", names)):
        recipe = _recipe(system, steps, by)
        run = jax.jit(jax.vmap(lambda own, recipe=recipe: single_run(recipe, {"voltage": own})))
        record |= timed(run, repeats, jnp.asarray(volts)).named(name)
    record["gradient_over_cost"] = record["gradient_s"] / record["cost_s"]
    if forward:
        jacobian = jax.jit(jax.vmap(jax.jacfwd(cost_of(system, names, steps)), (None, 0)))
        record |= timed(jacobian, repeats, get_parameters(system, names), jnp.asarray(volts)).named("jacobian")
        record["jacobian_over_cost"] = record["jacobian_s"] / record["cost_s"]
    return record


def run(steps: int, runs: int, forward: bool) -> dict[str, Any]:
    """Cost, gradient and, when asked for, Jacobian over `steps` of `runs` arms of different voltages."""
    system, volts = arm(), np.linspace(*tracking.VOLTAGES, runs)
    names = tuple(parameters(system))
    repeats = REPEATS if steps <= LONGEST_REPEATED else 1
    own = _by_machine_code(system, names, steps, volts, repeats)
    del own["slopes"]
    xla = _by_xla(system, names, steps, volts, repeats, forward)
    return {"peer": "gradient", "steps": steps, "members": runs, "parameters": len(names), **own, "xla": xla}


def tracked_arm(given: tracking.Tracking) -> System:
    """The arm of the peers' problem."""
    return set_vector(arm(), given.names, jnp.asarray(given.vector))


def run_tracking(given: tracking.Tracking, forward: bool) -> dict[str, Any]:
    """The same on the members of the peers' problem, with the error of the gradient."""
    system, steps = tracked_arm(given), round(tracking.SECONDS / DEFAULT_STEP)
    own = _by_machine_code(system, given.names, steps, given.voltage, tracking.REPEATS)
    slopes = own.pop("slopes")[np.searchsorted(given.voltage, given.solved)]
    record: dict[str, Any] = {"peer": "smajax", "members": len(given.voltage), "parameters": len(given.names)}
    record |= {"setting": DEFAULT_STEP, "gradient_error": given.error(slopes), **own}
    return record | {"xla": _by_xla(system, given.names, steps, given.voltage, tracking.REPEATS, forward)}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--steps", type=int, default=2000)
    parser.add_argument("--members", type=int, default=512)
    parser.add_argument("--forward", action="store_true", help="the forward-mode Jacobian too")
    parser.add_argument("--tracking", type=Path, metavar="FILE", help="the peers' problem (`tracking.py`)")
    options = parser.parse_args()
    tracking.on_one_core()
    prepare(cores=True)
    jax.config.update("jax_enable_compilation_cache", False)
    if options.tracking:
        print(json.dumps(run_tracking(tracking.load(options.tracking), options.forward)))
        return
    print(json.dumps(run(options.steps, options.members, options.forward)))


if __name__ == "__main__":
    main()
