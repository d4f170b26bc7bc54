"""The only scan: a system and its input series -> a trajectory. `jit`, `vmap` and `grad` stay outside."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping

import jax
import jax.numpy as jnp
from jax import lax

from smajax.load.coupon import AbstractCoupon
from smajax.step import step
from smajax.system import System, initial_state
from smajax.types import Scalar, Series, State, Trajectory

# Keeps the arm within 0.05 degrees and the fraction within 1e-3 of the exact solution on the source's rigs, open and
# closed loop (studies/convergence.py shows error against step).
DEFAULT_STEP = 0.005  # s


def check_inputs(system: System, inputs: Mapping[str, Series]) -> int:
    """Number of samples; ValueError when a channel is missing, unknown, or of another length."""
    required = system.load.inputs_required | system.drive.inputs_required
    allowed = required | system.load.inputs_optional | system.drive.inputs_optional | {"ambient_temperature"}
    missing, unknown = sorted(required - set(inputs)), sorted(set(inputs) - allowed)
    if missing or unknown:
        raise ValueError(
            f"`inputs` must have the channels {sorted(required)} and may have {sorted(allowed - required)}, but "
            f"{missing} are missing and {unknown} mean nothing to this load and drive."
        )
    lengths = {name: jnp.shape(series) for name, series in inputs.items()}
    if not lengths:
        raise ValueError("`inputs` is empty: without one series there is no clock. Give e.g. `ambient_temperature`.")
    if len(set(lengths.values())) != 1 or len(next(iter(lengths.values()))) != 1:
        raise ValueError(
            f"Every input must be one series of the same length, but the shapes are {lengths}. Use `jax.vmap` over "
            "a batch, and `jnp.full(n, value)` for a constant."
        )
    return next(iter(lengths.values()))[0]


def simulate(
    system: System, inputs: Mapping[str, Series], dt: Scalar | float = DEFAULT_STEP, initial: State | None = None
) -> Trajectory:
    """Simulate over the samples of `inputs`, each of shape (n,), SI, `dt` seconds apart.

    The result holds the states at t_0 ... t_{n-1}; input i is held from t_i to t_{i+1} (a coupon's inputs are values
    at t_i). `initial` defaults to rest with the first inputs. Raises ValueError for missing or ill-shaped inputs.
    """
    check_inputs(system, inputs)
    series = {name: jnp.asarray(values, dtype=float) for name, values in inputs.items()}
    state = initial_state(system, {name: values[0] for name, values in series.items()}) if initial is None else initial
    # Every number of the state then has a derivative where the model has one: a scan some of whose numbers gain theirs
    # on the way is traced anew for each, and so is all within it.
    state = jax.tree.map(lambda leaf: leaf + 0.0 * system.start_fraction, state)
    ahead = isinstance(system.load, AbstractCoupon)
    held = {name: values[1:] if ahead else values[:-1] for name, values in series.items()}

    def body(state: State, now: dict[str, Scalar]) -> tuple[State, State]:
        new = step(system, state, now, dt)
        return new, new

    _, states = lax.scan(body, state, held)
    run = trajectory(state, states)
    shown = run.reading
    for effect in system.effects:
        shown = effect.sensed(shown, run.time, shown)
    return dataclasses.replace(run, reading=shown)


def trajectory(first: State, rest: State) -> Trajectory:
    """The state at t_0 and the stacked states after it, by name."""
    states = jax.tree.map(lambda one, more: jnp.concatenate([one[None], more]), first, rest)
    w, m = states.wire, states.motion
    return Trajectory(
        time=states.time,
        temperature=w.temperature,
        stress=w.stress,
        strain=w.strain,
        martensite_fraction=w.martensite_fraction,
        xi_M=w.xi_M,
        xi_A=w.xi_A,
        detwinned_fraction=w.detwinned_fraction,
        position=m.position,
        velocity=m.velocity,
        reading=states.reading,
    )
