"""Effects of the circuit and of the recorded command against closed forms, and where they apply."""

from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.integrate import solve_ivp

from smajax.core.parameters import set_parameters
from smajax.data.model_catalogue import applicable, candidates
from smajax.model.effects.candidate import Extent
from smajax.model.effects.library import LIBRARY
from smajax.model.extended import extended
from smajax.model.presets import build
from smajax.model.wire.heat import mass_per_metre
from smajax.simulation.compiled import simulate_compiled
from tests.helpers.effect_rigs import DT, RIGS, heat_lost, resistance, settled
from tests.helpers.often import often


def test_leads_leave_the_wire_the_power_of_a_divided_voltage() -> None:
    volts, lead = 8.0, 3.0
    system, end = settled("lead_resistance", {"resistance": lead}, voltage=volts)
    own = resistance(system, end.martensite_fraction)
    power = (volts / (own + lead)) ** 2 * own / float(system.wire.wire_length)
    assert heat_lost(system, end.temperature) == pytest.approx(power, rel=1e-6)


def test_a_resistance_that_rises_with_temperature_settles_where_loss_is_power() -> None:
    volts, alpha = 8.0, 1e-3
    system, end = settled("temperature_resistance", {"coefficient": alpha}, voltage=volts)
    own = resistance(system, end.martensite_fraction) * (1.0 + alpha * (end.temperature - 20.0))
    power = volts**2 / own / float(system.wire.wire_length)
    assert heat_lost(system, end.temperature) == pytest.approx(power, rel=1e-6)


def test_a_supply_with_a_memory_agrees_with_its_circuit_integrated_by_scipy() -> None:
    """Against scipy on the same circuit with the wire's own resistance, which is constant here; at rest a plain divider."""
    volts, inner, tau, dt = 8.0, 2.0, 1.5, 0.02
    system = RIGS["dead_weight"][0]
    law = system.wire.resistance
    same = set_parameters(system, {"resistivity_austenite": float(law.resistivity_martensite)})
    own, length = resistance(same, 1.0), float(same.wire.wire_length)
    on = {"supply_memory.resistance": inner, "supply_memory.time_constant": tau}
    voltage = volts * np.where(np.arange(1001) < 700, 1.0, 0.3)
    run = simulate_compiled(extended(same, ("supply_memory",), on), {"voltage": jnp.asarray(voltage)}, dt)
    heat, ambient = same.wire.heat, float(same.wire.heat.ambient_temperature)
    stored = float(mass_per_metre(same.wire) * heat.specific_heat)

    def rates(_: float, y: np.ndarray, level: float) -> list[float]:
        current = (level - inner * y[0]) / own
        return [(current - y[0]) / tau, (current**2 * own / length - heat_lost(same, y[1])) / stored]

    y, warm = np.array([0.0, ambient]), [ambient]
    for level in voltage[:-1]:
        y = solve_ivp(rates, (0.0, dt), y, args=(level,), rtol=1e-9, atol=1e-9).y[:, -1]
        warm.append(y[1])
    plain = simulate_compiled(same, {"voltage": jnp.asarray(voltage)}, dt)
    assert np.ptp(np.asarray(plain.temperature) - np.asarray(warm)) > 5.0
    np.testing.assert_allclose(run.temperature, warm, atol=2e-4 * np.ptp(warm))
    _, end = settled("supply_memory", {"resistance": inner, "time_constant": tau}, voltage=volts)
    whole = resistance(system, end.martensite_fraction)
    power = (volts / (whole + inner)) ** 2 * whole / float(system.wire.wire_length)
    assert heat_lost(system, end.temperature) == pytest.approx(power, rel=1e-6)


@pytest.mark.parametrize("volts", [0.0, 1e-215, 1e-6, 0.5])
def test_a_supply_with_a_memory_gives_no_power_below_its_voltage_drop(volts: float) -> None:
    """Below what it has lost it gives nothing, and the wire gives nothing back."""
    system = extended(
        RIGS["dead_weight"][0],
        ("supply_memory",),
        {"supply_memory.resistance": 10.0, "supply_memory.time_constant": 20.0},
    )
    voltage = np.concatenate([np.full(200, 8.0), np.full(100, volts), np.full(20, 8.0)])
    end = simulate_compiled(system, {"voltage": jnp.asarray(voltage)}, 0.1).temperature[-1]
    off = simulate_compiled(system, {"voltage": jnp.asarray(np.where(voltage == 8.0, 8.0, 0.0))}, 0.1).temperature[-1]
    assert float(end) == pytest.approx(float(off), abs=1e-3)


def test_a_supply_with_a_memory_gives_pulses_their_mean_current() -> None:
    duty, inner = 0.3, 2.0
    system, end = settled("supply_memory", {"resistance": inner, "time_constant": 1.0}, "bias_spring", 300, duty=duty)
    own, volts = resistance(system, end.martensite_fraction), float(RIGS["bias_spring"][0].drive.supply_voltage)
    on = volts / (own + duty * inner)  # the drop is that of the mean current
    power = duty * on**2 * own / float(system.wire.wire_length)
    assert heat_lost(system, end.temperature) == pytest.approx(power, rel=1e-6)


def test_pulses_recorded_as_their_mean_heat_by_their_mean_square() -> None:
    """Pulses of 12 V, 40 % of whose variance reaches the wire: but for one factor those of 10 V with another share."""
    supply, left = 12.0, 0.4
    share = supply * left / (supply * left + 10.0 * (1.0 - left))
    factors = []
    for volts in (3.0, 6.0):
        system, end = settled("pulsed_voltage", {"share": share}, voltage=volts)
        power = heat_lost(system, end.temperature) * float(system.wire.wire_length)
        factors.append(
            power * resistance(system, end.martensite_fraction) / (volts**2 + left * volts * (supply - volts))
        )
    assert factors == pytest.approx([(1.0 - share) / (1.0 - left)] * 2, rel=1e-6)


def test_a_sagging_supply_gives_less_than_its_largest_current() -> None:
    volts, sag = 8.0, 0.4
    system, end = settled("supply_sag", {"sag": sag}, voltage=volts)
    own = resistance(system, end.martensite_fraction)
    current = volts / own / (1.0 + sag * volts / own)
    power = current**2 * own / float(system.wire.wire_length)
    assert heat_lost(system, end.temperature) == pytest.approx(power, rel=1e-6)


WITHOUT = [("current", "lead_resistance", 0.3), ("power", "supply_sag", 1.5)]


@pytest.mark.parametrize(("drive", "without", "value"), often(WITHOUT, WITHOUT[:1]))
def test_an_effect_that_a_drive_cannot_show_changes_nothing_if_it_is_put_in(
    drive: str, without: str, value: float
) -> None:
    system = build("flexinol_table_3_2", "dead_weight", drive)
    inputs = {drive: jnp.where(jnp.arange(200) < 120, value, 0.0)}
    plain = simulate_compiled(system, inputs, DT)
    starts = {f"{without}.{name}": size for name, size in LIBRARY[without].candidate.initial_guess.items()}
    same = simulate_compiled(extended(system, (without,), starts), inputs, DT)
    np.testing.assert_allclose(same.temperature, plain.temperature, rtol=1e-12)
    assert np.ptp(plain.temperature) > 20.0


def test_where_a_drive_cannot_show_an_effect_it_is_no_candidate() -> None:
    for drive, without, _ in WITHOUT:
        system = build("flexinol_table_3_2", "dead_weight", drive)
        assert without not in candidates(system, None, ())
        assert "input_level" in candidates(system, None, ())
    names = candidates(build("flexinol_isobaric", "coupon", "none"), None, ())
    assert not {"input_level", "slack"} & set(names)
    assert {"input_delay", "input_clock", "creep"} <= set(names)
    untimed = candidates(build("flexinol_isobaric", "coupon", "none"), None, (), clocked=False)
    assert not {"input_delay", "input_clock", "creep", "sensor_drift", "sensor_lag"} & set(untimed)
    assert {"two_part_transformation", "residual_strain", "sensor_gain"} <= set(untimed)
    assert "transformation_curve" in set(names) & set(untimed)
    assert "transformation_curve" not in applicable(build("flexinol_isobaric", "coupon", "none", "tanaka"))
    assert "pwm_smoothing" not in candidates(RIGS["dead_weight"][0], None, ())
    assert "nonlinear_spring" not in candidates(RIGS["dead_weight"][0], None, ())
    assert {"pwm_smoothing", "nonlinear_spring"} <= set(candidates(RIGS["bias_spring"][0], None, ()))


def test_pulses_smoothed_throughout_heat_by_the_square_of_the_duty() -> None:
    smooth, hard = (
        settled("pwm_smoothing", {"share": share}, "bias_spring", duty=duty)[1]
        for share, duty in ((1.0, 0.3), (0.0, 0.09))
    )
    assert smooth.temperature == pytest.approx(hard.temperature, rel=1e-9)


def test_a_dead_zone_passes_almost_nothing_below_its_threshold() -> None:
    zone = LIBRARY["dead_zone"](threshold=0.1)
    assert abs(float(zone.command("voltage", jnp.asarray(1e-3)))) < 1e-5
    assert float(zone.command("voltage", jnp.asarray(-20.0))) == pytest.approx(-19.9, abs=1e-3)
    slope = jax.grad(lambda limit: LIBRARY["dead_zone"](threshold=limit).command("duty", jnp.asarray(0.0)))
    assert float(slope(jnp.asarray(0.0))) == 0.0


def test_a_saturation_passes_small_commands_and_loses_a_share_of_what_is_beyond_its_limit() -> None:
    clipping = LIBRARY["amplifier_saturation"](lost=1.0, limit=6.0, softness=0.02)

    def passed(value: float) -> float:
        return float(clipping.command("voltage", jnp.asarray(value)))

    assert passed(3.0) == pytest.approx(3.0, abs=0.01)
    assert passed(9.0) == pytest.approx(6.0, abs=0.01)
    assert passed(-9.0) == -passed(9.0)
    assert passed(0.0) == 0.0
    half = LIBRARY["amplifier_saturation"](lost=0.5, limit=6.0, softness=0.02)
    assert float(half.command("voltage", jnp.asarray(9.0))) == pytest.approx(7.5, abs=0.01)
    # However soft, more of the command never gives less.
    for softness in (0.01, 0.3, 3.0):
        soft = LIBRARY["amplifier_saturation"](lost=1.0, limit=6.0, softness=softness)
        assert np.all(np.diff(np.asarray(soft.command("voltage", jnp.linspace(0.0, 20.0, 400)))) >= 0.0)


def test_a_saturation_is_sought_below_the_largest_command_of_the_runs() -> None:
    bounds = LIBRARY["amplifier_saturation"].candidate.bounds
    assert bounds(Extent(20.0, 1e-3, 0.0, command=10.0)) == {"limit": (1.0, 12.0)}
    assert bounds(Extent(20.0, 1e-3, 0.0)) == {}  # an oven has no command
    grid = LIBRARY["amplifier_saturation"].candidate.grid(Extent(20.0, 1e-3, 0.0, command=10.0))
    assert [place["limit"] for place in grid] == [5.0, 7.0, 8.5]
