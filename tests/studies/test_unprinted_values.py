"""What the source does not print: the figures use what the record of the searches has, and the searches see what the figures do."""

from __future__ import annotations

import json
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from smajax.control import presets
from smajax.model.rigs import arm
from studies.source import m12_spread_of_trials, m14_net_fraction, uneven_wire, unloading, unprinted
from studies.source.m13_mass_removed_and_put_back import MEAN, NEAR
from studies.unprinted import backstepping, dead_weight, sliding

STUDIES = Path(__file__).parents[2] / "studies"
RECORD: dict[str, Any] = json.loads((STUDIES / "unprinted" / "values.json").read_text(encoding="utf-8"))
USED = {
    "dead_weight": unprinted.DEAD_WEIGHT,
    "sliding": unprinted.SLIDING,
    "surface": unprinted.SURFACE,
    "layer": unprinted.LAYER,
    "backstepping": unprinted.BACKSTEPPING,
}


def kept(name: str) -> dict[str, float]:
    folder = STUDIES / ("chapter3" if name[0] == "M" else "chapter4")
    numbers: dict[str, float] = json.loads((folder / f"{name}.json").read_text(encoding="utf-8"))["numbers"]
    return numbers


@pytest.mark.parametrize("name", USED)
def test_the_figures_use_the_values_of_the_record(name: str) -> None:
    found = RECORD[name]["values"]
    assert {one: USED[name][one] for one in found} == found
    # The one value that is from a handbook and not fitted.
    assert USED[name].keys() - found.keys() <= {"convection_slope"}


@pytest.mark.parametrize("volts", [4, 8, 12, 16])
def test_the_closed_form_of_the_dead_weight_is_what_the_simulator_does(volts: int) -> None:
    """Two ways to the same steady wire: its pieces simulated for 30 s, and each piece's heat balance solved."""
    values = unprinted.DEAD_WEIGHT
    left, hottest = dead_weight.left_at(
        float(volts), uneven_wire.kept_heat(), values["amplifier_gain"], values["largest_current"]
    )
    simulated = kept("M11")
    assert abs(left - simulated[f"fraction_{volts}_V"]) < 1e-3
    if volts == 16:
        assert abs(hottest - simulated["hottest_piece_C"]) < 0.5


def test_the_quotes_of_the_dead_weight_are_met_in_the_figures() -> None:
    figures = kept("M11") | kept("M13")
    assert abs(figures["fraction_4_V"] - dead_weight.LEFT_AT_4_V) < 0.005
    assert abs(figures["net_96 g_mm"] - MEAN) < 0.02
    assert figures["hottest_piece_C"] < dead_weight.HOTTEST
    assert abs(figures["fraction_before"] - dead_weight.LEFT_AT_16_V) < 0.002
    assert figures["volts_from_5_to_95_percent"] > dead_weight.LEAST_SPAN
    assert dead_weight.net(uneven_wire.Pieces(np.ones(1), np.ones(1)), 0.2, 0.096)[0] == 0.0, (
        "an even wire, transformed whole, has nothing left to shorten"
    )


def test_twice_as_many_pieces_of_the_wire_move_no_judged_number_by_a_tenth_of_its_limit() -> None:
    """M13 and M14: a piece that switches whole would be a step of the net shortening."""
    first, held, dt = 400, 200, 0.1
    lanes = [("96 g", 16.0), ("288 g", 16.0), ("96 g", 6.0)]
    masses = np.stack([unloading.mass_over_time(case, first, held) for case, _ in lanes])
    volts = np.array([[one] for _, one in lanes]) * np.ones(masses.shape[1])
    found = []
    for pieces in (uneven_wire.PIECES, 2 * uneven_wire.PIECES):
        run = uneven_wire.hung(volts, masses, dt, pieces=pieces)
        net = unloading.net_deflection(run.rise, first - 1)
        found.append((net, run.fraction[:, first - 1] - run.fraction[:, -1]))
    (net, carried), (finer_net, finer_carried) = found
    assert abs(finer_net - net)[0] < 0.1 * NEAR * MEAN
    assert abs(finer_net - net)[1] < 0.1 * 0.1  # M13 asks for 0.1 mm
    printed = 0.25 * m14_net_fraction.PRINTED
    assert abs(finer_carried - carried)[0] < 0.1 * printed
    assert abs(finer_net - net)[0] / m14_net_fraction.FULL_STROKE < 0.1 * printed
    ratio, finer_ratio = net / carried, finer_net / finer_carried
    assert np.abs(finer_ratio / ratio - 1.0).max() < 0.1 * 0.05  # M14 asks for 5 %


def test_as_many_pieces_as_the_figures_have_are_as_good_as_the_many_of_the_search() -> None:
    """In closed form, all that is judged; with a tenth of the pieces the same check fails."""

    def shortenings(pieces: int) -> np.ndarray:
        wire = uneven_wire.kept_heat(pieces=pieces)
        squared = uneven_wire.current(np.asarray(16.0)) ** 2
        return np.array([dead_weight.net(wire, float(squared), removed) for removed in (0.096, 0.192, 0.288)])

    many, limits = shortenings(dead_weight.PIECES), 0.1 * np.array([NEAR * MEAN, 0.25 * m14_net_fraction.PRINTED])
    assert (np.abs(shortenings(uneven_wire.PIECES) - many) < limits).all()
    assert not (np.abs(shortenings(uneven_wire.PIECES // 10) - many) < limits).all()


def test_only_the_distributions_that_are_said_to_meet_the_limits_do() -> None:
    """What the page of the searches says of the other ways to spread the heat."""
    tried = RECORD["dead_weight"]["tried"]
    _, at_left, at_hottest, at_span, at_widest = range(5)
    assert tried["columns"][1:] == list(dead_weight.SHOWN[1:])
    met = {
        name: [one for one in rows if one[at_hottest] < dead_weight.HOTTEST and one[at_span] > dead_weight.LEAST_SPAN]
        for name, rows in tried.items()
        if name != "columns"
    }
    assert {name: len(rows) for name, rows in met.items()} == RECORD["dead_weight"]["within_bounds"]
    # What the three trials had left: 24.02 and 23.52 of 24.75 mm at the outside.
    near = {name for name, rows in met.items() if any(0.029 < one[at_left] < 0.050 for one in rows)}
    assert near == {"normal, cut at 2.5", "normal, cut at 2"}
    # M12 is not to be had by another of them.
    assert max(one[at_widest] for rows in met.values() for one in rows) < m12_spread_of_trials.MIDDLE[0]


def test_the_gains_of_sliding_control_miss_no_sentence_but_the_overshoot() -> None:
    """By the figures' own numbers: C12 holds in part for that one."""
    missed = RECORD["sliding"]["missed"]
    assert {name for name, value in missed.items() if value > 0.0} == {"C12_overshoot_beyond"}
    assert RECORD["sliding"]["values"].keys() == sliding.BOX.keys()
    for name, (low, high) in sliding.BOX.items():
        assert low < RECORD["sliding"]["values"][name] < high
    assert kept("C12")["overshoot_beyond_deg"] < 1.0


def test_the_pair_of_backstepping_fulfils_every_sentence_that_its_figures_check() -> None:
    tried = RECORD["backstepping"]["tried"]
    assert len(tried) == len(backstepping.GRID)
    (best,) = [
        one
        for one in tried
        if {name: one[name] for name in RECORD["backstepping"]["values"]} == RECORD["backstepping"]["values"]
    ]
    assert all(best[sentence] for sentence in backstepping.SENTENCES)
    assert not all(one["inertia_does_not_degrade"] for one in tried), "a check that no pair fails checks nothing"
    assert abs(kept("C15")["overshoot_deg"] - best["overshoot_deg"][2]) < 0.5


def test_every_controller_of_the_figures_has_the_one_printed_limit() -> None:
    """Sec. 4.4.4: 10 V, "according to the hardware restrictions"."""
    system = arm()
    continuous: list[Callable[..., Any]] = [unprinted.sliding, unprinted.backstepping, unprinted.backstepping_searched]
    continuous += [
        unprinted.backstepping_by_stress,
        presets.pid,
        *(partial(presets.pid_tuned_at, degrees=at) for at in presets.PID_TUNED_AT),
    ]
    switches: list[Callable[..., Any]] = [
        presets.vsc1,
        unprinted.switch_with_a_layer,
        unprinted.switch_on_a_surface,
        presets.vsc3_of_section_4_6,
    ]
    assert {float(make(system).largest_voltage) for make in continuous} == {unprinted.HIGH_VOLTAGE}
    assert {float(make(system).high_voltage) for make in switches} == {unprinted.HIGH_VOLTAGE}
    assert float(presets.temperature_vsc(system).vsc.high_voltage) == unprinted.HIGH_VOLTAGE
