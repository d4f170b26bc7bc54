"""Effects of heat, circuit, mechanics and input against closed forms, and where they apply."""

from __future__ import annotations

from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.integrate import solve_ivp

from smajax.control.closed_loop import simulate_closed_loop
from smajax.control.presets import CONTROLLERS
from smajax.core.parameters import set_parameters
from smajax.data.model_catalogue import candidates
from smajax.model.drive.inputs import switched
from smajax.model.effects.end_conduction import DEPTH, EndConduction
from smajax.model.effects.library import LIBRARY
from smajax.model.extended import extended
from smajax.model.load.friction import PRESLIDING
from smajax.model.presets import build
from smajax.model.rigs import arm
from smajax.model.system import System, initial_state
from smajax.model.wire.heat import mass_per_metre
from smajax.simulation.batch.axes import grid
from smajax.simulation.batch.run_batch import run_batch
from smajax.simulation.compiled import simulate_compiled
from smajax.simulation.input_delay import acting_inputs

DT = 0.05
RIGS = {
    "dead_weight": (build("flexinol_table_3_2", "dead_weight", "voltage"), "voltage", 7.4),
    "bias_spring": (build("flexinol_ht_500um", "bias_spring", "duty"), "duty", 0.35),
}


def _inputs(channel: str, top: float) -> dict[str, jax.Array]:
    shares = [jnp.full(120, 1.0), jnp.full(60, 0.6), jnp.full(60, 0.95), jnp.full(120, 0.0)]
    return {channel: top * jnp.concatenate(shares)}


def _lost(system: System, temperature: float) -> float:
    """h_c A_c (T - T_inf), W/m: what keeps the wire at `temperature`."""
    heat = system.wire.heat
    surface = np.pi * float(system.wire.wire_diameter)
    return float(heat.convection_coefficient) * surface * (temperature - float(heat.ambient_temperature))


def _settled(
    effect: str, values: dict[str, float], rig: str = "dead_weight", seconds: int = 60, **held: float
) -> tuple[System, Any]:
    """(system, its state at the end) after a while with inputs held, from cold."""
    system = RIGS[rig][0]
    full = extended(system, (effect,), {f"{effect}.{name}": value for name, value in values.items()})
    run = simulate_compiled(full, {name: jnp.full(10 * seconds + 1, value) for name, value in held.items()}, 0.1)
    return full, jax.tree.map(lambda series: float(series[-1]), run)


def _ohms(system: System, fraction: float) -> float:
    law, area = system.wire.resistance, 0.25 * np.pi * float(system.wire.wire_diameter) ** 2
    resistivity = (1.0 - fraction) * float(law.resistivity_austenite) + fraction * float(law.resistivity_martensite)
    return resistivity / area * float(system.wire.wire_length)


def test_leads_leave_the_wire_the_power_of_a_divided_voltage() -> None:
    volts, lead = 8.0, 3.0
    system, end = _settled("lead_resistance", {"resistance": lead}, voltage=volts)
    own = _ohms(system, end.martensite_fraction)
    power = (volts / (own + lead)) ** 2 * own / float(system.wire.wire_length)
    assert _lost(system, end.temperature) == pytest.approx(power, rel=1e-6)


def test_a_resistance_that_rises_with_temperature_settles_where_loss_is_power() -> None:
    volts, alpha = 8.0, 1e-3
    system, end = _settled("temperature_resistance", {"coefficient": alpha}, voltage=volts)
    own = _ohms(system, end.martensite_fraction) * (1.0 + alpha * (end.temperature - 20.0))
    power = volts**2 / own / float(system.wire.wire_length)
    assert _lost(system, end.temperature) == pytest.approx(power, rel=1e-6)


def test_a_supply_with_a_memory_is_the_circuit_of_its_equations() -> None:
    """Against scipy on the same circuit with the wire's own resistance, which is constant here; at rest a plain divider."""
    volts, inner, tau, dt = 8.0, 2.0, 1.5, 0.02
    system = RIGS["dead_weight"][0]
    law = system.wire.resistance
    same = set_parameters(system, {"resistivity_austenite": float(law.resistivity_martensite)})
    own, length = _ohms(same, 1.0), float(same.wire.wire_length)
    on = {"supply_memory.resistance": inner, "supply_memory.time_constant": tau}
    voltage = volts * np.where(np.arange(1001) < 700, 1.0, 0.3)
    run = simulate_compiled(extended(same, ("supply_memory",), on), {"voltage": jnp.asarray(voltage)}, dt)
    heat, ambient = same.wire.heat, float(same.wire.heat.ambient_temperature)
    stored = float(mass_per_metre(same.wire) * heat.specific_heat)

    def rates(_: float, y: np.ndarray, level: float) -> list[float]:
        current = (level - inner * y[0]) / own
        return [(current - y[0]) / tau, (current**2 * own / length - _lost(same, y[1])) / stored]

    y, warm = np.array([0.0, ambient]), [ambient]
    for level in voltage[:-1]:
        y = solve_ivp(rates, (0.0, dt), y, args=(level,), rtol=1e-9, atol=1e-9).y[:, -1]
        warm.append(y[1])
    plain = simulate_compiled(same, {"voltage": jnp.asarray(voltage)}, dt)
    assert np.ptp(np.asarray(plain.temperature) - np.asarray(warm)) > 5.0
    np.testing.assert_allclose(run.temperature, warm, atol=2e-4 * np.ptp(warm))
    _, end = _settled("supply_memory", {"resistance": inner, "time_constant": tau}, voltage=volts)
    whole = _ohms(system, end.martensite_fraction)
    power = (volts / (whole + inner)) ** 2 * whole / float(system.wire.wire_length)
    assert _lost(system, end.temperature) == pytest.approx(power, rel=1e-6)


@pytest.mark.parametrize("volts", [0.0, 1e-215, 1e-6, 0.5])
def test_a_tired_supply_recovers_no_faster_because_little_is_asked_of_it(volts: float) -> None:
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
    system, end = _settled("supply_memory", {"resistance": inner, "time_constant": 1.0}, "bias_spring", 300, duty=duty)
    own, volts = _ohms(system, end.martensite_fraction), float(RIGS["bias_spring"][0].drive.supply_voltage)
    on = volts / (own + duty * inner)  # the drop is that of the mean current
    power = duty * on**2 * own / float(system.wire.wire_length)
    assert _lost(system, end.temperature) == pytest.approx(power, rel=1e-6)


def test_pulses_recorded_as_their_mean_heat_by_their_mean_square() -> None:
    """Pulses of 12 V, 40 % of whose variance reaches the wire: but for one factor those of 10 V with another share."""
    supply, left = 12.0, 0.4
    share = supply * left / (supply * left + 10.0 * (1.0 - left))
    factors = []
    for volts in (3.0, 6.0):
        system, end = _settled("pulsed_voltage", {"share": share}, voltage=volts)
        power = _lost(system, end.temperature) * float(system.wire.wire_length)
        factors.append(power * _ohms(system, end.martensite_fraction) / (volts**2 + left * volts * (supply - volts)))
    assert factors == pytest.approx([(1.0 - share) / (1.0 - left)] * 2, rel=1e-6)


def test_a_friction_that_grows_with_the_load_is_that_share_of_each_weight() -> None:
    """The same wire under two weights: a friction of one size, chosen for the one, is wrong for the other by their ratio."""
    system = RIGS["dead_weight"][0]
    voltage = jnp.asarray(np.concatenate([np.full(300, 7.4), np.zeros(300)]))

    def moved(effect: str, value: float, mass: float) -> np.ndarray:
        full = extended(system, (effect,), {effect + {"p": ".share", "c": ".limit"}[effect[0]]: value})
        return np.asarray(simulate_compiled(full, {"voltage": voltage, "mass": jnp.full(600, mass)}, DT).position)

    for mass in (0.07, 0.12):
        shared = moved("pulley_friction", 0.1, mass)
        np.testing.assert_allclose(shared, moved("coulomb_friction", 0.1 * mass * 9.81, mass), atol=1e-12)
        assert np.abs(shared - moved("coulomb_friction", 0.0, mass)).max() > 1e-5


def test_stribeck_friction_falls_from_its_value_at_rest_to_that_in_motion() -> None:
    """Whatever the wire pulls beyond weight, inertia and damping is the bristle of Canudas de Wit et al. (1995) along the path.

    Where the load has slipped on in one direction for a while, that is the curve over the speed, against the motion.
    """
    system, rest, sliding, speed, bend = RIGS["dead_weight"][0], 0.2, 0.4, 1.5e-3, 1e-5
    mass, damping = 0.075, 200.0
    slow = set_parameters(system, {"load_mass": mass, "damping": damping})
    voltage = {"voltage": jnp.asarray(np.concatenate([np.full(3000, 7.4), np.zeros(3000)]))}

    def run(effect: str, **values: float) -> Any:
        own = {f"{effect}.{name}": value for name, value in values.items()}
        return simulate_compiled(extended(slow, (effect,), own), voltage, DT / 10.0)

    found = run("stribeck_friction", limit=rest, sliding=sliding, speed=speed, bend=bend)
    area = 0.25 * np.pi * float(system.wire.wire_diameter) ** 2
    v = np.asarray(found.velocity)
    inertia = mass * np.gradient(v, DT / 10.0)
    rubs = area * np.asarray(found.stress) - mass * 9.81 - damping * v - inertia
    x, time = np.asarray(found.position), DT / 10.0 * np.arange(v.size)
    fine = np.linspace(time[0], time[-1], 20 * (time.size - 1) + 1)
    path, speeds = np.interp(fine, time, x), np.interp(fine, time, np.abs(v))
    curve = sliding + (1.0 - sliding) * np.exp(-((speeds / speed) ** 2))
    share = np.zeros(fine.size)
    for i, way in enumerate(np.diff(path) / bend, 1):  # delta df/dx = sign(x) - f/h(v), by Euler's implicit method
        share[i] = (share[i - 1] + way) / (1.0 + abs(way) / curve[i])
    moves = np.abs(v) > 2e-4
    assert (moves & (v > 0.0)).sum() > 100
    assert (moves & (v < 0.0)).sum() > 100
    assert np.abs(v).max() > 2.0 * speed
    np.testing.assert_allclose(rubs[moves], rest * share[::20][moves], atol=0.02 * rest)
    # Once up and down: at either turn the bristle first bends to the other side.
    slips = moves & (np.where(v > 0.0, x - x[0], x.max() - x) > 10.0 * bend) & (np.abs(np.gradient(v, time)) < 2e-3)
    assert slips.sum() > 200
    np.testing.assert_allclose(np.abs(rubs)[slips], rest * curve[::20][slips], atol=0.05 * rest)
    alike = run("stribeck_friction", limit=rest, sliding=1.0, speed=speed, bend=PRESLIDING).position
    np.testing.assert_allclose(alike, run("coulomb_friction", limit=rest).position, rtol=0.0, atol=1e-12)


@pytest.mark.parametrize(("speed", "bend"), [(2e-4, 2e-5), (5e-4, 2e-5), (1e-3, 2e-5), (5e-4, 1e-4)])
def test_a_load_that_slides_goes_on_sliding_whatever_the_step(speed: float, bend: float) -> None:
    """Friction that falls with the speed: at a long step the same readings as at short ones, to a hundredth of the stroke."""
    own = {"stribeck_friction.limit": 0.2, "stribeck_friction.sliding": 0.3, "stribeck_friction.speed": speed}
    own["stribeck_friction.bend"] = bend
    system = extended(RIGS["dead_weight"][0], ("stribeck_friction",), own)
    voltage = np.concatenate([np.full(200, 7.4), np.zeros(200), np.full(200, 7.4)])
    long, shorter, short = (
        np.asarray(simulate_compiled(system, {"voltage": jnp.asarray(np.repeat(voltage, k))}, DT / k).position)[::k]
        for k in (1, 4, 16)
    )
    stroke = np.ptp(short)
    assert 0.01 < stroke < 0.025
    assert np.abs(long - short).max() < 0.02 * stroke
    assert np.sqrt(np.mean((long - short) ** 2)) < 3e-3 * stroke
    assert np.sqrt(np.mean((shorter - short) ** 2)) < 3e-3 * stroke


def test_a_loose_wire_leaves_the_arm_on_its_stop_until_it_has_taken_up_its_length() -> None:
    """The temperature at which it leaves is that of the strain s/l_0; from there on both run in parallel."""
    system, length = build("niti_table_3_1", "arm", "amplified_voltage"), 6e-3
    assert LIBRARY["loose_start"].candidate.applies(system)
    voltage = {"voltage": jnp.concatenate([jnp.full(600, 7.5), jnp.zeros(900)])}
    plain, loose = (
        simulate_compiled(one, voltage, 0.01)
        for one in (system, extended(system, ("loose_start",), {"loose_start.length": length}))
    )
    stop = float(system.load.lower_stop)
    on_stop = np.asarray(loose.position) <= stop + 1e-9
    leaves = int(np.argmin(on_stop))
    assert leaves > 10
    assert float(loose.stress[0]) == 0.0
    # The stop lets go when the wire pulls as hard as the load at rest does on a taut one.
    assert float(loose.stress[leaves - 1]) == pytest.approx(float(plain.stress[0]), rel=0.05)
    # What the wire is too long by, less the elastic strain at rest, is the strain that it takes up on the stop.
    span, modulus = float(system.wire.wire_length), float(system.wire.constitutive.young_modulus_martensite)
    assert float(loose.strain[0]) == pytest.approx(length / span - float(plain.stress[0]) / modulus, rel=1e-6)
    assert float(loose.strain[leaves - 1]) == pytest.approx(0.0, abs=2e-5)
    geometric = -float(system.load.contraction(system.wire)) * (np.asarray(loose.position) - stop)
    taut = np.asarray(loose.stress) > 0.0
    np.testing.assert_allclose(np.asarray(loose.strain)[taut], geometric[taut], atol=1e-9)
    assert on_stop[-1]
    assert 0.2 < np.asarray(loose.position).max() - stop < np.asarray(plain.position).max() - stop


def test_a_spring_in_series_takes_up_a_loose_wire_with_it() -> None:
    system, compliance = build("niti_table_3_1", "arm", "amplified_voltage"), 1e-3
    still = {"voltage": jnp.zeros(())}
    at_rest = float(initial_state(system, still).wire.stress)
    area = 0.25 * np.pi * float(system.wire.wire_diameter) ** 2
    modulus, span = float(system.wire.constitutive.young_modulus_martensite), float(system.wire.wire_length)
    on = {"series_compliance.compliance": compliance, "loose_start.length": 1e-3}
    begun = initial_state(extended(system, ("series_compliance", "loose_start"), on), still)
    assert float(begun.wire.stress) == pytest.approx(at_rest - 1e-3 / (span / modulus + compliance * area), rel=1e-6)


def test_a_stretch_below_the_elastic_one_is_taken_off_the_stress() -> None:
    system = build("niti_table_3_1", "arm", "amplified_voltage")
    modulus, span = float(system.wire.constitutive.young_modulus_martensite), float(system.wire.wire_length)
    at_rest = float(initial_state(system, {"voltage": jnp.zeros(())}).wire.stress)
    half = 0.5 * at_rest / modulus * span
    begun = initial_state(extended(system, ("loose_start",), {"loose_start.length": half}), {"voltage": jnp.zeros(())})
    assert float(begun.wire.stress) == pytest.approx(0.5 * at_rest, rel=1e-9)
    assert float(begun.wire.strain) == 0.0


def test_a_sagging_supply_gives_less_than_its_largest_current() -> None:
    volts, sag = 8.0, 0.4
    system, end = _settled("supply_sag", {"sag": sag}, voltage=volts)
    own = _ohms(system, end.martensite_fraction)
    current = volts / own / (1.0 + sag * volts / own)
    power = current**2 * own / float(system.wire.wire_length)
    assert _lost(system, end.temperature) == pytest.approx(power, rel=1e-6)


def test_a_current_knows_no_leads_and_a_power_none_of_a_sag() -> None:
    """Where a drive cannot show an effect it is no candidate, and changes nothing if it is put in all the same."""
    for drive, without, value in (("current", "lead_resistance", 0.3), ("power", "supply_sag", 1.5)):
        system = build("flexinol_table_3_2", "dead_weight", drive)
        assert without not in candidates(system, None, ())
        assert "input_level" in candidates(system, None, ())
        inputs = {drive: jnp.where(jnp.arange(200) < 120, value, 0.0)}
        plain = simulate_compiled(system, inputs, DT)
        starts = {f"{without}.{name}": size for name, size in LIBRARY[without].candidate.initial_guess.items()}
        same = simulate_compiled(extended(system, (without,), starts), inputs, DT)
        np.testing.assert_allclose(same.temperature, plain.temperature, rtol=1e-12)
        assert np.ptp(plain.temperature) > 20.0
    names = candidates(build("flexinol_isobaric", "coupon", "none"), None, ())
    assert not {"input_level", "slack"} & set(names)
    assert {"input_delay", "input_clock", "creep"} <= set(names)
    untimed = candidates(build("flexinol_isobaric", "coupon", "none"), None, (), clocked=False)
    assert not {"input_delay", "input_clock", "creep", "sensor_drift", "sensor_lag"} & set(untimed)
    assert {"two_part_transformation", "residual_strain", "sensor_gain"} <= set(untimed)
    assert "pwm_smoothing" not in candidates(RIGS["dead_weight"][0], None, ())
    assert "nonlinear_spring" not in candidates(RIGS["dead_weight"][0], None, ())
    assert {"pwm_smoothing", "nonlinear_spring"} <= set(candidates(RIGS["bias_spring"][0], None, ()))


def test_pulses_smoothed_throughout_heat_by_the_square_of_the_duty() -> None:
    smooth, hard = (
        _settled("pwm_smoothing", {"share": share}, "bias_spring", duty=duty)[1]
        for share, duty in ((1.0, 0.3), (0.0, 0.09))
    )
    assert smooth.temperature == pytest.approx(hard.temperature, rel=1e-9)


def test_the_spring_in_series_gives_way_by_force_over_stiffness() -> None:
    """Cold, 0.5 N are hung on: the load sags by F/k more than without it."""
    system, compliance = RIGS["dead_weight"][0], 2e-4
    mass = jnp.where(jnp.arange(400) < 10, 0.075, 0.075 + 0.5 / 9.81)
    inputs = {"voltage": jnp.zeros(400), "mass": mass}
    held = simulate_compiled(system, inputs, DT).position
    soft = simulate_compiled(
        extended(system, ("series_compliance",), {"series_compliance.compliance": compliance}), inputs, DT
    )
    assert soft.position[-1] - held[-1] == pytest.approx(-0.5 * compliance, rel=1e-6)
    taken = extended(system, ("slack",), {"slack.length": 1e-3, "slack.force": 0.4})
    before, after = 0.075 * 9.81, 0.075 * 9.81 + 0.5
    expected = 1e-3 * (np.exp(-after / 0.4) - np.exp(-before / 0.4))
    assert simulate_compiled(taken, inputs, DT).position[-1] - held[-1] == pytest.approx(expected, rel=1e-5)


def test_a_stiffer_spring_asks_for_its_force() -> None:
    system, end = _settled("nonlinear_spring", {"change": 2.0, "displacement": 5e-3}, "bias_spring", duty=0.35)
    x, k = end.position, float(system.load.spring_stiffness)
    force = float(system.load.spring_preload) + k * x + 2.0 * k * x**3 / (x**2 + 25e-6)
    assert x > 5e-3
    assert end.stress * 0.25 * np.pi * 0.5e-3**2 == pytest.approx(force, rel=1e-6)


def test_a_wrong_load_is_on_the_wire_from_the_start_and_a_shifted_one_from_its_time() -> None:
    weight, area = 0.075 * 9.81, 0.25 * np.pi * 150e-6**2
    system = RIGS["dead_weight"][0]
    inputs = {"voltage": jnp.zeros(401)}
    wrong = simulate_compiled(extended(system, ("wrong_load",), {"wrong_load.share": 0.2}), inputs, DT)
    np.testing.assert_allclose(wrong.stress, 1.2 * weight / area, rtol=1e-6)
    shift = {"load_shift.share": 0.2, "load_shift.time": 10.0, "load_shift.width": 0.1}
    shifted = simulate_compiled(extended(system, ("load_shift",), shift), inputs, DT)
    assert shifted.stress[100] == pytest.approx(weight / area, rel=1e-6)
    assert shifted.stress[-1] == pytest.approx(1.2 * weight / area, rel=1e-6)


def test_a_draught_cools_from_its_time_on() -> None:
    draught = {"draught.change": 0.5, "draught.time": 20.0, "draught.width": 0.1}
    system = extended(RIGS["dead_weight"][0], ("draught",), draught)
    run = simulate_compiled(system, {"voltage": jnp.full(801, 5.0)}, DT)
    calm, blown = (_lost(system, float(run.temperature[at])) for at in (360, 800))
    # Martensite all the time, so that the power is the same: the loss is it in both cases.
    assert run.martensite_fraction.min() > 0.999
    assert 1.5 * blown == pytest.approx(calm, rel=1e-6)


def test_a_specific_heat_by_phase_changes_the_pace_and_not_the_rest() -> None:
    plain, other = (_settled("phase_specific_heat", {"contrast": a}, voltage=8.0)[1] for a in (0.0, 0.3))
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


@pytest.mark.parametrize("share", [0.0, 1.0])
def test_the_heat_of_transformation_stays_or_follows_kirchhoff(share: float) -> None:
    """Heat put in over a transformation: that of the phases' specific heats on the way, and k times Kirchhoff's change."""
    system = RIGS["dead_weight"][0]
    on = {"phase_specific_heat.contrast": 0.3, "phase_specific_heat.kirchhoff": share}
    dt, volts = 2e-3, 8.0
    run = simulate_compiled(
        extended(system, ("phase_specific_heat",), on), {"voltage": jnp.full(round(20.0 / dt) + 1, volts)}, dt
    )
    wire = system.wire
    assert run.martensite_fraction[-1] < 1e-6
    temperature, fraction = np.asarray(run.temperature), np.asarray(run.martensite_fraction)
    power = volts**2 / np.asarray([_ohms(system, one) for one in fraction]) / float(wire.wire_length)
    given = float(np.trapezoid(power - np.asarray([_lost(system, one) for one in temperature]), dx=dt))
    m_c = float(mass_per_metre(wire) * wire.heat.specific_heat)
    law = wire.kinetics
    neutral = 0.5 * float(law.martensite_start + law.austenite_finish)
    own = m_c * np.trapezoid(1.0 + 0.3 * (1.0 - fraction), temperature)
    change = -0.3 * m_c * np.trapezoid(temperature - neutral, fraction)
    assert abs(change) > 0.01 * own
    assert given == pytest.approx(own + share * change, rel=1e-3)


def test_cool_ends_are_those_of_the_fin() -> None:
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


def test_a_delay_of_whole_and_of_half_steps_is_the_shifted_input() -> None:
    system, channel, top = RIGS["dead_weight"]
    inputs = _inputs(channel, top)
    for delay, steps in ((3 * DT, 3), (-2 * DT, -2)):
        places = np.clip(np.arange(360) - steps, 0, 359)
        late = simulate_compiled(extended(system, ("input_delay",), {"input_delay.delay": delay}), inputs, DT)
        moved = simulate_compiled(system, {channel: inputs[channel][places]}, DT)
        np.testing.assert_allclose(late.reading, moved.reading, rtol=0.0, atol=1e-9 * np.ptp(moved.reading))
    # Half a step: what two steps of half the length give, the first of them under the older command.
    half = simulate_compiled(extended(system, ("input_delay",), {"input_delay.delay": 0.5 * DT}), inputs, DT)
    twice = jnp.repeat(inputs[channel], 2)[np.clip(np.arange(719) - 1, 0, 719)]
    moved = simulate_compiled(system, {channel: twice}, 0.5 * DT)
    np.testing.assert_allclose(half.reading, moved.reading[::2], rtol=0.0, atol=1e-9 * np.ptp(moved.reading))


def test_a_coupons_temperature_is_late_and_its_stress_is_not() -> None:
    coupon = build("flexinol_isobaric", "coupon", "none")
    time = DT * np.arange(400)
    inputs: dict[str, Any] = {
        "temperature": 70.0 - 50.0 * np.cos(0.35 * time),
        "stress": 120e6 + 20e6 * np.sin(0.8 * time),
    }
    late = simulate_compiled(extended(coupon, ("input_delay",), {"input_delay.delay": 2.5 * DT}), inputs, DT)
    acted = np.interp(time - 2.5 * DT, time, inputs["temperature"])
    moved = simulate_compiled(coupon, inputs | {"temperature": acted}, DT)
    np.testing.assert_allclose(late.strain, moved.strain, rtol=0.0, atol=1e-9)
    assert np.ptp(moved.martensite_fraction) > 0.5


def test_a_clock_that_falls_behind_is_a_delay_that_grows() -> None:
    system, channel, _ = RIGS["dead_weight"]
    ramp = jnp.linspace(0.0, 8.0, 301)
    late = acting_inputs(extended(system, ("input_clock",), {"input_clock.rate": 0.05}), {channel: ramp}, DT)
    parts = switched(late)
    assert parts is not None
    share, before, after = parts
    assert float(share.max()) > 0.9
    np.testing.assert_allclose(share * before[channel] + (1.0 - share) * after[channel], 0.95 * ramp, rtol=1e-9)


def test_the_recorded_level_is_a_straight_line_of_the_one_that_acts() -> None:
    system, channel, top = RIGS["dead_weight"]
    inputs = _inputs(channel, top)
    level = {"input_level.gain": 0.1, "input_level.offset": 0.3}
    found = simulate_compiled(extended(system, ("input_level",), level), inputs, DT)
    acted = simulate_compiled(system, {channel: 1.1 * inputs[channel] + 0.3}, DT)
    np.testing.assert_allclose(found.reading, acted.reading, rtol=0.0, atol=1e-12)
    # A duty below zero would cool.
    low = _settled("input_level", {"offset": -0.2}, "bias_spring", duty=0.1)[1]
    assert low.temperature == pytest.approx(22.0, abs=1e-9)


def test_below_its_threshold_a_dead_zone_passes_next_to_nothing() -> None:
    zone = LIBRARY["dead_zone"](threshold=0.1)
    assert abs(float(zone.command("voltage", jnp.asarray(1e-3)))) < 1e-5
    assert float(zone.command("voltage", jnp.asarray(-20.0))) == pytest.approx(-19.9, abs=1e-3)
    slope = jax.grad(lambda limit: LIBRARY["dead_zone"](threshold=limit).command("duty", jnp.asarray(0.0)))
    assert float(slope(jnp.asarray(0.0))) == 0.0


def test_a_batch_delays_its_inputs_too_and_a_closed_loop_refuses() -> None:
    system, channel, top = RIGS["dead_weight"]
    inputs, late = _inputs(channel, top), extended(system, ("input_delay",))
    found = run_batch(late, inputs, grid({"input_delay.delay": [0.0, 4 * DT]}), dt=DT)
    single = simulate_compiled(extended(system, ("input_delay",), {"input_delay.delay": 4 * DT}), inputs, DT)
    np.testing.assert_allclose(found["position"][1], single.position, rtol=0.0, atol=1e-12)
    plant = arm()
    with pytest.raises(ValueError, match=r"input_delay.*leave"):
        simulate_closed_loop(extended(plant, ("input_delay",)), CONTROLLERS["pid"].make(plant), jnp.full(11, 0.1), 0.01)
