"""Gradients of `tracking.py` by others: `python -m studies.benchmarks.gradient_peer diffrax|gradsolve FILE`; prints JSON.

Runs in an environment of its own with numpy, jax and the named package, from the folder that has `studies`. The cost is the
sixth state of one explicit ODE for both. Each way is timed at the loosest tolerance, relative and absolute, whose gradient is
accurate on the solved members, all members in one program, over its own run of the cost: at the same tolerance by the
plain loop of diffrax, and as gradsolve replays it. gradsolve's steps are found before, in a call that no gradient passes
through; its time stands beside (`record_s`). BacksolveAdjoint goes through the equations backwards in time, where what is
damped forwards grows: the cooling of the wire, and most of all `furthest`, by e in 0.03 s.
"""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Callable
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np

from smajax.core.runtime import prepare
from studies.benchmarks import tracking
from studies.benchmarks.timed import timed
from studies.benchmarks.tracking import Tracking, load

TOLERANCES = (1e-2, 3e-3, 1e-3, 3e-4, 1e-4, 3e-5, 1e-5, 3e-6, 1e-6, 3e-7, 1e-7)
# Of diffrax the solvers that were the fastest on the trajectories; the fastest of them by the first of these ways is taken for
# all of them.
SOLVERS = ("Bosh3", "Tsit5", "Dopri5")
REVERSE = ("RecursiveCheckpointAdjoint", "DirectAdjoint", "BacksolveAdjoint")
FORWARD = "ForwardMode"
ENGINES = ("tsit5_replay", "vern7_replay")
FIRST_STEP = 1e-3  # s
MOST_STEPS = 4096
REPEATS = tracking.REPEATS


def _first_line(error: Exception) -> str:
    return f"{type(error).__name__}: {error}".strip().splitlines()[0]


def _not_accurate(off: float) -> str:
    return f"not accurate at any tolerance to {TOLERANCES[-1]:g}: at best off by {off:.2g} of the gradient's norm"


def _diffrax_cost(given: Tracking, solver: str, adjoint: str) -> Callable[[Any, Any, Any], Any]:
    """(values of the parameters, volts, tolerance) -> cost of one member."""
    import diffrax
    import jax.numpy as jnp

    names, rest = given.names, given.constants["start_angle"]

    def slope(t: Any, state: Any, args: Any) -> Any:
        return tracking.rates(jnp, dict(zip(names, args[0], strict=True)), args[1], rest, t, state)

    def cost(vector: Any, volts: Any, tolerance: Any) -> Any:
        done = diffrax.diffeqsolve(
            diffrax.ODETerm(slope),
            getattr(diffrax, solver)(),
            0.0,
            tracking.SECONDS,
            FIRST_STEP,
            tracking.start(jnp, dict(zip(names, vector, strict=True))),
            (vector, volts),
            stepsize_controller=diffrax.PIDController(rtol=tolerance, atol=tolerance),
            adjoint=getattr(diffrax, adjoint)(),
            max_steps=MOST_STEPS,
            throw=False,
        )
        assert done.ys is not None
        return done.ys[5][0]

    return cost


def _by_diffrax(given: Tracking, solver: str, adjoint: str) -> dict[str, Any]:
    """One solver and one way; or the reason why it has no gradient."""
    import jax

    named = {"way": f"diffrax {solver}, {adjoint}", "solver": solver, "adjoint": adjoint}
    each = jax.jacfwd if adjoint == FORWARD else jax.grad
    slopes = jax.vmap(each(_diffrax_cost(given, solver, adjoint)), (None, 0, None))
    cost = jax.vmap(_diffrax_cost(given, solver, FORWARD), (None, 0, None))
    try:
        compiled, off = jax.jit(slopes), []
        for tolerance in TOLERANCES:
            off.append(given.error(np.asarray(compiled(given.vector, given.solved, tolerance))))
            if off[-1] < tracking.LIMIT:
                break
        else:
            return {**named, "reason": _not_accurate(min(off))}
        result: dict[str, Any] = {**named, "setting": tolerance, "gradient_error": off[-1]}
        at = given.vector, given.voltage, tolerance
        result |= timed(jax.jit(cost), REPEATS, *at).named("cost")
        result |= timed(jax.jit(slopes), REPEATS, *at).named("gradient")
    except Exception as error:  # one that does not work is no reason to lose the others
        return {**named, "reason": _first_line(error)}
    return {**result, "gradient_over_cost": result["gradient_s"] / result["cost_s"]}


def by_diffrax(given: Tracking) -> dict[str, Any]:
    """Every adjoint by the solver that is the fastest with the first of them."""
    tried = [_by_diffrax(given, solver, REVERSE[0]) for solver in SOLVERS]
    met = [one for one in tried if "gradient_s" in one]
    best = min(met or tried, key=lambda one: float(one.get("gradient_s", "inf")))
    ways = [best, *(_by_diffrax(given, best["solver"], adjoint) for adjoint in (*REVERSE[1:], FORWARD))]
    return {"versions": {name: version(name) for name in ("diffrax", "jax", "numpy")}, "ways": ways, "tried": tried}


class _Problem:
    """The members as gradsolve asks for them: a state of six, parameters with the voltage behind."""

    name = "smajax_tracking"
    dim = 6
    t0, t1 = 0.0, tracking.SECONDS
    is_stiff = False

    def __init__(self, given: Tracking) -> None:
        self._names, self._rest = given.names, given.constants["start_angle"]

    def f_jax(self, t: Any, y: Any, p: Any) -> Any:
        import jax.numpy as jnp

        constants = dict(zip(self._names, p[:-1], strict=True))
        return jnp.stack(tracking.rates(jnp, constants, p[-1], self._rest, t, tuple(y)))

    def start(self, p: Any) -> Any:
        import jax.numpy as jnp

        return jnp.stack(tracking.start(jnp, dict(zip(self._names, p[:-1], strict=True))))


def _by_gradsolve(given: Tracking, engine: str) -> dict[str, Any]:
    import gradsolve
    import jax
    import jax.numpy as jnp

    named, problem = {"way": f"gradsolve, {engine}", "engine": engine}, _Problem(given)

    def rows(vector: Any, volts: Any) -> Any:
        return jnp.concatenate([jnp.tile(vector, (len(volts), 1)), volts[:, None]], axis=1)

    def replayed(volts: Any, tolerance: float) -> tuple[Callable[[Any], Any], Any]:
        """(parameters -> costs on the steps that these members take now, parameters)."""
        p = rows(jnp.asarray(given.vector), jnp.asarray(volts))
        states = np.asarray(jax.vmap(problem.start)(p))
        options = {"wrt": ("y0", "params"), "engine": engine, "rtol": tolerance, "atol": tolerance}
        run = gradsolve.grad_closure(problem, states, np.asarray(p), **options)
        return lambda own: run(jax.vmap(problem.start)(own), own)[:, 5], p

    def slopes(run: Callable[[Any], Any]) -> Callable[[Any], Any]:
        return lambda p: jax.grad(lambda own: run(own).sum())(p)[:, :-1]

    try:
        off = []
        for tolerance in TOLERANCES:
            run, p = replayed(given.solved, tolerance)
            off.append(given.error(np.asarray(jax.jit(slopes(run))(p))))
            if off[-1] < tracking.LIMIT:
                break
        else:
            return {**named, "reason": _not_accurate(min(off))}
        result: dict[str, Any] = {**named, "setting": tolerance, "gradient_error": off[-1]}
        recording = []
        for _ in range(REPEATS):
            begin = time.perf_counter()
            run, p = replayed(given.voltage, tolerance)
            recording.append(time.perf_counter() - begin)
        result |= timed(jax.jit(run), REPEATS, p).named("cost")
        result |= timed(jax.jit(slopes(run)), REPEATS, p).named("gradient")
    except Exception as error:
        return {**named, "reason": _first_line(error)}
    return {**result, "record_s": min(recording), "gradient_over_cost": result["gradient_s"] / result["cost_s"]}


def by_gradsolve(given: Tracking) -> dict[str, Any]:
    """Its engines for equations that are not stiff."""
    ways = [_by_gradsolve(given, engine) for engine in ENGINES]
    return {"versions": {name: version(name) for name in ("gradsolve", "jax", "numpy")}, "ways": ways}


PEERS = {"diffrax": by_diffrax, "gradsolve": by_gradsolve}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("peer", choices=PEERS)
    parser.add_argument("file", type=Path)
    options = parser.parse_args()
    tracking.on_one_core()
    # XLA is asked for the same as by `gradient.py`: float64, the widest vectors, and no program from before.
    prepare(cores=True)
    import jax

    jax.config.update("jax_enable_compilation_cache", False)
    jax.config.update("jax_platforms", "cpu")
    given = load(options.file)
    record = PEERS[options.peer](given)
    print(json.dumps({"peer": options.peer, "members": len(given.voltage), "parameters": len(given.names), **record}))


if __name__ == "__main__":
    main()
