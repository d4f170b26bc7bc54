"""The receding horizon's step is a Gauss-Newton step of its cost, within the command's limits, and its loops settle on any load."""

from __future__ import annotations

import itertools
from typing import Any

import jax.numpy as jnp
import numpy as np
import pytest
from jax import lax

import smajax as sma
from smajax.control.closed_loop import simulate_closed_loop
from smajax.control.controllers.receding_horizon import LEAST, Normal, RecedingHorizon, improved
from smajax.control.load_equation import stroke_of
from smajax.control.measured_state import MeasuredState, truth
from smajax.control.perturbed_plant import Perturbation
from smajax.control.presets import CONTROLLERS
from smajax.control.reference import Reference, clock, steps
from smajax.control.sweep.batched_loops import LoopSetup, closed_loops
from smajax.control.sweep.grid import loop_rows
from smajax.model.extended import extended
from smajax.model.rigs import arm
from smajax.model.system import initial_state
from smajax.model.types import State
from smajax.simulation.step import step
from tests.helpers.machine_code import by_machine_code

ARM = arm()
PRESET = CONTROLLERS["receding_horizon"]
LOADS = {
    "dead weight": (sma.compose("flexinol_table_3_2", "dead_weight", "flexinol_voltage"), 6.0),
    "bias spring": (sma.compose("flexinol_ht_500um", "bias_spring", "voltage"), 45.0),
}
PERIOD = 0.01


def made() -> RecedingHorizon:
    controller = PRESET.make(ARM)
    assert isinstance(controller, RecedingHorizon)
    return controller


def moving(seconds: float) -> State:
    """The arm after so long under 10 V."""

    def heated(state: State) -> State:
        inputs = ARM.drive.from_command(jnp.asarray(10.0))
        return lax.scan(lambda now, _: (step(ARM, now, inputs, 0.01), None), state, None, round(seconds / 0.01))[0]

    return by_machine_code(heated)(initial_state(ARM, ARM.drive.from_command(jnp.asarray(0.0))))


def residuals(controller: RecedingHorizon, plan: np.ndarray, held: float, state: State, goal: float) -> np.ndarray:
    """r(q) as the head of the module prints it, of the package's simulation of the plan, in numpy."""
    count, dt = controller.pieces * controller.steps, float(controller.piece_time) / controller.steps
    volts = float(controller.largest_voltage) * np.sqrt(np.repeat(plan, controller.steps))
    run = sma.simulate_compiled(ARM, {"voltage": jnp.asarray(np.append(volts, volts[-1]))}, dt, initial=state)
    position, velocity = np.asarray(run.position)[1:], np.asarray(run.velocity)[1:]
    error = position - goal
    weight = np.where(error * velocity > 0.0, float(controller.beyond_weight), 1.0)
    changes = np.diff(np.append(held, plan))
    return np.concatenate(
        [
            weight * error / np.sqrt(count),
            [float(controller.velocity_time) * velocity[-1]],
            float(controller.change_weight) * changes,
        ]
    )


def test_a_period_is_one_gauss_newton_step_of_the_printed_cost() -> None:
    """By differences of a simulation in the place of derivatives, where no share comes to a limit and some of the way is beyond the set point."""
    controller, state, goal, held = made(), moving(1.0), -0.1, 0.8
    plan = np.asarray([0.65, 0.5, 0.45, 0.4, 0.4])
    size, small = len(plan), 1e-5
    at = residuals(controller, plan, held, state, goal)
    columns = [
        (residuals(controller, plan + move, held, state, goal) - residuals(controller, plan - move, held, state, goal))
        / (2.0 * small)
        for move in small * np.eye(size)
    ]
    slopes = np.stack(columns, axis=1)
    damped = slopes.T @ slopes + float(controller.damping_weight) ** 2 * np.eye(size)
    expected = plan - np.linalg.solve(damped, slopes.T @ at)
    errors = at[: controller.pieces * controller.steps]
    assert errors.min() < 0.0 < errors.max()
    assert ((expected > 0.01) & (expected < 0.99)).all()
    assert np.abs(expected - plan).max() > 0.02

    def called(controller: RecedingHorizon, measured: MeasuredState) -> Any:
        wanted = Reference(jnp.asarray(goal), jnp.asarray(0.0), jnp.asarray(0.0))
        memory = controller.start(measured, wanted)
        memory = memory.__class__(jnp.asarray(plan), jnp.asarray(held), memory.expected, memory.air, memory.integral)
        return controller.step(memory, measured, wanted, jnp.asarray(PERIOD))

    memory, volts = by_machine_code(called)(controller, truth(state))
    assert float(volts) == pytest.approx(float(controller.largest_voltage) * np.sqrt(expected[0]), rel=1e-5)
    passed = PERIOD / float(controller.piece_time)
    shifted = (1.0 - passed) * expected + passed * np.append(expected[1:], expected[-1])
    np.testing.assert_allclose(memory.plan, shifted, rtol=1e-5)


def test_a_step_that_would_leave_the_limits_ends_on_them_and_never_rises() -> None:
    """Of 200 random problems: free shares solve the normal equations of the damped step, others are at a limit, and its quadratic is no higher than before."""
    draw, size = np.random.default_rng(3), 5
    step_of = by_machine_code(
        lambda plan, matrix, downhill: improved(plan, Normal(matrix, downhill), jnp.asarray(1e-3))
    )
    held = 0
    for _ in range(200):
        rows, plan = draw.normal(size=(9, size)), draw.uniform(LEAST, 1.0, size)
        plan = np.where(draw.uniform(size=size) < 0.2, LEAST, plan)
        right = 0.5 * draw.normal(size=9)
        matrix, downhill = rows.T @ rows, -rows.T @ right
        new = np.asarray(step_of(jnp.asarray(plan), jnp.asarray(matrix), jnp.asarray(downhill)))
        assert ((new >= LEAST) & (new <= 1.0)).all()
        damped = matrix + 1e-6 * np.eye(size)
        free = (new > LEAST) & (new < 1.0)
        slope = damped @ (new - plan) - downhill
        np.testing.assert_allclose(slope[free], 0.0, atol=1e-9)
        change = new - plan
        assert 0.5 * change @ damped @ change - downhill @ change <= 1e-12
        held += int((~free).sum())
    assert held > 100


def test_its_commands_stay_within_the_limits_and_reach_both() -> None:
    wanted = steps(clock(6.0, PERIOD), (0.6, -0.2, 0.3), 2.0)
    run = by_machine_code(simulate_closed_loop)(ARM, made(), wanted, PERIOD)
    assert run.voltage.min() == 0.0
    assert run.voltage.max() == 10.0
    ends = np.asarray(run.run.position)[[199, 399, 599]]
    np.testing.assert_allclose(ends, [0.6, -0.2, 0.3], atol=np.radians(1.0))


def test_it_settles_earlier_than_pi_with_feedforward() -> None:
    rows = loop_rows({}, np.radians([-10.0, 45.0]))
    times = {}
    for name in ("receding_horizon", "feedforward_pi"):
        preset = CONTROLLERS[name]
        times[name] = closed_loops(LoopSetup(ARM, preset.make(ARM), preset.main_gain, 5.0), rows).merits.settling_time
    assert (times["receding_horizon"] < 0.8 * times["feedforward_pi"]).all()


@pytest.mark.parametrize("name", LOADS)
def test_it_settles_on_loads_that_nobody_tuned_it_for(name: str) -> None:
    """Gains of the arm, scaled; convection 20 % wrong both ways; at a quarter, a half and three quarters of the stroke."""
    system, seconds = LOADS[name]
    perturbation = Perturbation(("convection",), ("convection_coefficient",))
    targets = [float(system.load.start() + share * stroke_of(system)) for share in (0.25, 0.5, 0.75)]
    rows = np.asarray([[ratio, target, 1.0] for ratio, target in itertools.product((0.8, 1.0, 1.2), targets)])
    setup = LoopSetup(system, PRESET.make(system), PRESET.main_gain, seconds, 0.01, perturbation=perturbation)
    merits = closed_loops(setup, rows).merits
    assert np.isfinite(merits.settling_time).all()


def test_a_model_whose_input_is_late_is_refused_in_words() -> None:
    with pytest.raises(ValueError, match="a receding horizon makes its input as it goes"):
        PRESET.make(extended(ARM, ("input_delay",)))
