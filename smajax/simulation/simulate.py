"""A system and its input series -> a trajectory. `jit`, `vmap` and `grad` stay outside."""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from smajax.core.names import listed
from smajax.core.parameters import check_bounds, parameters
from smajax.model.load.coupon import AbstractCoupon
from smajax.model.system import System, initial_state
from smajax.model.types import Scalar, Series, State, Trajectory
from smajax.simulation.input_delay import acting_inputs
from smajax.simulation.integrate import Schedule, integrate
from smajax.simulation.observers import StateTrace
from smajax.simulation.steppers import ONE_STEP, Integration, Stepper, stepper_of

# Keeps the arm within 0.05 degrees and the fraction within 1e-3 of the exact solution on the source's rigs, open and
# closed loop (studies/convergence.py shows error against step).
DEFAULT_STEP = 0.005  # s
SHORTER = 1e-3  # of a run: by less than this share of it another end is not said


class UnsolvedWarning(UserWarning):
    """Steps of a run did not converge: it may be wrong from the first of them on."""


def check_kinds(system: Any, inputs: Any) -> None:
    """TypeError where these are of another kind."""
    if not isinstance(system, System):
        raise TypeError(
            f"a run is of a `System`, as `compose` makes it, not of {type(system).__name__}; a `Loop` goes to `simulate_loop_dataset`."
        )
    if not isinstance(inputs, Mapping):
        raise TypeError(
            f"`inputs` is {type(inputs).__name__}; expected channel -> series, such as {{'voltage': series}}."
        )


def check_inputs(system: System, inputs: Mapping[str, Series]) -> int:
    """Number of samples; ValueError when a channel is missing, unknown, of another length, or not finite where it is known."""
    check_kinds(system, inputs)
    required = system.load.inputs_required | system.drive.inputs_required
    allowed = required | system.load.inputs_optional | system.drive.inputs_optional | {"ambient_temperature"}
    missing, unknown = sorted(required - set(inputs)), sorted(set(inputs) - allowed)
    if missing or unknown:
        raise ValueError(
            f"`inputs` must have the channels {listed(sorted(required))} and may have {listed(sorted(allowed - required))}, but "
            f"missing: {listed(missing)}; of no meaning to this load and drive: {listed(unknown)}."
        )
    for name, series in inputs.items():
        check_finite(f"the input `{name}`", series)
    lengths = {name: jnp.shape(series) for name, series in inputs.items()}
    if not lengths:
        raise ValueError("`inputs` is empty: without one series there is no clock. Give e.g. `ambient_temperature`.")
    if len(set(lengths.values())) != 1 or len(next(iter(lengths.values()))) != 1 or 0 in next(iter(lengths.values())):
        raise ValueError(
            f"Every input must be one series of the same length, not empty, but the shapes are {lengths}. Use `jax.vmap` over "
            "a batch, and `jnp.full(n, value)` for a constant."
        )
    return next(iter(lengths.values()))[0]


def check_finite(what: str, series: Any) -> None:
    """ValueError where a series holds anything but finite numbers, where it is known."""
    if isinstance(series, jax.core.Tracer):
        return
    known = np.asarray(series)
    if known.dtype.kind not in "fiub":
        kind = f"of type {known.dtype}" if isinstance(series, np.ndarray) else type(series).__name__
        raise ValueError(f"{what} is {kind}; expected numbers, a series of shape (n,).")
    bad = np.flatnonzero(~np.isfinite(known))
    if bad.size:
        raise ValueError(f"{what} is {known.ravel()[bad[0]]} at sample {bad[0] + 1}; give finite numbers.")


def check_step(dt: Any) -> None:
    """ValueError for a step that is not positive and finite, where it is known."""
    if isinstance(dt, str):
        raise ValueError(f"`dt` is a number of seconds, not {dt!r}.")
    if not isinstance(dt, jax.core.Tracer) and jnp.shape(dt) == () and not 0.0 < float(dt) < float("inf"):
        raise ValueError(f"`dt` is the time between two samples, in seconds and above zero, not {float(dt):g}.")


def check_scalars(system: System, dt: Scalar | float, initial: State | None = None) -> None:
    """ValueError that names the number which is a batch, with its shape; and for a wrong step."""
    check_step(dt)
    leaves = {f"`{name}`": leaf for name, leaf in _parameter_leaves(system).items()}
    leaves |= {
        f"`initial{jax.tree_util.keystr(path)}`": leaf for path, leaf in jax.tree_util.tree_leaves_with_path(initial)
    }
    leaves["`dt`"] = dt
    wrong = {name: jnp.shape(leaf) for name, leaf in leaves.items() if jnp.shape(leaf) != ()}
    if wrong:
        message = "; ".join(f"{name} has the axes {shape}" for name, shape in wrong.items())
        raise ValueError(
            f"one run takes one number of each, and {message}. Map over the batch: `jax.vmap(run)(values)` with a `run` that puts "
            "one value in (`set_parameters`), or name what varies in `run_batch`."
        )


def _parameter_leaves(system: System) -> dict[str, Any]:
    result = {}
    for name, entry in parameters(system).items():
        leaf: Any = system
        for key in entry.path:
            leaf = leaf[key] if isinstance(key, int) else getattr(leaf, key)
        result[name] = leaf
    return result


def first_state(system: System, series: Mapping[str, Series], initial: State | None) -> State:
    """`initial`, or rest with the first inputs. ValueError where `initial` is of a model that remembers other things."""
    rest = initial_state(system, {name: values[0] for name, values in series.items()})
    if initial is None:
        return rest
    for part, theirs, ours in (
        ("wire", initial.wire.history, rest.wire.history),
        ("load", initial.motion.friction, rest.motion.friction),
        ("sensor", initial.sensor, rest.sensor),
    ):
        if set(theirs) != set(ours):
            raise ValueError(
                f"`initial` remembers {sorted(theirs)} of the {part}, but the effects of this system need "
                f"{sorted(ours)}. Take a state that a system with the same effects has come to."
            )
    return initial


def simulate(
    system: System,
    inputs: Mapping[str, Series],
    dt: Scalar | float = DEFAULT_STEP,
    initial: State | None = None,
    integration: Integration = ONE_STEP,
    *,
    once: bool = False,
) -> Trajectory:
    """Simulate over the samples of `inputs`, each of shape (n,), SI, `dt` seconds apart.

    The result holds the states at t_0 ... t_{n-1}; input i is held from t_i to t_{i+1} (a coupon's inputs are values
    at t_i). `unsolved` counts the stages until then whose solver did not converge: 0, or take a shorter step (an
    `UnsolvedWarning` says so of a run in double precision that is not traced). `initial` defaults to rest with the first
    inputs. Raises ValueError for missing or ill-shaped inputs, for one that is not finite and a parameter out of its bounds, unless the value is not known yet (`jit`, `vmap`, `grad`).
    `integration`: how finely between two samples, by default one step, for what is traced cannot look at its own error:
    `compiled.chosen_integration` looks before. Error-controlled steps have derivatives in forward mode alone. `once`: the run will be differentiated once at most, which is a
    tenth quicker; derivatives of the second order are wrong then.
    """
    check_inputs(system, inputs)
    check_scalars(system, dt, initial)
    check_bounds(system)
    series = acting_inputs(system, {name: jnp.asarray(values, dtype=float) for name, values in inputs.items()}, dt)
    run = trajectory_of(stepper_of(system, dt, integration, once), series, first_state(system, series, initial))
    warn_of_unsolved(run)
    return run


def warn_of_unsolved(run: Trajectory) -> None:
    """An `UnsolvedWarning` to whoever called the caller, where a stage of `run` did not converge; none within `jit`, `vmap`, `grad`.

    Nor in single precision: there a few stages of a good run end a rounding error outside of the solver's tolerance.
    """
    if isinstance(run.unsolved, jax.core.Tracer) or run.unsolved.dtype != np.float64:
        return
    late = (
        np.flatnonzero(np.diff(np.asarray(run.unsolved)) > 0.0) + 1
    )  # a step counts once, whichever of its stages it was
    if not late.size:
        return
    text = (
        f"{late.size} of {len(run.time) - 1} steps did not converge, the first of them before {float(run.time[late[0]]):.6g} s: the run may be wrong from there on. "
        "Take a shorter `dt`, or several steps between two samples (`simulate_compiled(..., tolerance=1e-4)`)."
    )
    warnings.warn(text, UnsolvedWarning, stacklevel=3)


def warn_of_length(asked: float, end: float, step: float, stacklevel: int) -> None:
    """Warns of a run that ends at another time than was asked for, for it consists of whole steps; all in s."""
    if abs(end - asked) > SHORTER * asked:
        warnings.warn(
            f"a run ends at {end:g} s, not at the {asked:g} s asked for, because it has whole steps of {step:g} s: give a multiple of these.",
            stacklevel=stacklevel,
        )


def held_inputs(system: System, series: Mapping[str, Series]) -> dict[str, Series]:
    """What is held during each step, (n - 1,), of series of n samples: the values at its start; a coupon's at its end."""
    ahead = isinstance(system.load, AbstractCoupon)
    return {name: values[1:] if ahead else values[:-1] for name, values in series.items()}


def trajectory_of(stepper: Stepper, series: Mapping[str, Series], state: State) -> Trajectory:
    """The run from `state` under series of n samples that act on the system (`acting_inputs`)."""
    system = stepper.system
    # Every number of the state then has a derivative where the model has one: a scan some of whose numbers gain theirs
    # on the way is traced anew for each, and so is all within it.
    state = jax.tree.map(lambda leaf: leaf + 0.0 * system.start_fraction, state)
    held, first = held_inputs(system, series), {name: values[0] for name, values in series.items()}
    steps = len(next(iter(held.values())))
    run = integrate(stepper, stepper.start(state, first), held, Schedule(steps), (StateTrace(),))
    return trajectory(run.results[0])


def trajectory(states: State) -> Trajectory:
    """Stacked states, leaves of shape (n,), by name."""
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
        unsolved=states.unsolved,
    )
