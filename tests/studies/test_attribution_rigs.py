"""The benchmark's own measurements: what the generator integrates, and what a case says of itself."""

from __future__ import annotations

import json
from collections import Counter
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from studies.attribution_benchmark import coupon
from studies.attribution_benchmark.actuator import Actuator
from studies.attribution_benchmark.cases import Case, cases, of_any_size, true_wire, truth
from studies.attribution_benchmark.effects import EFFECTS, absorbed, applies
from studies.attribution_benchmark.kinetics import Curve
from studies.attribution_benchmark.rigs import RIGS, Rig, actuator_of, show, simulate
from studies.attribution_benchmark.runs import Clock, Run
from studies.attribution_benchmark.strength import Ruler
from studies.attribution_benchmark.write import table_text, write
from studies.reference.wire_reference import DeadWeightParameters, simulate_dead_weight

SHORT = Clock(0.1, 5, 121)


def _short(name: str) -> tuple[Rig, Run]:
    """A rig over 12 s: heated through its range, half cooled, heated again and let cool."""
    rig = replace(RIGS[name], clock=SHORT)
    high = max(float(run.command.max()) for run in rig.runs(rig.wire))
    levels = SHORT.levels((0.3, high), (0.15, 0.7 * high), (0.2, 0.93 * high), (0.35, 0.3 * high))
    return rig, Run("short", "fit", levels, np.full(SHORT.count, 0.64) if name == "dead_weight" else None)


@pytest.mark.parametrize(
    "effects",
    [
        {},
        {"latent_heat": 2e4, "radiation": 0.9},
        {"phase_specific_heat": 0.3, "ambient_drift": 0.1, "lead_resistance": 0.02},
    ],
)
def test_heat_is_power_less_loss(effects: dict[str, float]) -> None:
    """Eq. 3.1 summed over a run: what went in, less what was lost, is what warmed and transformed the wire."""
    rig, run = _short("dead_weight")
    s = simulate(rig, rig.wire, run, effects)
    actuator = actuator_of(rig, rig.wire, run, effects)
    times, temperature, xi = rig.clock.times, s[0], s[-1]
    stored = 0.0
    for k in range(times.size - 1):
        actuator.command = float(run.command[k])
        mid = (temperature[k + 1] + temperature[k]) / 2, (xi[k + 1] + xi[k]) / 2
        stored += actuator.heat.heat_capacity(mid[1]) * (temperature[k + 1] - temperature[k])
        stored -= actuator.heat.latent * (xi[k + 1] - xi[k])
    flows = []
    for k in range(times.size):
        net = []
        for command in (run.command[max(k - 1, 0)], run.command[k]):
            actuator.command = float(command)
            power = actuator.electricity.power(float(command), temperature[k], xi[k], 0.0)[0]
            net.append(power - actuator.heat.loss(times[k], temperature[k], 0.0))
        flows.append(net)
    put_in = sum((a[1] + b[0]) / 2 * SHORT.step for a, b in pairwise(flows))
    whole = sum(abs(a[1]) * SHORT.step for a in flows)
    assert xi.min() < 0.5
    assert abs(stored - put_in) < 2e-3 * whole


def test_the_base_is_the_reference() -> None:
    """With no effect: the event-located integration of `studies.reference`, which shares no code with this one."""
    rig, run = _short("dead_weight")
    area = rig.wire.area
    there = DeadWeightParameters(
        diameter=rig.wire.wire_diameter,
        damping=100.0,
        resistance_martensite=76e-8 / area,
        resistance_austenite=84e-8 / area,
    )
    starts = [0, *(np.flatnonzero(np.diff(run.command)) + 1)]
    ends = [*starts[1:], SHORT.count - 1]
    segments = [(e * SHORT.step, float(run.command[k]), 0.64) for k, e in zip(starts, ends, strict=True)]
    reference = simulate_dead_weight(there, segments, SHORT.times, rtol=1e-8)
    here = simulate(rig, rig.wire, run, {})
    assert np.abs(here[2] - reference["position"]).max() < 1e-6
    assert np.abs(here[-1] - reference["martensite_fraction"]).max() < 1e-5


def _path_dependence(rig: Rig, run: Run, effects: dict[str, float]) -> float:
    """Largest distance over the stroke of the strain from eq. 4.51: (sigma - theta_T (T - T_inf))/E(xi) + eps_L xi, less its value at the start."""
    w, load = rig.wire, actuator_of(rig, rig.wire, run, {}).load
    temperature, stress, position, xi = simulate(rig, w, run, effects)[[0, 1, 2, -1]]
    strain = -load.ratio * (position - position[0]) / w.wire_length
    modulus = w.young_modulus_austenite + xi * (w.young_modulus_martensite - w.young_modulus_austenite)
    state = (stress - w.thermal_modulus * (temperature - w.ambient_temperature)) / modulus + w.recoverable_strain * xi
    assert np.ptp(xi) > 0.5
    return float(np.abs(strain - (state - state[0])).max() / np.ptp(strain))


@pytest.mark.parametrize("name", ["arm", "dead_weight"])
def test_with_the_whole_mismatch_the_strain_depends_on_the_state_alone(name: str) -> None:
    """The rate form has a way of its own."""
    rig, run = _short(name)
    assert _path_dependence(rig, run, {"elastic_mismatch": 1.0}) < 1e-5 < 1e-3 < _path_dependence(rig, run, {})


def test_strain_and_fraction_belong_together_where_the_largest_drift_turns_back() -> None:
    """A branch that turns back unseen moves the wire and not its fraction: the power is cut in the middle of the range."""
    rig, run = _short("dead_weight")
    high = float(run.command.max())
    cut = replace(run, command=SHORT.levels((0.116, high), (0.884, 0.4 * high))[:61])
    effects = {"elastic_mismatch": 1.0, "transformation_drift": EFFECTS["transformation_drift"].largest}
    assert _path_dependence(replace(rig, clock=replace(SHORT, count=61)), cut, effects) < 1e-4


def test_effects_of_zero_are_none() -> None:
    for name in ("dead_weight", "coupon"):
        rig, run = _short("dead_weight") if name == "dead_weight" else (RIGS[name], RIGS[name].runs(RIGS[name].wire)[0])
        if name == "dead_weight":
            run, rig = replace(run, command=run.command[:41]), replace(rig, clock=replace(SHORT, count=41))
        nothing = show(rig, rig.wire, run, dict.fromkeys(EFFECTS, 0.0))
        assert np.array_equal(nothing, show(rig, rig.wire, run, {}))


@pytest.mark.parametrize(
    "name", [n for n in EFFECTS if applies(n, "dead_weight") or n in ("slack", "stress_rate_share")]
)
def test_the_fraction_stays_in_its_bounds_under_every_effect(name: str) -> None:
    rig, run = _short("dead_weight" if applies(name, "dead_weight") else "arm")
    run = replace(run, command=1.2 * run.command[:31])
    xi = simulate(replace(rig, clock=replace(SHORT, count=31)), rig.wire, run, {name: EFFECTS[name].first})[-1]
    assert xi.min() >= 0
    assert xi.max() <= 1
    assert xi.min() < 0.9


def test_curves_go_from_one_to_zero_with_the_slope_they_say() -> None:
    parts = ((0.6, 0.0, 1.0), (0.2, -1.0, 3.0), (0.2, 0.9, 0.8))
    for curve in (Curve(), Curve(parts, asymmetry=0.7), Curve(bump=2.0)):
        assert curve.at(curve.low)[0] == pytest.approx(1)
        assert curve.at(curve.high)[0] == pytest.approx(0, abs=1e-12)
        for z in np.linspace(curve.low + 0.01, curve.high - 0.01, 37):
            numeric = (curve.at(z + 1e-6)[0] - curve.at(z - 1e-6)[0]) / 2e-6
            assert curve.at(float(z))[1] == pytest.approx(numeric, abs=1e-5)


def test_a_pause_transforms_nothing_and_heating_goes_on_to_the_end() -> None:
    """Row M16: half a heating, a retreat, and the rest of it."""
    rig = replace(RIGS["coupon"], clock=Clock(1.0, 1, 301))
    path = np.interp(rig.clock.times, [0, 100, 150, 300], [30.0, 85.5, 75.0, 120.0])
    run = Run("pause", "fit", path, np.full(301, 100e6))
    shown = show(rig, rig.wire, run, {})
    assert np.ptp(shown[100:150]) < 4e-4  # the thermal term alone
    assert shown[-1] == pytest.approx(-0.04, abs=2.5e-3)


def test_a_case_is_as_strong_as_it_says() -> None:
    """Measured anew on the written truth, for the three strengths of a case."""
    for number, strength in enumerate((1.0, 3.0, 10.0)):
        case = Case("coupon", ("smooth_transformation",), strength, number)
        found = truth(case)
        assert not found.found["smooth_transformation"].capped
        measured = Ruler(found.rig, found.wire).strength(found.effects)
        assert measured == pytest.approx(strength, rel=0.2)
        # The search begins each refit where the one before came to.
        assert measured == pytest.approx(found.together, rel=0.05)


def test_coefficients_of_any_size_lie_in_their_ranges_and_their_strength_is_not_told(tmp_path) -> None:
    found = of_any_size(cases(1))
    assert len({(case.rig, case.effects, case.number if not case.effects else 0) for case in found}) == len(found)
    for case in [one for one in found if one.rig == "coupon"][::4]:
        for name, coefficient in truth(case).effects.items():
            shares = sorted([EFFECTS[name].first / EFFECTS[name].largest, 1.0])
            assert shares[0] <= coefficient / EFFECTS[name].largest <= shares[1]
    case = next(one for one in found if one.effects == ("creep",) and one.rig == "coupon")
    assert case.name == "coupon-creep-any-102"
    write(case, tmp_path)
    told = json.loads((tmp_path / "truth" / f"{case.name}.json").read_text())
    assert (told["strength_asked"], told["strength_together"], told["effects"]["creep"]["strength"]) == (
        None,
        None,
        None,
    )


def test_a_case_is_the_same_each_time(tmp_path) -> None:
    case = Case("coupon", ("eccentric_encoder",), 3.0, 1)
    for folder in ("one", "two"):
        write(case, tmp_path / folder)
    one, two = (sorted((tmp_path / f).rglob("*.*")) for f in ("one", "two"))
    assert [p.name for p in one] == [p.name for p in two]
    assert all(a.read_bytes() == b.read_bytes() for a, b in zip(one, two, strict=True) if a.is_file())
    told = json.loads((tmp_path / "one" / "truth" / f"{case.name}.json").read_text())
    assert told["kind"] == "outside"
    assert list(told["effects"]) == ["eccentric_encoder"]
    assert not any("truth" in p.name for p in (tmp_path / "one" / case.name).iterdir())


@pytest.mark.parametrize("name", sorted(RIGS))
def test_a_log_has_the_times_and_commands_of_the_simulation(name: str) -> None:
    rig = RIGS[name]
    for run in rig.runs(rig.wire):
        text = table_text(rig, run, np.zeros(rig.clock.count))
        logged = np.loadtxt(text.splitlines()[1:], delimiter=",")
        np.testing.assert_allclose(logged[:, 0], rig.clock.times, rtol=0, atol=1e-9 * rig.clock.seconds)
        np.testing.assert_allclose(logged[:, 1], run.command, rtol=1e-5)


def test_an_absorbed_case_is_another_value_of_the_unknowns() -> None:
    """Gain of the voltage and loss to the ends: the same readings as other h_c and c_p without them."""
    rig, run = _short("arm")
    run, rig = replace(run, command=1.1 * run.command[:61]), replace(rig, clock=replace(SHORT, count=61))
    w, effects = rig.wire, {"input_gain": 0.05, "end_conduction": 0.01}
    assert all(absorbed(name, "arm") for name in effects)
    loss = w.convection_coefficient + 0.01 / (w.wire_length * w.surface)
    other = replace(w, convection_coefficient=loss / 1.05**2, specific_heat=w.specific_heat / 1.05**2)
    shown, without = show(rig, w, run, effects), show(rig, other, run, {})
    assert np.ptp(shown) > 10 * rig.noise
    assert np.abs(shown - without).max() < 1e-3 * rig.noise


def test_enough_cases_of_each_kind() -> None:
    every = cases()
    assert len({case.name for case in every}) == len(every) >= 200
    kinds = Counter(case.kind for case in every)
    assert kinds["null"] >= 100
    assert kinds["pair"] >= 30
    assert kinds["triple"] >= 20
    assert kinds["outside"] >= 20
    assert kinds["absorbed"] >= 10
    foreign = {EFFECTS[name].group for name in EFFECTS if EFFECTS[name].outside}
    assert foreign >= {"heat", "electrical", "kinetics", "constitutive", "mechanics", "sensor"}


def test_cases_drawn_anew_ask_the_same_of_other_wires() -> None:
    before, anew = cases(), cases(1)
    assert not {case.name for case in before} & {case.name for case in anew}
    assert [(case.rig, case.effects, case.strength) for case in before] == [
        (case.rig, case.effects, case.strength) for case in anew
    ]
    for one, other in list(zip(before, anew, strict=True))[::50]:
        assert true_wire(one) != true_wire(other)


def test_every_true_value_lies_inside_the_bounds_and_off_the_start() -> None:
    for case in cases()[:120:7]:
        wire, nominal = true_wire(case), RIGS[case.rig].wire
        for name in RIGS[case.rig].unknowns:
            there, start = getattr(wire, name), getattr(nominal, name)
            assert there != start
            assert abs(there - start) < (8 if name.endswith(("start", "finish")) else 0.26 * start)
        assert wire.austenite_start > wire.martensite_finish


def test_states_are_only_those_that_the_effects_need() -> None:
    rig = RIGS["arm"]
    assert rig.load is not None
    plain = Actuator(rig.wire, rig.load(0.0), {"coulomb_friction": 0.0}, 10.0, 7.0, 1e8)
    assert "friction" not in plain.names
    assert "friction" in Actuator(rig.wire, rig.load(0.0), {"coulomb_friction": 0.1}, 10.0, 7.0, 1e8).names


@pytest.mark.parametrize(
    "effects", [{"transformation_drift": 2.0}, {"input_delay": 0.6}, {"rate_dependence": 0.17}, {"creep": 0.01}]
)
def test_a_coupons_strain_does_not_depend_on_how_finely_it_is_summed(
    effects: dict[str, float], monkeypatch: pytest.MonkeyPatch
) -> None:
    """A drift counts what is transformed up to now, and a delayed oven and a late temperature turn between two samples: with four parts a sample they were off by one noise and more."""
    rig = RIGS["coupon"]
    (run,) = (one for one in rig.runs(rig.wire) if one.name == "inner")
    shown = []
    for parts in (4, 32):
        monkeypatch.setattr(coupon, "SUBSTEPS", parts)
        shown.append(coupon.strain(rig.wire, rig.clock.times, run, effects))
    assert np.abs(shown[0] - shown[1]).max() < rig.noise
    assert np.sqrt(np.mean((shown[0] - shown[1]) ** 2)) < 0.1 * rig.noise
