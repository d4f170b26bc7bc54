"""The least times: nothing is quicker than the largest command, what it does not reach is unreachable, and switching settles soon after."""

from __future__ import annotations

import json

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from smajax.control.figures_of_merit import band_of
from smajax.control.least_time import least_reach_times
from smajax.model.rigs import arm
from smajax.model.system import System
from smajax.simulation.simulate import simulate
from studies.time_optimal.bang import PERIOD, switched_voltage, switching_times
from studies.time_optimal.direct import settled_directly
from studies.time_optimal.run import HERE, MARK, SWUNG_TO, table

TARGETS = np.radians([-20.0, 20.0, 60.0])
DT = 0.01


@eqx.filter_jit
def _positions(system: System, voltages: jax.Array) -> jax.Array:
    return jax.vmap(lambda one: simulate(system, {"voltage": one}, DT).position)(voltages)


def test_no_other_command_is_there_earlier() -> None:
    """128 commands in pieces of 0.1 s: random, full with a pause anywhere, and full."""
    draw, pieces = np.random.default_rng(0), 15
    random = draw.uniform(0.0, 10.0, (64, pieces))
    paused = np.where(draw.random((63, pieces)) < 0.1, draw.uniform(0.0, 10.0, (63, pieces)), 10.0)
    commands = np.repeat(np.concatenate([random, paused, np.full((1, pieces), 10.0)]), 10, axis=1)
    positions = np.asarray(_positions(arm(), jnp.asarray(commands)))
    least = least_reach_times(arm(), TARGETS, 10.0, 2.0, DT)
    for target, time in zip(TARGETS, least, strict=True):
        there = positions >= target - float(band_of(arm()))
        first = np.where(there.any(axis=1), there.argmax(axis=1) * DT, np.inf)
        assert first.min() == pytest.approx(time, abs=1e-9) == first[-1]


def test_what_the_largest_command_does_not_reach_is_unreachable() -> None:
    assert np.isinf(least_reach_times(arm(), TARGETS, 6.0)).all()
    assert np.isfinite(least_reach_times(arm(), TARGETS, 10.0, 2.0)).all()


def test_two_switches_settle_soon_after_the_least_time() -> None:
    least = float(least_reach_times(arm(), np.radians([20.0]), 10.0)[0])
    settled, full, pause = switching_times(arm(), 20.0, 10.0, least, 4.0)
    assert least <= settled < least + 0.2
    assert full < least
    assert pause < 0.5


def test_the_stored_times_are_in_order_and_in_the_table() -> None:
    rows = json.loads((HERE / "results.json").read_text(encoding="utf-8"))["rows"]
    swung = [row for row in rows if row["set_point_deg"] in SWUNG_TO]
    assert swung
    assert all(row["settle_by_switching_s"] is None for row in swung)
    for row in rows:
        if row["settle_by_switching_s"] is not None:
            assert row["settle_by_switching_s"] >= row["reach_s"] - 1e-9
    assert (HERE / "README.md").read_text(encoding="utf-8").split(MARK)[1].strip() == table(rows)


def test_the_commands_of_the_direct_optimisation_settle_when_the_record_says() -> None:
    """Simulated again; never before the least time to be there, and at most one of its samples after the time by switching."""
    rows = json.loads((HERE / "results.json").read_text(encoding="utf-8"))["rows"]
    found = [row for row in rows if row.get("voltages")]
    assert len(found) == 8
    assert {row["set_point_deg"] for row in rows} - {row["set_point_deg"] for row in found} == {85.0, *SWUNG_TO}
    longest = max(len(row["voltages"]) * row["samples_a_voltage"] for row in found)
    series = [np.repeat(row["voltages"], row["samples_a_voltage"]) for row in found]
    padded = jnp.asarray([np.pad(one, (0, longest - len(one)), mode="edge") for one in series])
    runs = np.degrees(
        np.asarray(eqx.filter_jit(jax.vmap(lambda one: simulate(arm(), {"voltage": one}, PERIOD).position))(padded))
    )
    for row, voltages, degrees in zip(found, series, runs, strict=True):
        assert 0.0 <= min(voltages) <= max(voltages) <= row["limit_V"]
        off = np.abs(degrees[: len(voltages)] - row["set_point_deg"]) > 1.0
        settled = (np.flatnonzero(off)[-1] + 1) * PERIOD
        assert settled == pytest.approx(row["settle_directly_s"], abs=1e-9)
        assert (len(voltages) - 1) * PERIOD - settled > 1.0
        assert (
            row["reach_s"] - 1e-9
            <= settled
            <= min(row["reach_s"] + 0.055, row["settle_by_switching_s"] + PERIOD + 1e-9)
        )


@pytest.mark.slow  # half a minute
def test_direct_optimisation_settles_sooner_than_switching() -> None:
    """-10 degrees under 10 V, where the searched pair of times is far from the best."""
    (row,) = (
        one
        for one in json.loads((HERE / "results.json").read_text(encoding="utf-8"))["rows"]
        if (one["set_point_deg"], one["limit_V"]) == (-10.0, 10.0)
    )
    start = switched_voltage(arm(), -10.0, 10.0, row["full_until_s"], row["pause_s"], 4.0)
    settled, shares = settled_directly(arm(), -10.0, 10.0, row["reach_s"], row["settle_by_switching_s"], start)
    assert settled < row["reach_s"] + 0.05
    assert shares.min() >= 0.0
    assert shares.max() <= 1.0
