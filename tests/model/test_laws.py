"""The four kinetics laws, both renewals and both forms of the constitutive law on random paths and parameters."""

from __future__ import annotations

import itertools

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from smajax.core.parameters import get_parameters, set_parameters, set_vector
from smajax.model.presets import build
from smajax.model.system import System, initial_state
from smajax.model.wire.branch_amplitude import AsPrinted, Corrected
from smajax.model.wire.conditions import BrinsonAsPrinted
from smajax.model.wire.form import IntegratedForm, RateForm
from smajax.model.wire.kinetics import austenite_left, martensite_left
from smajax.model.wire.kinetics_terms import NO_TERMS
from smajax.model.wire.laws import LAWS
from smajax.model.wire.stiffness import Constant, Mixed, MixedConstantOmega
from smajax.simulation.compiled import simulate_compiled
from smajax.simulation.simulate import simulate
from tests.helpers.driven_coupon import COUPON, EACH, driven, path, under
from tests.helpers.machine_code import by_machine_code
from tests.helpers.often import often

NAMES = sorted(LAWS)
RENEWALS = {"corrected": Corrected, "printed": AsPrinted}
STRAINED = build("flexinol_table_3_2", "strain_coupon", "none")
TEMPERATURES = st.lists(st.floats(10.0, 130.0), min_size=7, max_size=7)
STRESSES = st.lists(st.floats(0.0, 500e6), min_size=7, max_size=7)
WIRES = st.fixed_dictionaries(
    {
        "austenite_start": st.floats(55.0, 75.0),
        "austenite_finish": st.floats(76.0, 100.0),
        "martensite_start": st.floats(40.0, 54.0),
        "martensite_finish": st.floats(10.0, 39.0),
        "stress_slope_austenite": st.floats(4e6, 15e6),
        "stress_slope_martensite": st.floats(4e6, 15e6),
    }
)


@pytest.mark.parametrize(
    ("renewal", "law"),
    often(
        itertools.product(RENEWALS, NAMES),
        [("corrected", "enhanced"), ("corrected", "tanaka"), ("printed", "brinson"), ("printed", "liang")],
    ),
)
@settings(max_examples=25, deadline=None)
@given(temperature=TEMPERATURES, stress=STRESSES, wire=WIRES, start=st.floats(0.0, 1.0))
def test_fractions_stay_in_range_and_follow_their_branch(
    law: str, renewal: str, temperature: list[float], stress: list[float], wire: dict[str, float], start: float
) -> None:
    system = set_parameters(under(COUPON, law, renewal=RENEWALS[renewal]()), {**wire, "start_fraction": start})
    run = driven(system, temperature, stress)
    xi, part = np.asarray(run.martensite_fraction), np.asarray(run.detwinned_fraction)
    assert np.isfinite(run.strain).all()
    assert xi.min() >= -1e-12
    assert xi.max() <= 1.0 + 1e-12
    assert part.min() >= -1e-12
    assert np.all(part <= xi + 1e-12)
    # Less martensite only where the austenite drive rose or the temperature did, more only the other way.
    y_a = run.temperature - run.stress / wire["stress_slope_austenite"]
    y_m = run.temperature - run.stress / wire["stress_slope_martensite"]
    change = np.diff(xi)
    assert np.all(np.diff(y_a)[change < -1e-12] > 0.0)
    assert np.all(np.diff(y_m)[change > 1e-12] < 0.0)


@settings(max_examples=25, deadline=None)
@given(
    inner=st.lists(st.floats(0.05, 0.95), min_size=2, max_size=2),
    middle=st.floats(0.1, 0.9),
)
@pytest.mark.parametrize("law", NAMES)
def test_minor_loops_stay_inside_the_major_one_and_close(law: str, inner: list[float], middle: float) -> None:
    """Partial heating and cooling, nested, at constant stress."""
    system = under(COUPON, law)
    shift = 100e6 / 6.89e6
    heat = lambda share: 68.0 + shift + 10.0 * share  # noqa: E731
    cool = lambda share: 42.0 + shift + 10.0 * share  # noqa: E731
    low, high = cool(min(inner)), heat(max(inner))
    path = [20.0, high, low, heat(middle), cool(middle), high, low, high, 130.0, 20.0]
    run = driven(system, path, [100e6] * len(path))
    xi = np.asarray(run.martensite_fraction)
    at = run.temperature, jnp.asarray(100e6)
    upper = np.asarray(martensite_left(system.wire.kinetics, NO_TERMS, *at))
    lower = 1.0 - np.asarray(austenite_left(system.wire.kinetics, NO_TERMS, *at))
    n = EACH
    assert np.all(xi <= upper + 1e-9)
    assert np.all(xi >= lower - 1e-9)
    if law != "tanaka":
        assert xi[8 * n] < 1e-9
        assert abs(xi[-1] - 1.0) < 1e-9


@pytest.mark.parametrize("law", NAMES)
def test_a_repeated_minor_loop_closes(law: str) -> None:
    """Between two temperatures that each touch one range the fraction comes back to the same two values."""
    system = under(COUPON, law)
    path = [20.0, 88.0] + [62.0, 88.0] * 12
    run = driven(system, path, [100e6] * len(path))
    turns = np.asarray(run.martensite_fraction)[::EACH]
    hot, cold = turns[1::2], turns[2::2]
    assert abs(hot[-1] - hot[-2]) < 1e-3
    assert abs(cold[-1] - cold[-2]) < 1e-3
    assert cold[-1] > hot[-1] + 0.05


@settings(max_examples=20, deadline=None)
@given(
    temperature=TEMPERATURES,
    stress=STRESSES,
    law=st.sampled_from(NAMES),
    stiffness=st.sampled_from([Mixed(), MixedConstantOmega(), Constant()]),
)
def test_integrated_form_is_a_function_of_state(
    temperature: list[float], stress: list[float], law: str, stiffness: object
) -> None:
    """sigma = E(xi) (strain - strain_0 + Omega/E xi_s) + theta_T (T - T_0) at every stored sample."""
    system = under(COUPON, law, form=IntegratedForm(), stiffness=stiffness)
    run = driven(system, temperature, stress)
    c = system.wire.constitutive
    e_a, e_m, eps_l = c.young_modulus_austenite, c.young_modulus_martensite, c.recoverable_strain
    xi = run.martensite_fraction
    modulus = c.stiffness.young_modulus(e_a, e_m, xi)
    own = run.strain - c.stiffness.transformation_strain(e_a, e_m, eps_l, xi) * run.detwinned_fraction
    thermal = c.thermal_modulus * (run.temperature - system.wire.heat.ambient_temperature)
    offset = own - (run.stress - thermal) / modulus
    np.testing.assert_allclose(offset, offset[0], rtol=0.0, atol=1e-14)


@pytest.mark.slow  # each is held to scipy in `test_law_reference`
@settings(max_examples=20, deadline=None)
@given(temperature=TEMPERATURES, stress=STRESSES, law=st.sampled_from(NAMES))
def test_rate_and_integrated_form_agree_where_e_is_constant(
    temperature: list[float], stress: list[float], law: str
) -> None:
    rate, integrated = (
        driven(under(COUPON, law, form=form, stiffness=Constant()), temperature, stress)
        for form in (RateForm(), IntegratedForm())
    )
    assert float(np.abs(rate.strain - integrated.strain).max()) < 1e-6 * 0.046


def test_rate_form_with_mixed_e_does_not_close_and_integrated_form_does() -> None:
    """Why the two forms cannot agree with E(xi): the rate form depends on the path."""
    left = {}
    for form in (RateForm(), IntegratedForm()):
        system = set_parameters(under(COUPON, form=form), {"start_fraction": 0.0})
        run = driven(system, [95.0, 95.0, 95.0], [0.0, 450e6, 0.0])
        assert run.martensite_fraction[-1] == 0.0
        left[type(form)] = float(run.strain[-1])
    assert abs(left[IntegratedForm]) < 1e-12
    assert left[RateForm] == pytest.approx(-0.0040, abs=5e-4)


@settings(max_examples=25, deadline=None)
@given(at=st.floats(15.0, 110.0), top=st.floats(0.005, 0.07), law=st.sampled_from(NAMES))
def test_work_of_a_closed_stress_strain_cycle_is_not_negative(at: float, top: float, law: str) -> None:
    """Isothermal cycles of strain from the unloaded wire and back to zero stress, integrated form."""
    system = under(STRAINED, law, form=IntegratedForm())
    system = set_parameters(system, {"start_fraction": 1.0 if at < 60.0 else 0.0})
    strain = np.concatenate([np.linspace(0.0, top, 200), np.linspace(top, 0.0, 200)])
    run = simulate_compiled(system, {"temperature": jnp.full(400, at), "strain": jnp.asarray(strain)}, 1.0)
    assert np.isfinite(run.stress).all()
    assert np.trapezoid(run.stress, strain) >= -1e-3 * float(run.stress.max()) * top


@pytest.mark.slow  # both are held to scipy in `test_law_reference`
@settings(max_examples=12, deadline=None)
@given(temperature=TEMPERATURES, stress=STRESSES, law=st.sampled_from(NAMES))
def test_strain_coupon_inverts_the_stress_coupon(temperature: list[float], stress: list[float], law: str) -> None:
    """The strain that a stress path gives, prescribed, gives back the stress path (while the wire is taut)."""
    stress = [0.0, *(20e6 + value for value in stress[1:])]
    temperature = [temperature[0], temperature[0], *temperature[2:]]
    there = driven(under(COUPON, law), temperature, stress)
    back = simulate_compiled(
        under(STRAINED, law), {"temperature": jnp.asarray(path(temperature)), "strain": there.strain}, 1.0
    )
    np.testing.assert_allclose(back.martensite_fraction, there.martensite_fraction, atol=1e-5)
    np.testing.assert_allclose(back.stress, there.stress, atol=2e4)


@settings(max_examples=12, deadline=None)
@given(
    temperature=TEMPERATURES,
    strain=st.lists(st.floats(-0.02, 0.06), min_size=7, max_size=7),
    law=st.sampled_from(NAMES),
)
def test_a_strained_wire_that_goes_slack_comes_back_on_its_law(
    temperature: list[float], strain: list[float], law: str
) -> None:
    """Free or held shorter than it is the wire carries nothing and transforms on; taut it obeys sigma = E (...)."""
    system = under(STRAINED, law, form=IntegratedForm(), stiffness=Mixed())
    held = np.concatenate([np.zeros(1), path(strain)])
    heat = np.concatenate([[23.0], path(temperature)])
    run = simulate_compiled(system, {"temperature": jnp.asarray(heat), "strain": jnp.asarray(held)}, 1.0)
    xi, stress = np.asarray(run.martensite_fraction), np.asarray(run.stress)
    assert np.isfinite(stress).all()
    assert stress.min() >= 0.0
    assert xi.min() >= 0.0
    assert xi.max() <= 1.0
    slack = stress <= 0.0
    # The wire's own strain is at least the one it is held at, and that one where it is taut.
    assert np.all(np.asarray(run.strain) >= held - 1e-9)
    np.testing.assert_allclose(np.asarray(run.strain)[~slack], held[~slack], rtol=0.0, atol=1e-9)
    c = system.wire.constitutive
    modulus = c.stiffness.young_modulus(c.young_modulus_austenite, c.young_modulus_martensite, run.martensite_fraction)
    own = np.asarray(run.strain) - float(c.recoverable_strain) * np.asarray(run.detwinned_fraction)
    thermal = float(c.thermal_modulus) * (heat - float(system.wire.heat.ambient_temperature))
    offset = own - (stress - thermal) / modulus
    np.testing.assert_allclose(offset, offset[0], rtol=0.0, atol=1e-9)


@pytest.mark.slow  # by machine code in `test_batch` and `test_engine`
@pytest.mark.parametrize("rig", [pytest.param("arm", marks=pytest.mark.slow), "dead_weight"])
def test_a_run_in_a_batch_is_the_run_alone(rig: str) -> None:
    """Voltage, a parameter of each part and the start differ from lane to lane; the other lanes must not be felt."""
    wire = "niti_table_3_1" if rig == "arm" else "flexinol_table_3_2"
    system = build(wire, rig, "amplified_voltage")
    names = [
        "convection_coefficient",
        "stress_slope_austenite",
        "young_modulus_martensite",
        "damping",
        "amplifier_gain",
    ]
    at = get_parameters(system, names)
    rows = at * jnp.asarray(np.random.default_rng(3).uniform(0.8, 1.25, (8, len(names))))
    volts = jnp.linspace(2.0, 12.0, 8)[:, None] * jnp.where(jnp.arange(301) < 200, 1.0, 0.3)
    one = eqx.filter_jit(lambda row, volt: simulate(set_vector(system, names, row), {"voltage": volt}, 0.02))
    many = eqx.filter_jit(jax.vmap(one))(rows, volts)
    for lane in range(8):
        alone = one(rows[lane], volts[lane])
        np.testing.assert_allclose(many.position[lane], alone.position, rtol=0.0, atol=1e-8)
        np.testing.assert_allclose(many.martensite_fraction[lane], alone.martensite_fraction, rtol=0.0, atol=1e-8)


def test_conditions_as_table_3_3_prints_them_transform_nothing_under_a_constant_load() -> None:
    run = driven(under(COUPON, conditions=BrinsonAsPrinted()), [20.0, 130.0, 20.0], [100e6] * 3)
    assert np.all(np.asarray(run.martensite_fraction) == 1.0)


@pytest.mark.parametrize(
    ("law", "rig"),
    often(
        itertools.product(NAMES, ["arm", "dead_weight"]),
        [("tanaka", "arm"), ("brinson", "dead_weight"), ("enhanced", "dead_weight"), ("liang", "dead_weight")],
    ),
)
def test_zero_voltage_rests_for_a_thousand_seconds(rig: str, law: str) -> None:
    wire = "niti_table_3_1" if rig == "arm" else "flexinol_table_3_2"
    run = simulate_compiled(under(build(wire, rig, "voltage"), law), {"voltage": jnp.zeros(2_001)}, 0.5)
    ambient = 20.0 if rig == "arm" else 23.0
    assert float(np.abs(run.temperature - ambient).max()) < 1e-9
    assert float(np.abs(run.position - run.position[0]).max()) < 1e-12
    assert np.all(np.asarray(run.martensite_fraction) == 1.0)


@pytest.mark.slow  # of more wires in `test_honest_numbers`
@settings(max_examples=8, deadline=None)
@given(levels=st.lists(st.floats(0.0, 12.0), min_size=4, max_size=4), law=st.sampled_from(NAMES))
def test_no_wire_cools_below_the_ambient_temperature(levels: list[float], law: str) -> None:
    system = under(build("flexinol_table_3_2", "dead_weight", "voltage"), law)
    volts = jnp.repeat(jnp.asarray(levels), 100)
    assert float(simulate_compiled(system, {"voltage": volts}, 0.02).temperature.min()) >= 23.0 - 1e-9


@pytest.mark.parametrize("chunks", [2, pytest.param(20, marks=pytest.mark.slow)])
def test_nothing_drifts_in_a_million_steps(chunks: int) -> None:
    """Taut states satisfy the integrated law to 1e-8 of their stress after 10^5 (slow: 10^6) steps to and fro."""
    system = under(build("flexinol_table_3_2", "dead_weight", "voltage"), form=IntegratedForm())
    chunk = jnp.tile(jnp.concatenate([jnp.full(500, 7.0), jnp.full(500, 0.0)]), 50)

    @by_machine_code
    def carried_on(system: System, volts: jax.Array):
        from smajax.simulation.step import step

        def body(state, volt):
            new = step(system, state, {"voltage": volt}, 0.01)
            return new, None

        state = initial_state(system, {"voltage": volts[0]})
        state, _ = jax.lax.scan(
            lambda state, _: (jax.lax.scan(body, state, volts)[0], None), state, None, length=chunks
        )
        return state, simulate(system, {"voltage": volts[:2001]}, 0.01, state)

    state, run = carried_on(system, chunk)
    assert len(chunk) * chunks == 50_000 * chunks
    assert float(state.time) == pytest.approx(500.0 * chunks)
    c = system.wire.constitutive
    xi = run.martensite_fraction
    modulus = c.young_modulus_austenite + xi * (c.young_modulus_martensite - c.young_modulus_austenite)
    start = 0.075 * 9.81 / (0.25 * np.pi * 150e-6**2)
    counted = start / 28e9 + float(c.recoverable_strain)  # the strain at the start, where it is counted as zero
    law = modulus * (run.strain + counted - c.recoverable_strain * xi) + c.thermal_modulus * (run.temperature - 23.0)
    taut = np.asarray(run.stress) > 0.0
    assert taut.mean() > 0.9
    np.testing.assert_allclose(np.asarray(law)[taut], np.asarray(run.stress)[taut], rtol=1e-8, atol=1e-8 * start)
    geometric = -np.asarray(run.position) / 0.537
    np.testing.assert_allclose(np.asarray(run.strain)[taut], geometric[taut], rtol=0.0, atol=1e-9)
