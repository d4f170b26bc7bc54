"""Effects of the heat balance against closed forms."""

from __future__ import annotations

import warnings

import jax.numpy as jnp
import numpy as np
import pytest
from scipy.linalg import expm

from smajax.model.effects.end_conduction import DEPTH, EndConduction
from smajax.model.extended import extended
from smajax.model.wire.heat import mass_per_metre
from smajax.simulation.compiled import simulate_compiled
from tests.helpers.effect_rigs import DT, RIGS, heat_lost, resistance, settled


def test_a_draught_cools_from_its_time_on() -> None:
    draught = {"draught.change": 0.5, "draught.time": 20.0, "draught.width": 0.1}
    system = extended(RIGS["dead_weight"][0], ("draught",), draught)
    run = simulate_compiled(system, {"voltage": jnp.full(801, 5.0)}, DT)
    calm, blown = (heat_lost(system, float(run.temperature[at])) for at in (360, 800))
    # Martensite all the time, so that the power is the same: the loss is it in both cases.
    assert run.martensite_fraction.min() > 0.999
    assert 1.5 * blown == pytest.approx(calm, rel=1e-6)


def test_surroundings_warm_up_a_time_constant_late_and_keep_the_wire_warm() -> None:
    """Against the closed form of the two heat balances, which are linear while the wire stays martensite."""
    system = RIGS["dead_weight"][0]
    share, tau, volts, dt = 0.4, 8.0, 2.0, 0.02
    on = {"warmed_surroundings.share": share, "warmed_surroundings.time_constant": tau}
    heated = jnp.arange(4001) < 2000
    run = simulate_compiled(
        extended(system, ("warmed_surroundings",), on), {"voltage": jnp.where(heated, volts, 0.0)}, dt
    )
    assert run.martensite_fraction.min() > 0.999
    wire = system.wire
    air, temperature = float(wire.heat.ambient_temperature), np.asarray(run.temperature)
    m_c = float(mass_per_metre(wire) * wire.heat.specific_heat)
    loss = float(heat_lost(system, air + 1.0) - heat_lost(system, air))
    rate = np.asarray(
        [[-loss / m_c, share * loss / m_c], [1.0 / tau, -1.0 / tau]]
    )  # of the excesses of wire and late temperature
    power = np.asarray([volts**2 / float(resistance(system, 1.0)) / float(wire.wire_length) / m_c, 0.0])
    excess = np.zeros(2)
    expected = [0.0]
    one = expm(rate * dt)
    for on_now in np.asarray(heated)[:-1]:
        rest = np.linalg.solve(-rate, power) if on_now else np.zeros(2)
        excess = rest + one @ (excess - rest)
        expected.append(float(excess[0]))
    assert temperature - air == pytest.approx(np.asarray(expected), rel=1e-3, abs=2e-3)
    # In the end, to e^-3.7 of the slower balance, the wire is hotter by 1/(1 - w) than in air that stays cool.
    assert temperature[1999] - air == pytest.approx(power[0] * m_c / loss / (1.0 - share), rel=0.03)


def test_a_specific_heat_by_phase_changes_the_time_and_not_the_end_state() -> None:
    plain, other = (settled("phase_specific_heat", {"contrast": a}, voltage=8.0)[1] for a in (0.0, 0.3))
    assert plain.martensite_fraction < 1e-6
    assert other.temperature == pytest.approx(plain.temperature, rel=1e-6)
    # All austenite, cooled from there: the time constant m c_p/(h_c pi d) is longer by the contrast.
    system = RIGS["dead_weight"][0]
    inputs = {"voltage": jnp.where(jnp.arange(1001) < 600, 8.0, 0.0)}
    rates = []
    for a in (0.0, 0.3):
        run = simulate_compiled(
            extended(system, ("phase_specific_heat",), {"phase_specific_heat.contrast": a}), inputs, 0.02
        )
        assert run.martensite_fraction[604] < 1e-6
        rates.append(np.log((run.temperature[604] - 23.0) / (run.temperature[600] - 23.0)))
    assert rates[0] / rates[1] == pytest.approx(1.3, rel=1e-3)


@pytest.mark.parametrize(("contrast", "share", "counted"), [(0.3, 0.0, 0.0), (0.3, 1.0, 1.0), (0.9, 1.0, 1.0 / 3.0)])
def test_the_latent_heat_is_constant_or_follows_kirchhoff(contrast: float, share: float, counted: float) -> None:
    """Heat put in over a transformation: that of the phases' specific heats on the way, and k times Kirchhoff's change, of a contrast beyond 0.3 that of 0.3."""
    system = RIGS["dead_weight"][0]
    on = {"phase_specific_heat.contrast": contrast, "phase_specific_heat.kirchhoff": share}
    dt, volts = 2e-3, 8.0
    run = simulate_compiled(
        extended(system, ("phase_specific_heat",), on), {"voltage": jnp.full(round(20.0 / dt) + 1, volts)}, dt
    )
    wire = system.wire
    assert run.martensite_fraction[-1] < 1e-6
    temperature, fraction = np.asarray(run.temperature), np.asarray(run.martensite_fraction)
    power = volts**2 / resistance(system, fraction) / float(wire.wire_length)
    given = float(np.trapezoid(power - heat_lost(system, temperature), dx=dt))
    m_c = float(mass_per_metre(wire) * wire.heat.specific_heat)
    law = wire.kinetics
    neutral = 0.5 * float(law.martensite_start + law.austenite_finish)
    own = m_c * np.trapezoid(1.0 + contrast * (1.0 - fraction), temperature)
    change = -contrast * m_c * np.trapezoid(temperature - neutral, fraction)
    assert abs(change) > 0.01 * own
    assert given == pytest.approx(own + counted * change, rel=1e-3)


@pytest.mark.parametrize(("contrast", "share"), [(1.0, 0.0), (0.6, 1.0), (-0.3, 0.0)])
def test_a_large_contrast_is_no_jump_on_heating_and_on_cooling(contrast: float, share: float) -> None:
    system = RIGS["dead_weight"][0]
    on = {"phase_specific_heat.contrast": contrast, "phase_specific_heat.kirchhoff": share}
    runs = {}
    for dt in (2.5e-4, 2e-3):
        volts = jnp.where(jnp.arange(round(8.0 / dt) + 1) * dt < 4.0, 9.0, 0.0)
        with warnings.catch_warnings():
            warnings.simplefilter("error")  # of steps that do not converge
            run = simulate_compiled(extended(system, ("phase_specific_heat",), on), {"voltage": volts}, dt)
        runs[dt] = np.asarray(run.martensite_fraction)[:: round(2e-3 / dt)]
    fine, coarse = runs.values()
    assert fine.min() < 0.01
    assert np.abs(np.diff(fine)).max() < 0.05
    np.testing.assert_allclose(coarse, fine, atol=0.01)


def test_heat_lost_to_the_ends_is_that_of_a_fin() -> None:
    """Pieces of the two zones against the fin's own profile: the mean austenite of a wire whose pieces switch at z = 1/2."""
    half = 30.0  # mu l_0/2
    share = DEPTH / half
    effect = EndConduction(share=share, above_air_heating=5.0, above_air_cooling=3.0)
    for z in (2.0, 4.0, 8.0, 15.0):
        s = np.linspace(0.0, half, 200_001)
        own = (z + 5.0) * (1.0 - np.cosh(s) / np.cosh(half)) - 5.0
        exact = float(np.mean(1.0 / (1.0 + np.exp(np.clip(2.0 * np.pi * (own - 0.5), -700, 700)))))
        found = float(effect.heating_shape(jnp.asarray(z), jnp.zeros(())))
        # Four pieces: within a piece of the exact mean.
        assert abs(found - exact) < share / 4
        assert found > 0.0
