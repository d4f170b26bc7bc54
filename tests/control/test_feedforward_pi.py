"""The hysteresis of a plant read backwards holds it where it says, and the loop with PI around it settles on any load."""

from __future__ import annotations

import itertools

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

import smajax as sma
from smajax.control.controllers.feedforward_pi import FeedforwardPi
from smajax.control.controllers.quasi_static import (
    Turns,
    branch_temperature,
    hysteresis_of,
    leading_command,
    no_turns,
    piecewise,
    turned,
)
from smajax.control.figures_of_merit import band_of
from smajax.control.load_equation import stroke_of
from smajax.control.measured_state import MeasuredState
from smajax.control.perturbed_plant import Perturbation
from smajax.control.presets import CONTROLLERS
from smajax.control.reference import Reference
from smajax.control.sweep.batched_loops import LoopSetup, closed_loops
from smajax.control.sweep.grid import loop_rows
from smajax.core.parameters import set_parameters
from smajax.model.extended import extended, with_effects
from smajax.model.rigs import arm
from smajax.model.system import System

HANGING = sma.compose("flexinol_table_3_2", "dead_weight", "flexinol_voltage")
SPRING = sma.compose("flexinol_ht_500um", "bias_spring", "voltage")
LOADS = {"arm": arm(), "dead weight": HANGING, "bias spring": SPRING}
DT = 0.02


def at_share(system: System, share: float) -> float:
    return float(system.load.start() + share * stroke_of(system))


def held(system: System, shares: list[float], seconds: float) -> list[float]:
    """Where the plant is, as a share of its stroke, after the command of each position was held for so long, open loop."""
    loop = hysteresis_of(system)
    turns, commands = no_turns(jnp.asarray(system.load.start(), dtype=float)), []

    @jax.jit
    def led(turns: Turns, position: jax.Array) -> tuple[Turns, jax.Array]:
        turns = turned(loop, turns, position)
        return turns, leading_command(loop, turns, position, jnp.zeros(()))

    for share in shares:
        turns, command = led(turns, jnp.asarray(at_share(system, share)))
        commands.append(float(command))
    count = round(seconds / DT)
    voltage = np.append(np.repeat(commands, count), commands[-1])
    run = sma.simulate_compiled(system, {"voltage": jnp.asarray(voltage)}, dt=DT)
    ends = np.asarray(run.position)[count::count]
    return [(end - at_share(system, 0.0)) / float(stroke_of(system)) for end in ends]


# The arm well below its angle of greatest stress: near it and above no constant voltage holds it.
@pytest.mark.parametrize(
    ("name", "seconds", "shares"),
    [
        ("arm", 15.0, [0.25, 0.4, 0.2, 0.3]),
        ("dead weight", 8.0, [0.3, 0.6, 0.25, 0.4]),
        ("bias spring", 120.0, [0.3, 0.6, 0.25, 0.4]),
    ],
)
def test_the_feedforward_alone_holds_the_plant_where_it_is_to_be(
    name: str, seconds: float, shares: list[float]
) -> None:
    """Up, down on a branch that begins there, and up again inside of the loop: within 2 % of the stroke."""
    assert held(LOADS[name], shares, seconds) == pytest.approx(shares, abs=0.02)


def test_surroundings_that_warm_up_are_warm_where_a_position_is_held() -> None:
    """The wire keeps its temperature with what they do not take: half of the power where they come to half of its excess."""
    warm = {"warmed_surroundings.share": 0.5, "warmed_surroundings.time_constant": 1.0}
    warmed = extended(HANGING, ("warmed_surroundings",), warm)
    plain, other = hysteresis_of(HANGING), hysteresis_of(warmed)
    own, less = np.asarray(plain.austenite_command), np.asarray(other.austenite_command)
    within = own < 0.99 * own.max()  # of the drive's limit
    assert within.sum() > 5
    assert less[within] ** 2 == pytest.approx(0.5 * own[within] ** 2, rel=1e-3, abs=1e-6)
    where, ends = [0.3, 0.6], held(warmed, [0.3, 0.6], 30.0)
    assert ends == pytest.approx(where, abs=0.03)


def test_a_branch_that_begins_inside_of_the_loop_begins_at_the_top_of_its_range() -> None:
    """Eq. 3.5 from xi_A on: martensite forms from M_s' on, above where the whole branch has that fraction."""
    loop = hysteresis_of(HANGING)
    middle = jnp.asarray(at_share(HANGING, 0.5))
    up = turned(loop, no_turns(jnp.zeros(())), middle)
    down = turned(loop, up, middle - 1e-6)
    assert float(down.heating) == 0.0
    assert float(down.floor_fraction) == pytest.approx(
        float(piecewise(middle, loop.position, loop.heating_fraction)), abs=1e-9
    )
    law = HANGING.wire.kinetics
    start = float(law.martensite_start + loop.stress[0] / law.stress_slope_martensite)
    whole = float(piecewise(middle, loop.position, loop.cooling_temperature))
    assert whole + 2.0 < float(branch_temperature(loop, down, middle)) < start


def test_the_effects_of_a_found_model_are_in_the_command() -> None:
    """Convection that rises with the temperature asks for more, latent heat for no more at rest."""
    base, at = hysteresis_of(SPRING), jnp.asarray(at_share(SPRING, 0.5))
    turns = turned(base, no_turns(jnp.zeros(())), at)

    def command(system: System) -> float:
        return float(leading_command(hysteresis_of(system), turns, at, jnp.zeros(())))

    lossy = set_parameters(with_effects(SPRING, ["rising_convection"]), {"rising_convection.slope": 4e-3})
    latent = set_parameters(with_effects(SPRING, ["latent_heat"]), {"latent_heat.enthalpy": 1e4})
    assert command(lossy) > 1.05 * command(SPRING)
    assert command(latent) == pytest.approx(command(SPRING), rel=1e-9)


@pytest.mark.parametrize("name", ["dead weight", "bias spring"])
def test_it_settles_on_loads_that_nobody_tuned_it_for(name: str) -> None:
    """Gains of the arm, scaled; convection 20 % wrong both ways; at a quarter, a half and three quarters of the stroke."""
    system = LOADS[name]
    seconds = {"dead weight": 6.0, "bias spring": 45.0}[name]
    perturbation = Perturbation(("convection",), ("convection_coefficient",))
    targets = [at_share(system, share) for share in (0.25, 0.5, 0.75)]
    rows = np.asarray([[ratio, target, 1.0] for ratio, target in itertools.product((0.8, 1.0, 1.2), targets)])
    preset = CONTROLLERS["feedforward_pi"]
    setup = LoopSetup(system, preset.make(system), preset.main_gain, seconds, 0.01, perturbation=perturbation)
    merits = closed_loops(setup, rows).merits
    assert np.isfinite(merits.settling_time).all()
    assert (merits.overshoot < 2.0 * float(band_of(system))).all()


def test_on_the_arm_wrong_plants_settle_in_time_on_the_reading_alone() -> None:
    corners = np.asarray([(1.0, 1.0, 1.0, 1.0), *itertools.product((0.8, 1.2), repeat=4)])
    targets = (-20.0, 10.0, 40.0, 70.0)
    named = dict(zip(("inertia", "damping", "convection", "payload"), np.repeat(corners, 4, axis=0).T, strict=True))
    rows = loop_rows(named, np.radians(targets * len(corners)))
    preset = CONTROLLERS["feedforward_pi"]
    merits = closed_loops(LoopSetup(arm(), preset.make(arm()), preset.main_gain), rows).merits
    assert merits.settling_time.max() < 4.0
    assert np.degrees(merits.steady_error).max() < 0.5


def test_path_and_integral_wait_while_the_command_is_at_its_limit() -> None:
    """A plant that is stuck: nothing winds up, however long."""
    controller = CONTROLLERS["feedforward_pi"].make(arm())
    assert isinstance(controller, FeedforwardPi)
    none = jnp.asarray(jnp.nan)
    stuck = MeasuredState(jnp.asarray(-0.78), *[none] * 6)
    wanted = Reference(jnp.asarray(1.0), jnp.zeros(()), jnp.zeros(()))
    memory, period = controller.start(stuck, wanted), jnp.asarray(0.01)
    step, paths, integrals = eqx.filter_jit(controller.step), [], []
    for _ in range(300):
        memory, voltage = step(memory, stuck, wanted, period)
        paths.append(float(memory.path))
        integrals.append(float(memory.integral))
    assert float(voltage) == float(controller.largest_voltage)
    assert paths[-1] == paths[100] < 0.0
    assert integrals[-1] == integrals[100] < 5.0


def test_a_broken_line_is_that_of_numpy() -> None:
    knots, values = np.asarray([0.0, 1.0, 1.0, 3.0]), np.asarray([2.0, 0.0, 5.0, -1.0])
    for at in (-1.0, 0.25, 0.999, 1.5, 3.0, 7.0):
        assert float(piecewise(jnp.asarray(at), jnp.asarray(knots), jnp.asarray(values))) == pytest.approx(
            np.interp(at, knots, values)
        )
    assert isinstance(no_turns(jnp.zeros(())), Turns)
