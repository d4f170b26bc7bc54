"""The benchmarks' problem: the simulator, the peers' equations and the exact solution are one and the same."""

from __future__ import annotations

import sys
from pathlib import Path

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.integrate import solve_ivp

from smajax.cli import benchmark_arm as equations
from smajax.core.parameters import set_parameters
from smajax.model.rigs import arm
from smajax.simulation.simulate import simulate
from studies.benchmarks import numba_arm, numba_peer, peers, problem
from studies.benchmarks.given import Given, load

SOLVED = 4
DT = 0.005  # s


@pytest.fixture(scope="module")
def exact(tmp_path_factory: pytest.TempPathFactory) -> Given:
    file, given = problem.given(SOLVED, SOLVED, tmp_path_factory.mktemp("problem"))
    assert load(file).meets(given.errors(given.angle, given.fraction))
    return given


def test_simulator_is_as_accurate_as_asked(exact: Given) -> None:
    def one(voltage, payload_mass):
        run = simulate(
            set_parameters(arm(), {"payload_mass": payload_mass}), {"voltage": problem.held(voltage, DT)}, DT
        )
        return run.position, run.martensite_fraction

    angle, xi = eqx.filter_jit(jax.vmap(one))(jnp.asarray(exact.voltage), jnp.asarray(exact.payload_mass))
    at = slice(None, None, round(problem.EVERY / DT))
    assert exact.meets(exact.errors(np.degrees(angle[:, at]), np.asarray(xi[:, at])))
    assert exact.fraction.min() == 0.0  # one at least goes all the way


def test_equations_for_peers_are_the_same_problem(exact: Given) -> None:
    p, found = exact.constants, []
    for voltage, payload in zip(exact.voltage.tolist(), exact.payload_mass.tolist(), strict=True):
        first = equations.start(equations.Floats, p, payload)

        def slope(_, state, voltage=voltage, payload=payload):
            return equations.rates(equations.Floats, p, voltage, payload, tuple(state.tolist()))

        span = (0.0, exact.seconds)
        found.append(solve_ivp(slope, span, first, "DOP853", exact.times, rtol=1e-6, atol=1e-7, max_step=0.05).y)
    states = np.array(found).swapaxes(0, 1)
    off = exact.errors(np.degrees(states[2]), equations.fraction(np, p, tuple(states)))
    assert off[0] < 1e-3
    assert off[1] < 1e-5


def test_numbas_program_is_as_accurate_as_asked(exact: Given) -> None:
    off = numba_peer.errors(exact, numba_arm.build(np.float64, 1), np.float64, 1, DT)
    assert exact.meets(off)
    coarse = numba_peer.errors(exact, numba_arm.build(np.float64, 1), np.float64, 1, 5.0 * DT)
    assert not exact.meets(coarse)


def test_a_smaller_batch_is_the_beginning_of_a_larger_one() -> None:
    few, many = problem.members(5), problem.members(64)
    assert all(np.array_equal(few[name], many[name][:5]) for name in few)


def test_a_peer_that_cannot_run_says_why(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv(peers.DIFFRAX_PYTHON, raising=False)
    assert peers.DIFFRAX_PYTHON in peers.diffrax(tmp_path / "none.npz")["reason"]
    monkeypatch.delenv(peers.NUMBA_PYTHON, raising=False)
    assert peers.NUMBA_PYTHON in peers.numba(tmp_path / "none.npz", DT)["reason"]
    monkeypatch.delenv(peers.GRADSOLVE_PYTHON, raising=False)
    assert peers.GRADSOLVE_PYTHON in peers.gradient("gradsolve", tmp_path / "none.npz")["reason"]
    # This interpreter has none of them: what the import says is the reason.
    missing = peers.numba(tmp_path / "none.npz", DT, python=sys.executable)
    assert "none.npz" in missing["reason"]
    assert "none.npz" in peers.run_peer("scipy_peer", sys.executable, str(tmp_path / "none.npz"))["reason"]
