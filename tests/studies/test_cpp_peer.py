"""The programs written by hand, in C++ and for numba, solve what smajax solves: they are no bar for the speed of something else."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from smajax.core.parameters import get_parameters, parameter_values, set_parameters
from smajax.model.rigs import arm
from smajax.model.system import System
from smajax.model.types import Scalar, Trajectory
from smajax.simulation.simulate import simulate
from studies.benchmarks import cpp, numba_arm

DT, STEPS = 0.005, 2000


@pytest.fixture(scope="module")
def program(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The program, compiled; skips where there is no compiler."""
    built = cpp.build(tmp_path_factory.mktemp("cpp"))
    if built is None:
        pytest.skip(cpp.MISSING)
    return built


def _members(number: int) -> np.ndarray:
    """Voltages from hardly warm to the upper stop, with payloads 0.8 to 1.2 of the preset's."""
    mass = float(get_parameters(arm(), ["payload_mass"])[0])
    return np.stack([np.linspace(5.5, 8.5, number), mass * np.linspace(1.2, 0.8, number)], axis=1)


def _swinging() -> System:
    """An arm that swings, hardly damped, on a wire in the middle of both ranges: stress turns the transformation."""
    changed = {
        "start_fraction": 0.5,
        "ambient_temperature": 56.0,
        "damping": 1e-5,
        "start_angle": 0.3,
        "spring_rest_angle": 0.6,
        "spring_stiffness": 20.0,
        "martensite_start": 60.0,
        "stress_slope_martensite": 6e6,
        "resistivity_martensite": 1.2e-6,
        "thermal_modulus": -0.55e6,
    }
    return set_parameters(arm(), changed)


@eqx.filter_jit
def _simulated(system: System, members: np.ndarray) -> Trajectory:
    def one(voltage: Scalar, mass: Scalar) -> Trajectory:
        own = set_parameters(system, {"payload_mass": mass})
        return simulate(own, {"voltage": jnp.full(STEPS + 1, voltage)}, DT)

    return jax.vmap(one)(*jnp.asarray(members).T)


@pytest.mark.parametrize("build", [arm, _swinging])
def test_every_sample_of_the_cpp_program_agrees(program: Path, build: Callable[[], System]):
    members = _members(8)
    ours = _simulated(build(), members)
    theirs = cpp.run(program, build(), members, DT, STEPS, recorded=len(members))
    assert np.ptp(theirs.angle) > 1.0  # some stay below, some reach the stop
    if build is _swinging:
        assert (np.diff(theirs.fraction, axis=0) > 1e-4).any()  # both branches are followed
    assert np.abs(theirs.angle.T - ours.position).max() < 1e-5
    assert np.abs(theirs.fraction.T - ours.martensite_fraction).max() < 1e-5
    np.testing.assert_allclose(theirs.final_temperature, ours.temperature[:, -1], atol=1e-5)
    np.testing.assert_allclose(theirs.largest_angle, ours.position.max(axis=1), atol=1e-5)
    np.testing.assert_allclose(theirs.smallest_fraction, ours.martensite_fraction.min(axis=1), atol=1e-5)


@pytest.mark.parametrize("build", [arm, _swinging])
def test_every_sample_of_numbas_program_agrees(build: Callable[[], System]):
    members = _members(8)
    ours = _simulated(build(), members)
    # As ordinary Python, two members to a block; numba compiles the same functions.
    simulate = numba_arm.build(np.float64, 2)
    constants = parameter_values(build())
    record, result = np.empty((STEPS + 1, len(members), 2)), np.empty((len(members), numba_arm.COLUMNS))
    own = numba_arm.members_of(constants, DT, *members.T)
    iterations = simulate(numba_arm.rig_of(constants, DT, np.float64), own, STEPS, 1, record, result)
    assert 2.0 <= iterations / (STEPS * len(members)) < 3.0  # stages: two a step, of blocks of two
    assert np.abs(record[..., 0].T - ours.position).max() < 1e-5
    assert np.abs(record[..., 1].T - ours.martensite_fraction).max() < 1e-5
    np.testing.assert_allclose(result[:, 0], record[-1, :, 0])
    np.testing.assert_allclose(result[:, 1], ours.position.max(axis=1), atol=1e-5)
    np.testing.assert_allclose(result[:, 2], ours.martensite_fraction.min(axis=1), atol=1e-5)
    np.testing.assert_allclose(result[:, 3], ours.temperature[:, -1], atol=1e-5)


def test_threads_and_precisions_agree(program: Path):
    members = _members(100)  # no multiple of a block
    exact = cpp.run(program, arm(), members, DT, STEPS)
    threads = cpp.run(program, arm(), members, DT, STEPS, threads=2, every=100, recorded=3)
    single = cpp.run(program, arm(), members, DT, STEPS, precision="float")
    np.testing.assert_array_equal(threads.final_angle, exact.final_angle)
    assert threads.angle.shape == (STEPS // 100 + 1, 3)
    np.testing.assert_array_equal(threads.angle[-1], exact.final_angle[:3])
    # About the angle of greatest stress the arm hangs on little: single precision shows there.
    assert np.abs(single.final_angle - exact.final_angle).max() < 0.02
    assert np.abs(single.smallest_fraction - exact.smallest_fraction).max() < 0.01
