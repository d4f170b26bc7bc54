"""A command that is late by a part of a step acts in two parts of it: against an integration by other code, with its derivative."""

from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from smajax.core.parameters import parameter_values, set_parameters
from smajax.data.experiment.record import Run
from smajax.fit.integration import with_integration
from smajax.fit.outputs_of_runs import predicted_and_derivatives
from smajax.fit.packed_runs import pack
from smajax.fit.problem import Problem
from smajax.model.extended import extended
from smajax.model.presets import build
from smajax.simulation.batch.axes import zipped
from smajax.simulation.batch.run_batch import run_batch
from smajax.simulation.simulate import simulate
from smajax.simulation.steppers import Integration
from studies import integration as study
from studies.reference.wire_parameters import DeadWeightParameters
from studies.reference.wire_reference import simulate_dead_weight
from tests.helpers.often import often

NOISE = 1e-5  # m
MASS = 0.110
SECONDS = 16.0


def _exact(times: np.ndarray, delay: float) -> np.ndarray:
    segments = [(end + delay, volts, MASS) for end, volts in study._pieces(7.95)]
    return np.asarray(simulate_dead_weight(DeadWeightParameters(), segments, times)["position"])


def _late(clock: float, delay: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """(times, position, its derivative by the delay) of a dead weight whose voltage acts `delay` late."""
    times = np.asarray(np.arange(round(SECONDS / clock) + 1) * clock, dtype=np.float64)
    system = extended(
        build("flexinol_table_3_2", "dead_weight", "voltage"), ("input_delay",), {"input_delay.delay": delay}
    )
    inputs = {"voltage": 7.95 * study._level(times, study.LEVELS), "mass": np.full(times.size, MASS)}
    run = Run("log", "fit", times, inputs, {"position": np.zeros(times.size)}, {}, (), "")
    problem = Problem.build(system, pack([run], clock, parameter_values(system)), NOISE, False)
    problem = with_integration(problem, Integration(jnp.asarray(1e-5)))
    tangent = np.eye(len(problem.names))[[problem.names.index("input_delay.delay")]]
    position, slope = predicted_and_derivatives(problem, problem.start_values()[None], tangent[None])
    return times, position[0, 0], slope[0, 0, 0]


@pytest.mark.parametrize("clock", [0.02, 0.1])
def test_a_delay_of_a_part_of_a_step_agrees_with_scipy(clock: float) -> None:
    """Held over the step, the mean command left 5 noises at 20 ms and 22 at 100 ms."""
    times, position, _ = _late(clock, 0.03)
    assert np.abs(position - _exact(times, 0.03)).max() < 0.1 * NOISE


# At no delay, where a score test takes it, the first part of the step has no length.
@pytest.mark.parametrize("delay", often([0.0, 0.03], [0.03]))
def test_the_derivative_in_the_delay_agrees_with_differences(delay: float) -> None:
    times, _, slope = _late(0.1, delay)
    low, high = max(delay - 1e-4, 0.0), delay + 1e-4
    exact = (_exact(times, high) - _exact(times, low)) / (high - low)
    assert np.sqrt(np.mean(exact**2)) > 1e-3
    assert np.sqrt(np.mean((slope - exact) ** 2)) < 2e-3 * np.sqrt(np.mean(exact**2))


def test_a_constant_command_has_no_delay() -> None:
    """A batch over levels of the voltage has no series of it."""
    system = extended(build("flexinol_table_3_2", "dead_weight", "voltage"), ("input_delay",))
    levels = zipped({"voltage": [4.0, 6.0], "input_delay.delay": [0.0, 0.03]})
    late = run_batch(system, {"mass": MASS}, levels, seconds=2.0, dt=0.02, tolerance=None)
    plain = run_batch(
        build("flexinol_table_3_2", "dead_weight", "voltage"),
        {"mass": MASS},
        zipped({"voltage": [4.0, 6.0]}),
        seconds=2.0,
        dt=0.02,
        tolerance=None,
    )
    np.testing.assert_allclose(late["position"], plain["position"], rtol=0.0, atol=1e-12)


def _oven(times: np.ndarray) -> np.ndarray:
    """Up, down past the middle of the transformation, and up again: it turns between samples of 1 s that are 0.24 s late."""
    return np.interp(times, [0.0, 60.0, 95.0, 130.0], [30.0, 90.0, 55.0, 90.0])


def _under_stress(times: np.ndarray) -> dict[str, jnp.ndarray]:
    return {"temperature": jnp.asarray(_oven(times)), "stress": jnp.full(times.size, 1e8)}


@pytest.mark.parametrize("substeps", [1, 3])
@pytest.mark.parametrize("delay", [0.24, -0.3, 1.6])
def test_a_coupon_whose_temperature_is_late_reaches_where_it_turns(delay: float, substeps: int) -> None:
    """Against the temperature that acts, recorded a hundred times as often: at the samples alone the turn is cut off, by a tenth of a degree."""
    fine = np.arange(13001) / 100.0
    late = extended(build("flexinol_isobaric", "coupon", "none"), ("input_delay",), {"input_delay.delay": delay})
    acting = np.clip(fine - delay, 0.0, 130.0)
    exact = simulate(build("flexinol_isobaric", "coupon", "none"), _under_stress(acting), dt=0.01).strain[::100]
    found = simulate(late, _under_stress(np.arange(131.0)), dt=1.0, integration=Integration(substeps=substeps)).strain
    assert np.ptp(np.asarray(exact)) > 0.02
    # The temperature begins to move between two samples in both, which the clip at the start shows.
    np.testing.assert_allclose(found[2:], exact[2:], rtol=0.0, atol=2e-7)


def test_a_coupon_without_a_delay_runs_as_without_the_effect_and_has_its_derivative() -> None:
    plain = build("flexinol_isobaric", "coupon", "none")
    inputs = _under_stress(np.arange(131.0))
    strains = [simulate(one, inputs, dt=1.0).strain for one in (plain, extended(plain, ("input_delay",)))]
    np.testing.assert_allclose(strains[1], strains[0], rtol=0.0, atol=1e-12)

    def at(delay: jnp.ndarray) -> jnp.ndarray:
        system = extended(plain, ("input_delay", "creep"), {"creep.martensite": 1e-10})
        system = set_parameters(system, {"input_delay.delay": delay})
        return jnp.asarray(simulate(system, inputs, dt=1.0).strain)

    slope = jax.jacfwd(at)(jnp.asarray(0.2))
    difference = (at(jnp.asarray(0.2 + 1e-5)) - at(jnp.asarray(0.2 - 1e-5))) / 2e-5
    assert np.abs(slope).max() > 1e-5
    np.testing.assert_allclose(slope, difference, rtol=0.0, atol=1e-3 * np.abs(slope).max())
