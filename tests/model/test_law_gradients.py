"""Derivatives under every law and load, in forward and reverse mode, at kinks, and across a branch change."""

from __future__ import annotations

import dataclasses
import itertools
from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from smajax.control.closed_loop import simulate_closed_loop
from smajax.control.presets import stress_sliding
from smajax.core.parameters import get_parameters, parameters, set_parameters, set_vector
from smajax.engine import program
from smajax.model.presets import build
from smajax.model.system import System
from smajax.model.wire.laws import LAWS, under_law
from smajax.simulation.compiled import simulate_compiled
from smajax.simulation.simulate import simulate
from tests.helpers.derivatives import compare
from tests.helpers.machine_code import by_machine_code
from tests.helpers.often import often

DT = 0.05
NAMES = sorted(LAWS)


def _under(law: str, wire: str, load: str, drive: str) -> System:
    system = build(wire, load, drive)
    return dataclasses.replace(system, wire=under_law(system.wire, law))


def _moved(top: float, wanted: float):
    """Final and mean reading, least fraction, and the cost of tracking `wanted`, of a heated and cooled actuator."""
    levels = jnp.concatenate([jnp.full(100, 1.0), jnp.full(40, 0.7), jnp.full(60, 0.96), jnp.full(60, 0.0)]) * top

    def features(system: System) -> jax.Array:
        channel = "duty" if "duty" in system.drive.inputs_required else "voltage"
        run = simulate(system, {channel: levels}, DT)
        scale = jnp.abs(wanted)
        return jnp.stack(
            [
                run.reading[199] / scale,
                run.reading.mean() / scale,
                run.martensite_fraction.min(),
                jnp.mean((run.reading / scale - 1.0) ** 2),
            ]
        )

    return features


MOVING = {
    # Below the voltage at which the arm snaps through: there a step of 50 ms is all kinks.
    "arm": ("niti_table_3_1", "arm", "amplified_voltage", 7.1, 0.5),
    "dead_weight": ("flexinol_table_3_2", "dead_weight", "voltage", 7.4, 0.02),
    "bias_spring": ("flexinol_ht_500um", "bias_spring", "duty", 0.35, 0.01),
}


# Two laws and loads are in `make test`, the enhanced law's arm in `test_gradients`, Brinson's law on a coupon below, the dead
# weight in `test_every_effect`; the whole grid is in `make test-all`.
OFTEN = {("tanaka", "arm"), ("liang", "bias_spring")}


@pytest.mark.parametrize(("law", "load"), often(itertools.product(NAMES, sorted(MOVING)), OFTEN))
def test_derivatives_in_every_parameter_of_a_moving_load_agree_with_differences(law: str, load: str) -> None:
    wire, name, drive, top, wanted = MOVING[load]
    compare(_under(law, wire, name, drive), _moved(top, wanted))


@pytest.mark.parametrize(
    ("load", "law"),
    often(
        itertools.product(["coupon", "strain_coupon"], NAMES),
        [("coupon", "brinson"), ("coupon", "tanaka"), ("strain_coupon", "enhanced"), ("strain_coupon", "liang")],
    ),
)
def test_derivatives_in_every_parameter_of_a_coupon_agree_with_differences(law: str, load: str) -> None:
    """A path on which temperature and load change together, with a reversal inside each range."""
    system = _under(law, "flexinol_table_3_2", load, "none")
    n = 300
    temperature = jnp.interp(
        jnp.arange(n) / n, jnp.array([0.0, 0.3, 0.5, 0.8, 1.0]), jnp.array([25.0, 97.0, 61.0, 99.0, 40.0])
    )
    wave = jnp.sin(0.04 * jnp.arange(n))
    prescribed = {"stress": 1e6 * (110.0 + 37.0 * wave)} if load == "coupon" else {"strain": 0.006 + 0.0047 * wave}

    def features(system: System) -> jax.Array:
        run = simulate(system, {"temperature": temperature, **prescribed}, 1.0)
        scale = 0.01 if load == "coupon" else 1e8
        return jnp.stack([run.reading.mean() / scale, run.reading[150:].mean() / scale, run.martensite_fraction.mean()])

    # Whether loading formed the martensite is yes or no: with a trace of austenite at the start it turns to yes at once,
    # and there is no derivative.
    compare(system, features, {"start_fraction"} if law in ("tanaka", "brinson") else ())


@pytest.mark.slow
def test_closed_loop_has_the_derivatives_of_its_gains() -> None:
    arm = build("niti_table_3_1", "arm", "amplified_voltage")
    target = jnp.full(301, 0.3)
    gains = ["surface_slope", "gain", "boundary", "stress_gain", "stress_integral_gain"]
    table = parameters(stress_sliding(arm))
    assert set(gains) <= set(table)
    at = get_parameters(stress_sliding(arm), gains)

    def cost_of(share: jax.Array) -> jax.Array:
        loop = simulate_closed_loop(arm, set_vector(stress_sliding(arm), gains, at * share), target, 0.02)
        return jnp.mean((loop.run.position - loop.wanted.position) ** 2)

    one = jnp.ones(len(gains))
    automatic = by_machine_code(jax.grad(cost_of))(one)
    cost, step = by_machine_code(cost_of), 1e-5
    for k in range(len(gains)):
        along = jnp.zeros(len(gains)).at[k].set(step)
        difference = float(cost(one + along) - cost(one - along)) / (2 * step)
        assert automatic[k] == pytest.approx(difference, rel=1e-4, abs=1e-8), gains[k]


def _finite(system: System, inputs: dict[str, jax.Array], dt: float = DT) -> None:
    names = list(parameters(system))

    def ends(at: jax.Array) -> jax.Array:
        run = simulate(set_vector(system, names, at), inputs, dt)
        return jnp.stack([run.reading[-1], run.martensite_fraction.min(), run.temperature[-1], run.stress.mean()])

    def column(at: jax.Array, own: dict[str, jax.Array]) -> jax.Array:
        return jax.jvp(ends, (at,), (jnp.stack([own[name] for name in names]),))[1]

    def row(at: jax.Array, own: dict[str, jax.Array]) -> jax.Array:
        return jax.vjp(ends, at)[1](jnp.stack([own[k] for k in "abcd"]))[0]

    def of_each(function: Callable[..., Any], kinds: Sequence[str]) -> np.ndarray:
        """One run for each of `kinds`, along itself."""
        own = dict(zip(kinds, np.eye(len(kinds)), strict=True))
        return program(function, at, tuple(kinds), engine="native")(at, own, 1)

    at = get_parameters(system, names)
    forward, backward = of_each(column, names).T, of_each(row, "abcd")
    assert np.isfinite(forward).all()
    np.testing.assert_allclose(backward, forward, rtol=1e-6, atol=1e-9 * np.abs(forward).max())


@pytest.mark.parametrize("law", often(NAMES, ["enhanced"]))
def test_derivatives_are_finite_at_the_start_of_a_range(law: str) -> None:
    """The wire sits exactly on A_s' with all martensite, then on M_s' with none: the slopes there are 0/0 forms."""
    system = _under(law, "flexinol_table_3_2", "coupon", "none")
    stress = 68.9e6  # moves every temperature by exactly 10 C
    temperature = jnp.array([23.0, 78.0, 78.0, 79.0, 88.0, 88.0, 62.0, 62.0, 61.0, 52.0, 52.0, 23.0])
    _finite(system, {"temperature": temperature, "stress": jnp.full(12, stress)}, 1.0)
    _finite(system, {"temperature": jnp.array([23.0, 78.0]), "stress": jnp.full(2, stress)}, 1.0)


@pytest.mark.slow
def test_derivatives_are_finite_at_end_stops_and_when_slack() -> None:
    arm = set_parameters(build("niti_table_3_1", "arm", "amplified_voltage"), {"upper_stop": 0.5})
    _finite(arm, {"voltage": jnp.concatenate([jnp.full(300, 8.0), jnp.zeros(100)])})
    weight = build("flexinol_table_3_2", "dead_weight", "voltage")
    slackening = {"voltage": jnp.concatenate([jnp.full(150, 12.0), jnp.zeros(150)])}
    run = simulate_compiled(weight, slackening, DT)
    _finite(weight, slackening)
    assert (np.asarray(run.stress) == 0.0).any(), "the case does not go slack any more"


@pytest.mark.slow  # one of the parameters above
def test_a_clipped_voltage_has_the_derivative_of_the_limit() -> None:
    """Beyond the amplifier's limit the end depends on the limit and not on the voltage; below it, the other way round."""
    weight = build("flexinol_table_3_2", "dead_weight", "voltage")

    @by_machine_code
    @partial(jax.grad, argnums=(0, 1))
    def slope(limit: jax.Array, volts: jax.Array) -> jax.Array:
        limited = set_parameters(weight, {"amplifier_limit": limit})
        return simulate(limited, {"voltage": jnp.full(60, volts)}, DT).temperature[-1]

    beyond = slope(jnp.asarray(5.0), jnp.asarray(8.0))
    below = slope(jnp.asarray(8.0), jnp.asarray(5.0))
    assert float(beyond[0]) > 0.0
    assert float(beyond[1]) == 0.0
    assert float(below[0]) == 0.0
    assert float(below[1]) == pytest.approx(float(beyond[0]), rel=1e-12)
    assert all(np.isfinite(float(value)) for value in slope(jnp.asarray(5.0), jnp.asarray(5.0)))


def test_derivatives_agree_with_differences_across_a_branch_change() -> None:
    """From a voltage that never reaches A_s' to one that transforms to the end: the derivative follows the path."""
    weight = build("flexinol_table_3_2", "dead_weight", "voltage")

    def end(volts: jax.Array) -> jax.Array:
        return 1e3 * simulate(weight, {"voltage": jnp.full(200, volts)}, DT).position.mean()

    def value_and_slope(_: None, own: dict[str, jax.Array]) -> tuple[jax.Array, jax.Array]:
        return jax.value_and_grad(end)(own["volts"])

    volts, step = np.linspace(6.3, 8.1, 61), 1e-5
    run = program(value_and_slope, None, ("volts",), engine="native")
    values, slopes = run(None, {"volts": np.concatenate([volts, volts + step, volts - step])}, 1)
    (value, ahead, behind), slope = np.split(values, 3), slopes[:61]
    assert np.isfinite(slope).all()
    difference = (ahead - behind) / (2 * step)
    close = np.abs(slope - difference) <= 1e-4 * np.abs(difference).max()
    assert close.mean() >= 0.95, "more than a kink or two disagree"
    # The derivative integrates to the value across the change of branch, so that nothing is lost at it.
    total = np.trapezoid(slope, volts)
    assert total == pytest.approx(value[-1] - value[0], rel=0.03)
    assert slope[0] < 0.1 * slope.max()


SECOND = {
    "arm": (_under("brinson", "niti_table_3_1", "arm", "amplified_voltage"), {"voltage": jnp.full(60, 6.5)}),
    # Both variants, so that the stress is the root of an equation of its own.
    "strain_coupon": (
        _under("brinson", "flexinol_table_3_2", "strain_coupon", "none"),
        {"temperature": jnp.full(40, 40.0), "strain": jnp.linspace(0.0, 0.02, 40)},
    ),
}


def _mean_stress(load: str) -> Callable[[jax.Array], jax.Array]:
    """Of shares of three moduli and slopes."""
    system, inputs = SECOND[load]
    names = ["young_modulus_austenite", "young_modulus_martensite", "stress_slope_austenite"]
    at = get_parameters(system, names)

    def mean(share: jax.Array) -> jax.Array:
        return simulate(set_vector(system, names, at * share), inputs, DT).stress.mean() / 1e8

    return mean


@pytest.mark.slow  # a filter's derivative, one of second order too, is in test_estimators
def test_a_second_derivative_along_a_line_agrees_with_differences() -> None:
    """A filter's gains are first derivatives, so its own derivative is a second one."""
    mean, along, step = _mean_stress("arm"), jnp.asarray([1.0, -0.7, 0.4]), 1e-5

    def slope(s: jax.Array | float) -> jax.Array:
        return jax.jvp(lambda t: mean(1.0 + t * along), (jnp.asarray(s),), (jnp.asarray(1.0),))[1]

    first = jax.jit(slope)
    second = jax.jit(lambda s: jax.jvp(slope, (s,), (jnp.asarray(1.0),))[1])(jnp.asarray(0.0))
    assert abs(second) > 1e-3
    np.testing.assert_allclose(second, (first(step) - first(-step)) / (2 * step), rtol=1e-5, atol=1e-7)


@pytest.mark.slow
def test_a_second_derivative_by_reverse_mode_agrees_with_differences() -> None:
    """Forward over reverse: where JAX computes what is known beforehand it goes through the solution, not by its rule."""
    system = _under("liang", "flexinol_table_3_2", "dead_weight", "voltage")
    names = ["convection_coefficient"]
    at, inputs = get_parameters(system, names), {"voltage": jnp.full(4, 7.0)}

    def shown(share: jax.Array) -> jax.Array:
        run = simulate(set_vector(system, names, at * share), inputs, DT)
        return run.temperature.sum() / 10.0 + run.stress.mean() / 1e8

    slope, step = by_machine_code(jax.grad(shown)), 1e-4
    found = by_machine_code(jax.jacfwd(jax.grad(shown)))(jnp.asarray(1.0))
    assert abs(found) > 1e-3
    np.testing.assert_allclose(
        found, (slope(jnp.asarray(1.0 + step)) - slope(jnp.asarray(1.0 - step))) / (2.0 * step), rtol=1e-6
    )


@pytest.mark.slow  # a minute to compile
@pytest.mark.parametrize("load", list(SECOND))
def test_second_derivatives_agree_with_differences(load: str) -> None:
    """All of them, forward over reverse."""
    mean, one, step = _mean_stress(load), jnp.ones(3), 1e-5
    second = np.asarray(jax.jit(jax.hessian(mean))(one))
    slope = jax.jit(jax.grad(mean))
    difference = np.stack([(slope(one + step * e) - slope(one - step * e)) / (2 * step) for e in np.eye(3)])
    assert np.abs(second).max() > 1e-3
    np.testing.assert_allclose(second, difference, rtol=1e-5, atol=1e-7)
