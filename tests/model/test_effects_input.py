"""Effects of the input's time and level against the input that is shifted by hand."""

from __future__ import annotations

from typing import Any

import jax.numpy as jnp
import numpy as np
import pytest

from smajax.control.closed_loop import simulate_closed_loop
from smajax.control.presets import CONTROLLERS
from smajax.model.drive.inputs import switched
from smajax.model.extended import extended
from smajax.model.presets import build
from smajax.model.rigs import arm
from smajax.simulation.batch.axes import grid
from smajax.simulation.batch.run_batch import run_batch
from smajax.simulation.compiled import simulate_compiled
from smajax.simulation.input_delay import acting_inputs
from tests.helpers.effect_rigs import DT, RIGS, levels, settled


def test_a_delay_of_whole_and_of_half_steps_is_the_shifted_input() -> None:
    system, channel, top = RIGS["dead_weight"]
    inputs = levels(channel, top)
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


def test_a_delay_of_a_coupon_shifts_its_temperature_and_not_its_stress() -> None:
    coupon = build("flexinol_isobaric", "coupon", "none")
    time = DT * np.arange(400)
    inputs: dict[str, Any] = {
        "temperature": 70.0 - 50.0 * np.cos(0.35 * time),
        "stress": 120e6 + 20e6 * np.sin(0.8 * time),
    }
    late = simulate_compiled(extended(coupon, ("input_delay",), {"input_delay.delay": 2.5 * DT}), inputs, DT)
    # The recorded samples act in the middle of the steps: what two steps of half the length give, through each of them.
    halves = 0.5 * DT * np.arange(799)
    acted = np.interp(halves - 2.5 * DT, time, inputs["temperature"])
    moved = simulate_compiled(
        coupon, {"temperature": acted, "stress": np.interp(halves, time, inputs["stress"])}, 0.5 * DT
    )
    np.testing.assert_allclose(late.strain, moved.strain[::2], rtol=0.0, atol=1e-9)
    assert np.ptp(moved.martensite_fraction) > 0.5


def test_a_slow_clock_is_a_growing_delay() -> None:
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
    inputs = levels(channel, top)
    level = {"input_level.gain": 0.1, "input_level.offset": 0.3}
    found = simulate_compiled(extended(system, ("input_level",), level), inputs, DT)
    acted = simulate_compiled(system, {channel: 1.1 * inputs[channel] + 0.3}, DT)
    np.testing.assert_allclose(found.reading, acted.reading, rtol=0.0, atol=1e-12)
    # A duty below zero would cool.
    low = settled("input_level", {"offset": -0.2}, "bias_spring", duty=0.1)[1]
    assert low.temperature == pytest.approx(22.0, abs=1e-9)


def test_a_batch_delays_its_inputs_too_and_a_closed_loop_refuses() -> None:
    system, channel, top = RIGS["dead_weight"]
    inputs, late = levels(channel, top), extended(system, ("input_delay",))
    found = run_batch(late, inputs, grid({"input_delay.delay": [0.0, 4 * DT]}), dt=DT)
    single = simulate_compiled(extended(system, ("input_delay",), {"input_delay.delay": 4 * DT}), inputs, DT)
    np.testing.assert_allclose(found["position"][1], single.position, rtol=0.0, atol=1e-12)
    plant = arm()
    with pytest.raises(ValueError, match=r"input_delay.*leave"):
        simulate_closed_loop(extended(plant, ("input_delay",)), CONTROLLERS["pid"].make(plant), jnp.full(11, 0.1), 0.01)
