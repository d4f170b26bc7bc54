"""The gradient of a tracking cost by every parameter of the arm: `python -m studies.benchmarks.gradient --steps N`.

Prints JSON: the time of the cost, of its reverse-mode gradient, of its forward-mode Jacobian, each as a program of its
own for a batch of `--members`, and the memory that each needs. With `--tracking FILE` it is the problem of the peers of
`gradient_peer.py` and its members, and how far the gradient is off is told too.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from smajax.batch.axes import grid
from smajax.batch.member import member
from smajax.batch.run import recipe_of
from smajax.figures.rigs import arm
from smajax.measure import MeanSquare
from smajax.parameters import get_parameters, parameters, set_parameters, set_vector
from smajax.runtime import prepare
from smajax.simulate import DEFAULT_STEP
from smajax.system import System
from studies.benchmarks import tracking
from studies.benchmarks.timed import timed

REPEATS = 3
LONGEST_REPEATED = 20000  # steps


def _cost_of(system: System, names: tuple[str, ...], steps: int) -> Callable[[jax.Array, jax.Array], jax.Array]:
    """(values of `names`, volts) -> cost of tracking a ramp over so many of the default steps."""
    dt = DEFAULT_STEP
    wanted = jnp.linspace(float(system.load.start()), tracking.ENDS_AT, steps + 1)
    measures = (MeanSquare("position", wanted, tracking.SCALE),)
    recipe = recipe_of(system, {}, grid(voltage=[8.0]), seconds=steps * dt, dt=dt, keep=(), measures=measures)

    def cost(vector: jax.Array, volts: jax.Array) -> jax.Array:
        changed = eqx.tree_at(lambda one: one.system, recipe, set_vector(system, names, vector))
        return member(changed, {"voltage": volts})["mean_square_position"]

    return cost


def run(steps: int, members: int, forward: bool) -> dict[str, Any]:
    """Cost, gradient and, when asked for, Jacobian over `steps` of `members` arms of different voltages."""
    system = arm()
    names = tuple(parameters(system))
    cost = _cost_of(system, names, steps)
    at, volts = get_parameters(system, names), jnp.linspace(*tracking.VOLTAGES, members)
    repeats = REPEATS if steps <= LONGEST_REPEATED else 1
    told: dict[str, Any] = {"peer": "gradient", "steps": steps, "members": members, "parameters": len(names)}
    return told | _compared(cost, at, volts, repeats, forward)


def _compared(
    cost: Callable[..., jax.Array], at: jax.Array, volts: jax.Array, repeats: int, forward: bool
) -> dict[str, float]:
    def measured(name: str, function: Callable[..., jax.Array]) -> dict[str, float]:
        return timed(jax.jit(jax.vmap(function, (None, 0))), repeats, at, volts).named(name)

    told = measured("cost", cost) | measured("gradient", jax.grad(cost))
    told["gradient_over_cost"] = told["gradient_s"] / told["cost_s"]
    if forward:
        told |= measured("jacobian", jax.jacfwd(cost))
        told["jacobian_over_cost"] = told["jacobian_s"] / told["cost_s"]
    return told


def tracked_arm(given: tracking.Tracking) -> System:
    """The arm of the peers' problem."""
    return set_parameters(arm(), {"payload_mass": given.constants["payload_mass"]})


def run_tracking(given: tracking.Tracking, forward: bool) -> dict[str, Any]:
    """The same on the members of the peers' problem, with the error of the gradient."""
    cost, at = (
        _cost_of(tracked_arm(given), given.names, round(tracking.SECONDS / DEFAULT_STEP)),
        jnp.asarray(given.vector),
    )
    slopes = jax.jit(jax.vmap(jax.grad(cost), (None, 0)))(at, jnp.asarray(given.solved))
    told: dict[str, Any] = {"peer": "smajax", "members": len(given.voltage), "parameters": len(given.names)}
    told |= {"setting": DEFAULT_STEP, "gradient_error": given.error(np.asarray(slopes))}
    return told | _compared(cost, at, jnp.asarray(given.voltage), tracking.REPEATS, forward)


def main() -> None:
    asked = argparse.ArgumentParser(description=__doc__)
    asked.add_argument("--steps", type=int, default=2000)
    asked.add_argument("--members", type=int, default=512)
    asked.add_argument("--forward", action="store_true", help="the forward-mode Jacobian too")
    asked.add_argument("--tracking", type=Path, metavar="FILE", help="the peers' problem (`tracking.py`)")
    options = asked.parse_args()
    prepare(cores=True)
    jax.config.update("jax_enable_compilation_cache", False)
    if options.tracking:
        print(json.dumps(run_tracking(tracking.load(options.tracking), options.forward)))
        return
    print(json.dumps(run(options.steps, options.members, options.forward)))


if __name__ == "__main__":
    main()
