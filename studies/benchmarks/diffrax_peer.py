"""diffrax on the arm, its best solver and step for the accuracy: `python -m studies.benchmarks.diffrax_peer FILE`.

Runs in an environment of its own with numpy, jax and diffrax, from the folder that has `studies`; prints JSON. What is
tried: explicit solvers, with steps of their own choice and with fixed ones, each at the loosest setting
that is accurate on the solved members. What is timed: all members to their end, in blocks that fit the cache, the
blocks over as many devices as there are cores; only the end is kept; the compilation apart.
"""

from __future__ import annotations

import argparse
import json
import os
from collections.abc import Callable
from functools import partial
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np

from smajax.cli import benchmark_arm as equations
from studies.benchmarks.given import Given, load
from studies.benchmarks.timed import timed

# Relative and absolute, from the loosest on.
TOLERANCES = (1e-2, 3e-3, 1e-3, 3e-4, 1e-4, 3e-5, 1e-5, 3e-6, 1e-6, 3e-7, 1e-7)
FIXED = (1, 2, 3, 4, 5, 6, 7, 8, 10, 12, 16, 20, 25, 32, 40, 64)  # steps between two compared samples
# No implicit ones: the fastest motion, of the arm on its wire, takes 20 ms, and what limits a step is accuracy.
ADAPTIVE = ("Heun", "Bosh3", "Tsit5", "Dopri5", "Dopri8")
CONSTANT = ("Heun", "Bosh3")
BLOCKS = (128, 512, 2048)
FIRST_BLOCK = 512
FIRST_STEP = 1e-3  # s, of steps that the solver chooses
MOST_STEPS = 1 << 16
REPEATS = 3
Solve = Callable[..., Any]


def _one(given: Given, solver: str, adaptive: bool, kept: bool) -> Solve:
    """(setting, voltage, payload) -> (angle in rad, fraction) of one member, at the samples or at the end alone."""
    import diffrax
    import jax.numpy as jnp

    p = given.constants
    term = diffrax.ODETerm(lambda t, state, args: equations.rates(jnp, p, args[0], args[1], state))
    method = getattr(diffrax, solver)()
    saved = diffrax.SaveAt(ts=jnp.asarray(given.times)) if kept else diffrax.SaveAt(t1=True)
    spacing = float(given.times[1])

    def solve(setting: Any, voltage: Any, payload: Any) -> Any:
        if adaptive:
            first, control = FIRST_STEP, diffrax.PIDController(rtol=setting, atol=setting)
        else:
            first, control = spacing / setting, diffrax.ConstantStepSize()
        done = diffrax.diffeqsolve(
            term,
            method,
            0.0,
            given.seconds,
            first,
            equations.start(jnp, p, payload),
            (voltage, payload),
            saveat=saved,
            stepsize_controller=control,
            adjoint=diffrax.ForwardMode(),  # the plain loop: nothing is stored for a gradient
            max_steps=MOST_STEPS,
            throw=False,
        )
        assert done.ys is not None
        return done.ys[2], equations.fraction(jnp, p, done.ys)

    return solve


def _accurate(given: Given, solver: str, adaptive: bool) -> dict[str, Any]:
    """The loosest setting that is accurate on the solved members, with its errors; or the reason why there is none."""
    import jax

    run = jax.jit(jax.vmap(_one(given, solver, adaptive, kept=True), in_axes=(None, 0, 0)))
    voltage, payload = given.voltage[: given.solved], given.payload_mass[: given.solved]
    off = float("inf"), float("inf")
    for setting in TOLERANCES if adaptive else map(float, FIXED):
        angle, xi = run(setting, voltage, payload)
        off = given.errors(np.degrees(angle), np.asarray(xi))
        if given.meets(off):
            return {"setting": setting, "angle_error": off[0], "fraction_error": off[1]}
    return {"reason": f"not accurate at the finest setting: {off[0]:.2g} degrees, {off[1]:.2g} of the fraction"}


def _over_blocks(solve: Solve, block: int, cores: int) -> Any:
    """`solve` for many members: divided over the devices, one block after the other on each."""
    import jax
    from jax.sharding import Mesh, PartitionSpec

    def part(setting: Any, voltage: Any, payload: Any) -> Any:
        blocks = voltage.reshape(-1, block), payload.reshape(-1, block)
        return jax.lax.map(lambda own: jax.vmap(partial(solve, setting))(*own), blocks)

    mesh, over, same = Mesh(np.asarray(jax.devices()[:cores]), ("members",)), PartitionSpec("members"), PartitionSpec()
    return jax.jit(jax.shard_map(part, mesh=mesh, in_specs=(same, over, over), out_specs=over, check_vma=False))


def _timed(given: Given, result: dict[str, Any], block: int, cores: int, count: int, kept: bool) -> dict[str, Any]:
    """Milliseconds of wall clock a trajectory, best of some repeats; the compilation in seconds."""
    solve = _one(given, result["solver"], result["adaptive"], kept)
    whole = block * cores
    count = max(1, count // whole) * whole
    varied = np.resize(given.voltage, count), np.resize(given.payload_mass, count)
    parser = (result["setting"], *varied)
    measured = timed(_over_blocks(solve, block, cores), REPEATS, *parser)
    each = 1e3 * measured.seconds / count
    return {
        "block": block,
        "members": count,
        "cores": cores,
        "ms_per_trajectory": each,
        "compile_s": measured.compile_s,
    }


def _tried(given: Given, solver: str, adaptive: bool, cores: int) -> dict[str, Any]:
    """One solver: its loosest accurate setting and the time at it, or why there is none."""
    named = {"solver": solver, "adaptive": adaptive}
    try:
        result = {**named, **_accurate(given, solver, adaptive)}
        if "setting" not in result:
            return result
        # The fastest are found with one block per core; those are timed in full.
        return {**result, **_timed(given, result, FIRST_BLOCK, cores, 0, kept=False)}
    except Exception as error:  # one that a version cannot compile is no reason to lose the others
        return {**named, "reason": f"{type(error).__name__}: {error}".splitlines()[0]}


def run(given: Given, cores: int, count: int) -> dict[str, Any]:
    """Every solver at its loosest accurate setting, and the fastest of them at its best block."""
    solvers = [(name, True) for name in ADAPTIVE] + [(name, False) for name in CONSTANT]
    tried = [_tried(given, solver, adaptive, cores) for solver, adaptive in solvers]
    met = sorted((one for one in tried if "block" in one), key=lambda one: float(one["ms_per_trajectory"]))
    said = {
        "peer": "diffrax",
        "versions": {name: version(name) for name in ("diffrax", "jax", "numpy")},
        "tried": tried,
    }
    if not met:
        return {**said, "reason": "no solver was accurate enough"}
    # The two fastest, of which another block may change the order.
    again = [{**one, **_timed(given, one, block, cores, count, False)} for one in met[:2] for block in BLOCKS]
    best = min(again, key=lambda one: float(one["ms_per_trajectory"]))
    sampled = _timed(given, best, best["block"], cores, count, kept=True)["ms_per_trajectory"]
    return {**said, "blocks": again, "best": {**best, "ms_per_trajectory_with_samples": sampled}}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("file", type=Path)
    parser.add_argument("--cores", type=int, default=os.cpu_count() or 1)
    parser.add_argument("--count", type=int, default=4096, help="members that are timed")
    options = parser.parse_args()
    # Before jax is imported: a device a core.
    flags = os.environ.get("XLA_FLAGS", "")
    os.environ["XLA_FLAGS"] = f"{flags} --xla_force_host_platform_device_count={options.cores}".strip()
    import jax

    jax.config.update("jax_enable_x64", True)
    jax.config.update("jax_platforms", "cpu")
    print(json.dumps(run(load(options.file), options.cores, options.count)))


if __name__ == "__main__":
    main()
