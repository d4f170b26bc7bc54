"""The effects of kinetics, constitutive law and sensor: nothing at their base value, and what they say off it.

All effects of a rig are in one model and switched on one at a time by their values: one compilation, not one each.
"""

from __future__ import annotations

import dataclasses
import itertools

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from smajax.attribution.config import AttributionConfig
from smajax.core.parameters import parameter_values, parameters, set_parameters
from smajax.engine import program
from smajax.model.effects.library import LIBRARY
from smajax.model.extended import extended
from smajax.model.presets import build
from smajax.model.system import System, initial_state
from smajax.model.types import Trajectory
from smajax.model.wire.laws import under_law
from smajax.simulation.compiled import simulate_compiled
from smajax.simulation.simulate import simulate
from smajax.simulation.steppers import Integration
from tests.helpers.often import often

NUDGE = AttributionConfig().nudge

DT = 0.05
DEAD_WEIGHT = build("flexinol_table_3_2", "dead_weight", "voltage")
COUPON = build("flexinol_table_3_2", "coupon", "none")


def _under(system: System, law: str) -> System:
    return dataclasses.replace(system, wire=under_law(system.wire, law))


def _ramps(*ends: float, each: int = 90) -> np.ndarray:
    return np.concatenate([np.linspace(*pair, each) for pair in itertools.pairwise(ends)])


def _inputs(**series: np.ndarray) -> dict[str, jax.Array]:
    return {channel: jnp.asarray(values) for channel, values in series.items()}


# Strokes with a turn on their way, under a weight that changes.
STROKES = _inputs(
    voltage=7.4 * np.concatenate([np.full(n, level) for n, level in ((110, 1.0), (9, 0.0), (91, 0.95), (130, 0.0))]),
    mass=np.where((np.arange(340) // 40) % 4 == 2, 0.1, 0.075),
)
# The weights of claim M13: part of the load taken off a wire that rests within its range, and put back.
UNLOADED = _inputs(
    voltage=np.where(np.arange(480) < 400, 8.7, 0.0),
    mass=np.where((np.arange(480) // 120) % 2 == 1, 0.267, 0.363),
)
UNSTRESSED = _inputs(temperature=_ramps(90.0, 20.0, 90.0, 60.0, 50.0), stress=np.full(360, 5e6))
HELD = _inputs(temperature=_ramps(20.0, 110.0, 20.0, 90.0), stress=np.repeat([150e6, 80e6, 150e6], 90))
# Through both ranges from end to end, and through a part of them.
CYCLED = _inputs(temperature=_ramps(82.0, 94.0, 67.0, 56.0, 91.0), stress=np.full(360, 1e8))
RIGS = {
    "cycled": (COUPON, CYCLED, ("transformation_curve",)),
    "strokes": (
        DEAD_WEIGHT,
        STROKES,
        (
            "unequal_stress_slopes",
            "stress_dependent_width",
            "minor_loops",
            "lagging_transformation",
            "drifting_temperatures",
            "residual_strain",
            "creep",
            "sensor_gain",
            "sensor_drift",
            "sensor_offset",
            "sensor_backlash",
            "sensor_limit",
        ),
    ),
    "unloaded": (_under(DEAD_WEIGHT, "liang"), UNLOADED, ("enhanced_conditions",)),
    "unloaded, enhanced": (_under(DEAD_WEIGHT, "enhanced"), UNLOADED, ("liang_conditions",)),
    "held": (COUPON, HELD, ("elastic_mismatch",)),
    "split": (_under(COUPON, "brinson"), UNSTRESSED, ("two_way_memory",)),
}


def _starts(name: str, share: float = 1.0) -> dict[str, float]:
    """Coefficients by name, of the switches this share."""
    switches = LIBRARY[name].candidate.switches
    return {
        f"{name}.{key}": size * (share if key in switches else 1.0)
        for key, size in LIBRARY[name].candidate.initial_guess.items()
    }


def _gap(one: Trajectory, other: Trajectory, name: str) -> float:
    """Largest difference over the largest value."""
    first, second = np.asarray(getattr(one, name)), np.asarray(getattr(other, name))
    return float(np.abs(first - second).max() / np.abs(second).max())


def _sound(system: System, run: Trajectory) -> None:
    """Numbers, a fraction that is one, and a strain that is the load's wherever the wire is taut."""
    for which in ("temperature", "stress", "strain", "reading"):
        assert np.isfinite(getattr(run, which)).all(), which
    assert 0.0 <= run.martensite_fraction.min() <= run.martensite_fraction.max() <= 1.0
    if system.load.inputs_required:
        return
    taut = np.asarray(run.stress) > 0.0
    geometric = -np.asarray(run.position) * float(system.load.contraction(system.wire))
    np.testing.assert_allclose(np.asarray(run.strain)[taut], geometric[taut], rtol=0.0, atol=1e-8)


# A share of the other law's conditions is held to more by `test_a_share_of_one_is_the_other_law...`.
@pytest.mark.parametrize("rig", often(RIGS, ["strokes", "held", "split"]))
def test_effects_at_their_base_value_are_the_base_model_and_each_off_it_is_not(rig):
    system, inputs, names = RIGS[rig]
    full = extended(system, names)
    plain, at_base = (simulate_compiled(model, inputs, DT) for model in (system, full))
    assert float(np.ptp(plain.martensite_fraction)) > 0.3
    for which in ("temperature", "stress", "strain", "martensite_fraction", "xi_M", "xi_A", "reading"):
        assert _gap(at_base, plain, which) < 1e-11, which
    random = np.random.default_rng(0)
    for name in names:
        on = simulate_compiled(set_parameters(full, _starts(name)), inputs, DT)
        _sound(system, on)
        assert _gap(on, plain, "reading") > 1e-4, name
        own = [entry for key, entry in parameters(full).items() if key.startswith(f"{name}.")]
        for _ in range(6):  # anywhere in the bounds, and now and then on one
            shares = np.clip(random.uniform(-0.1, 1.1, len(own)), 0.0, 1.0)
            values = {
                entry.name: entry.low + float(share) * (entry.high - entry.low)
                for entry, share in zip(own, shares, strict=True)
            }
            _sound(system, simulate_compiled(set_parameters(full, values), inputs, DT))


@pytest.mark.parametrize("rig", RIGS)
def test_derivatives_agree_with_differences_and_every_switch_has_a_score(rig):
    """Of the mean reading over parts of a run, by every coefficient: switched on, and where the score is taken."""
    system, inputs, names = RIGS[rig]
    full = extended(system, names)
    base = {key: value for key, value in parameter_values(full).items() if "." in key}

    def readings(model, own):
        def along(share):
            there = {key: own[key] + share * own[f"{key} towards"] for key in base}
            return simulate(set_parameters(model, there), inputs, DT).reading

        return jax.jvp(along, (own["step"],), (jnp.ones_like(own["step"]),))

    cases = []
    for name in names:
        for share in (NUDGE, 1.0):
            at = {**base, **_starts(name, share)}
            for key in _starts(name):
                nudged = share == NUDGE and key.split(".")[1] in LIBRARY[name].candidate.switches
                # So small a coefficient is to be moved far enough to rise above rounding.
                cases.append((key, at, abs(at[key]) or 1.0, 3e-2 if nudged else 1e-5))
    members = {key: np.repeat([at[key] for _, at, _, _ in cases], 3) for key in base}
    for key in base:
        members[f"{key} towards"] = np.repeat([size * (key == moved) for moved, _, size, _ in cases], 3)
    members["step"] = np.concatenate([[-step, 0.0, step] for *_, step in cases])
    found = program(readings, full, tuple(members), engine="native")(full, members, 1)
    # Means of parts of a run: no sample that lies at a kink hides the derivative.
    values, slopes = (np.stack([one[:, start:].mean(axis=1) for start in (0, 150, 260)], axis=1) for one in found)
    for number, (key, at, _, step) in enumerate(cases):
        low, here, high = values[3 * number : 3 * number + 3]
        slope, difference = slopes[3 * number + 1], (high - low) / (2.0 * step)
        noise = 1e-13 * np.abs(here).max() / step
        assert np.abs(slope - difference).max() <= 1e-4 * np.abs(difference).max() + noise, (key, at[key])
        if key.split(".")[1] in LIBRARY[key.split(".")[0]].candidate.switches:
            assert np.abs(slope).max() > 1e-6 * np.abs(here).max() * step, f"the score test does not see {key}"


@pytest.mark.slow
def test_error_controlled_steps_carry_the_history_of_effects():
    """The same readings by steps of its own as by short fixed ones, with a lag, a backlash and a late transformation."""
    names = ("lagging_transformation", "sensor_lag", "sensor_gain", "sensor_backlash")
    on = {key: value for name in names for key, value in _starts(name).items()}
    system = extended(DEAD_WEIGHT, names, on)
    voltage = STROKES["voltage"]
    own = simulate_compiled(system, {"voltage": voltage}, DT, 1e-5)
    fixed = simulate_compiled(system, _inputs(voltage=np.repeat(voltage, 10)), DT / 10.0)
    assert np.abs(own.reading - fixed.reading[::10]).max() < 2e-2 * np.ptp(fixed.reading)


def test_a_share_of_one_is_the_other_law_and_a_share_of_zero_the_models_own():
    """On the weights of M13 and on a coupon, where the stress falls while the temperature falls or stands still."""
    cooler = _inputs(
        temperature=_ramps(23.0, 84.0, 80.0, 80.0, 23.0), stress=1e6 * _ramps(60.0, 60.0, 20.0, 60.0, 60.0)
    )
    for system, inputs in ((DEAD_WEIGHT, UNLOADED), (COUPON, cooler)):
        liang, enhanced = _under(system, "liang"), _under(system, "enhanced")
        ends = [simulate_compiled(model, inputs, DT) for model in (liang, enhanced)]
        assert _gap(ends[0], ends[1], "martensite_fraction") > 0.1
        ways = ((liang, "enhanced_conditions", ends), (enhanced, "liang_conditions", ends[::-1]))
        for model, name, known in ways:
            for share, expected in zip((0.0, 1.0), known, strict=True):
                run = simulate_compiled(extended(model, (name,), {f"{name}.share": share}), inputs, DT)
                for which in ("temperature", "stress", "strain", "martensite_fraction", "reading"):
                    assert _gap(run, expected, which) < 1e-9, (name, share, which)
            other = next(one for _, one, _ in ways if one != name)
            assert LIBRARY[name].candidate.applies(model)
            assert not LIBRARY[other].candidate.applies(model)
    half = {"enhanced_conditions.share": 0.4}
    # A coupon's temperature and stress are prescribed: the fraction in between is the mean.
    between = simulate_compiled(extended(_under(COUPON, "liang"), ("enhanced_conditions",), half), cooler, DT)
    mean = 0.6 * ends[0].martensite_fraction + 0.4 * ends[1].martensite_fraction
    np.testing.assert_allclose(between.martensite_fraction, mean, rtol=0.0, atol=1e-12)


def test_residual_strain_and_drift_after_n_cycles_are_those_of_the_formula():
    """Full cycles of a coupon under one stress: N of them give 1 - exp(-N/N_0) of either."""
    n, each, scale, most, shift = 4, 900, 5.0, 4e-3, 8.0
    temperature = np.concatenate([[20.0], *([_ramps(20.0, 110.0, 20.0, each=each)] * n)])
    inputs = _inputs(temperature=temperature, stress=np.full(len(temperature), 60e6))
    plain = simulate_compiled(COUPON, inputs, DT)
    full = extended(
        COUPON,
        ("residual_strain", "drifting_temperatures"),
        {"residual_strain.cycles": scale, "drifting_temperatures.cycles": scale},
    )
    run = simulate_compiled(set_parameters(full, {"residual_strain.first": most / scale}), inputs, DT)
    ends = 2 * each * np.arange(1, n + 1)
    done = 1.0 - np.exp(-np.arange(1, n + 1) / scale)
    np.testing.assert_allclose(run.strain[ends] - plain.strain[ends], most * done, rtol=1e-9)
    run = simulate_compiled(set_parameters(full, {"drifting_temperatures.first_heating": shift / scale}), inputs, DT)
    # Half of the wire is austenite at another temperature: later in every cycle by the drift so far.
    for cycle in range(1, n):
        up = slice(2 * each * cycle + 1, 2 * each * cycle + each + 1)
        half = [np.interp(-0.5, -one.martensite_fraction[up], temperature[up]) for one in (plain, run)]
        # It goes on drifting while it heats, by a quarter of a cycle up to here.
        assert half[1] - half[0] == pytest.approx(shift * (1.0 - np.exp(-(cycle + 0.25) / scale)), abs=0.02)


def test_a_trained_wire_lengthens_on_cooling_without_a_load():
    """Brinson's split at zero stress: no strain from all the martensite, and a eps_L of it by two-way memory."""
    inputs = _inputs(temperature=_ramps(20.0, 90.0, 20.0), stress=np.zeros(180))
    system = _under(COUPON, "brinson")
    run = simulate_compiled(extended(system, ("two_way_memory",), {"two_way_memory.share": 0.3}), inputs, DT)
    plain = simulate_compiled(system, inputs, DT)
    gained = np.asarray(run.strain - plain.strain)
    stroke = 0.3 * float(system.wire.constitutive.recoverable_strain)
    np.testing.assert_allclose(gained, stroke * (run.martensite_fraction - 1.0), atol=1e-12)
    assert run.martensite_fraction[89] == 0.0
    assert run.martensite_fraction[-1] == 1.0


def test_a_held_load_creeps_by_j_times_its_change():
    """A coupon unloaded over one step: the strain goes on by J dsigma (1 - exp(-t/tau)) after the step's own straight line."""
    stress = np.where(np.arange(400) < 100, 100e6, 40e6)
    inputs = _inputs(temperature=np.full(400, 20.0), stress=stress)
    compliance, tau, dt = 4e-12, 3.0, 0.5
    on = {"creep.martensite": compliance, "creep.time_constant": tau}
    run = simulate_compiled(extended(COUPON, ("creep",), on), inputs, dt)
    plain = simulate_compiled(COUPON, inputs, dt)
    time = dt * np.arange(1, 301)
    # The response to a ramp over the first step: of a step, averaged over it.
    left = tau / dt * (np.exp(dt / tau) - 1.0) * np.exp(-time / tau)
    expected = np.concatenate([np.zeros(100), -60e6 * compliance * (1.0 - left)])
    np.testing.assert_allclose(run.strain - plain.strain, expected, atol=1e-13)


def test_martensite_that_creeps_more_creeps_on_after_the_transformation():
    """Heated through its range at constant stress: retarded strain follows (J_A + (J_M - J_A) xi) sigma with a lag."""
    temperature = np.concatenate([_ramps(20.0, 120.0, each=401), np.full(400, 120.0)])
    inputs = _inputs(temperature=temperature, stress=np.full(temperature.size, 80e6))
    dt, tau, soft, stiff = 0.05, 2.0, 9e-12, 2e-12
    on = {"creep.martensite": soft, "creep.austenite": stiff, "creep.time_constant": tau}
    run = simulate_compiled(extended(COUPON, ("creep",), on), inputs, dt)
    plain = simulate_compiled(COUPON, inputs, dt)
    xi = np.asarray(run.martensite_fraction)
    assert xi[0] == 1.0
    assert xi[-1] == 0.0
    settled = (stiff + (soft - stiff) * xi) * 80e6
    late = [settled[0]]
    for before, now in itertools.pairwise(settled):  # many small steps of the same lag
        for share in (np.arange(200) + 0.5) / 200:
            late.append(late[-1] + (before + share * (now - before) - late[-1]) * (1.0 - np.exp(-dt / 200 / tau)))
    expected = np.asarray(late)[::200] - settled[0]
    np.testing.assert_allclose(run.strain - plain.strain, expected, atol=1e-4 * np.ptp(expected))


@pytest.mark.parametrize("share", [0.0, 0.05, 0.5, 1.0])
def test_strain_that_formed_under_one_stress_goes_under_another_as_its_share_says(share):
    """Formed at 200 MPa, heated out at 20: what is left behind is 1 - b of the difference, in few steps as in many."""
    gain, scale = 0.02, 1e8
    high, low = (gain * (1.0 - np.exp(-stress / scale)) for stress in (200e6, 20e6))
    on = {"stress_dependent_strain.gain": gain, "stress_dependent_strain.scale": scale}
    system = extended(COUPON, ("stress_dependent_strain",), {**on, "stress_dependent_strain.returned": share})
    for each in (40, 400):
        heated = _ramps(20.0, 130.0, 20.0, 130.0, each=each)
        stress = np.where(np.arange(3 * each) < 2 * each, 200e6, 20e6)
        inputs = _inputs(temperature=heated, stress=stress)
        run, plain = simulate_compiled(system, inputs, DT), simulate_compiled(COUPON, inputs, DT)
        assert run.martensite_fraction[2 * each - 1] == pytest.approx(1.0)
        assert run.martensite_fraction[-1] == pytest.approx(0.0)
        kept = np.asarray(run.strain - plain.strain)
        assert kept[2 * each - 1] - kept[0] == pytest.approx(0.0, abs=1e-12)
        assert kept[-1] - kept[each - 1] == pytest.approx(
            (1.0 - share) * (high - low), rel=0.02 if each < 100 else 2e-3
        )


def test_a_lagging_transformation_is_late_by_its_time_constant():
    """Heated at a steady rate: the whole curve is tau dT/dt higher, and lower on cooling."""
    rate, tau = 2.0, 1.5
    temperature = np.concatenate([_ramps(20.0, 120.0, each=1001), _ramps(120.0, 20.0, each=1001)])
    inputs = _inputs(temperature=temperature, stress=np.full(2002, 60e6))
    dt = 0.1 / rate
    on = {"lagging_transformation.time_constant": tau}
    plain = simulate_compiled(COUPON, inputs, dt)
    run = simulate_compiled(extended(COUPON, ("lagging_transformation",), on), inputs, dt)
    for part, towards in ((slice(0, 1001), 1.0), (slice(1001, 2002), -1.0)):
        half = [
            np.interp(-0.5 * towards, -towards * one.martensite_fraction[part], temperature[part])
            for one in (plain, run)
        ]
        assert half[1] - half[0] == pytest.approx(towards * tau * rate, abs=1e-3)


@pytest.mark.parametrize("tau", [0.03, 0.17, 0.6, 2.0])
def test_where_a_lagging_transformation_turns_within_a_step_it_turns_exactly(tau: float):
    """Turned about within the range, at steps of 1 s that the lag is a part of: as with steps 64 times as fine, and the derivative by the lag is that of differences."""
    corners = (30.0, 88.0, 58.0, 90.0, 55.0, 92.0, 30.0)
    temperature = np.concatenate([_ramps(low, high, each=31)[1:] for low, high in itertools.pairwise(corners)])
    inputs = _inputs(temperature=temperature, stress=np.full(temperature.size, 60e6))

    late = extended(COUPON, ("lagging_transformation",))

    def strain(time_constant: jax.Array | float, substeps: int = 1) -> jax.Array:
        on = set_parameters(late, {"lagging_transformation.time_constant": time_constant})
        return simulate(on, inputs, 1.0, integration=Integration(substeps=substeps)).strain

    assert np.ptp(strain(tau)[30:90]) > 2e-3  # it transforms there, both ways
    assert np.abs(np.asarray(strain(tau) - strain(tau, 64))).max() < 5e-6
    slope = jax.jacfwd(strain)(jnp.asarray(tau))
    differences = (strain(tau + 1e-5) - strain(tau - 1e-5)) / 2e-5
    assert np.abs(np.asarray(slope - differences)).max() < 1e-6 * np.abs(np.asarray(slope)).max()


def test_a_lagging_transformation_follows_the_stress_late_too():
    """Loaded at a steady rate at one temperature: the whole curve is tau dsigma/dt further on."""
    rate, tau, dt = 4e6, 1.5, 0.05
    stress = np.concatenate([np.full(80, 20e6), 20e6 + rate * dt * np.arange(2000)])
    heated = np.concatenate([_ramps(20.0, 120.0, 60.0, each=40), np.full(2000, 60.0)])
    inputs = _inputs(temperature=heated, stress=stress)
    plain = simulate_compiled(COUPON, inputs, dt)
    on = {"lagging_transformation.time_constant": tau}
    run = simulate_compiled(extended(COUPON, ("lagging_transformation",), on), inputs, dt)
    part = slice(120, None)
    assert plain.martensite_fraction[120] < 0.05
    assert plain.martensite_fraction[-1] > 0.95
    half = [np.interp(0.5, one.martensite_fraction[part], stress[part]) for one in (plain, run)]
    assert half[1] - half[0] == pytest.approx(tau * rate, rel=2e-3)


def test_a_reading_is_the_position_changed_by_the_sensors_faults():
    """Gain, drift, zero and backlash in the library's order, from the first sample on."""
    names = ("sensor_gain", "sensor_drift", "sensor_offset", "sensor_backlash")
    on = {
        "sensor_gain.error": 0.1,
        "sensor_drift.rate": 1e-4,
        "sensor_offset.shift": 3e-3,
        "sensor_backlash.half_width": 1e-3,
    }
    run = simulate_compiled(extended(DEAD_WEIGHT, names, on), STROKES, DT)
    before = 1.1 * np.asarray(run.position) + 1e-4 * np.asarray(run.time) + 3e-3
    known = [before[0]]
    for value in before[1:]:
        known.append(min(max(known[-1], value - 1e-3), value + 1e-3))
    np.testing.assert_allclose(run.reading, known, atol=1e-14)


def test_a_state_with_the_history_of_other_effects_is_refused():
    plain = initial_state(DEAD_WEIGHT, {name: values[0] for name, values in STROKES.items()})
    late = extended(DEAD_WEIGHT, ("lagging_transformation",))
    for tolerance in (None, 1e-4):
        with pytest.raises(ValueError, match="lagging_temperature"):
            simulate_compiled(late, STROKES, DT, tolerance, plain)
