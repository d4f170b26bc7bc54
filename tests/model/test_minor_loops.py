"""The way back of a loop that is not full: earlier by a share of the range, whichever loop that is most for."""

from __future__ import annotations

import dataclasses

import jax.numpy as jnp
import numpy as np
import pytest

from smajax.model.effects.library import LIBRARY
from smajax.model.extended import extended
from smajax.model.system import initial_state
from smajax.simulation.compiled import simulate_compiled
from tests.model.test_effects_material import COUPON, DT, _inputs, _ramps


def test_a_small_loop_begins_its_way_back_earlier_and_a_full_one_where_it_did():
    inputs = _inputs(temperature=_ramps(20.0, 110.0, 55.0, 110.0, 20.0), stress=np.full(360, 60e6))
    plain = simulate_compiled(COUPON, inputs, DT)
    on = {"minor_loops.heating_shift": 0.5, "minor_loops.cooling_shift": 0.5}
    run = simulate_compiled(extended(COUPON, ("minor_loops",), on), inputs, DT)
    half_cooled = float(plain.martensite_fraction[179])
    assert 0.2 < half_cooled < 0.8
    for whole in (slice(0, 180), slice(270, 360)):
        np.testing.assert_allclose(run.martensite_fraction[whole], plain.martensite_fraction[whole], atol=1e-12)
    law, back = COUPON.wire.kinetics, slice(180, 270)
    at = [
        np.interp(-half_cooled / 2, -one.martensite_fraction[back], inputs["temperature"][back]) for one in (plain, run)
    ]
    earlier = 0.5 * (1.0 - half_cooled) * float(law.austenite_finish - law.austenite_start)
    assert at[0] - at[1] == pytest.approx(earlier, abs=0.05)


def test_a_small_loop_may_end_where_the_full_one_does_and_the_smallest_be_shifted_least():
    inputs = _inputs(temperature=_ramps(20.0, 110.0, 55.0, 110.0, 20.0), stress=np.full(360, 60e6))
    plain = simulate_compiled(COUPON, inputs, DT)
    on = {"minor_loops.heating_shift": 0.125, "minor_loops.small": 1.0, "minor_loops.pinned": 1.0}
    run = simulate_compiled(extended(COUPON, ("minor_loops",), on), inputs, DT)
    left, back = float(plain.martensite_fraction[179]), slice(180, 270)
    law = COUPON.wire.kinetics
    width, early = float(law.austenite_finish - law.austenite_start), 0.125 * 4.0 * (1.0 - left) * left

    def reached(one, fraction):
        return np.interp(-fraction, -one.martensite_fraction[back], inputs["temperature"][back])

    start = float(law.austenite_start) + 60e6 / float(law.stress_slope_austenite)
    for share in (0.9, 0.5, 0.1):  # of what was left: the range begins e earlier and ends where it did
        z = (reached(plain, share * left) - start) / width
        assert reached(run, share * left) == pytest.approx(start + width * (z * (1.0 + early) - early), abs=0.05)


@pytest.mark.parametrize("small", [0.0, 0.3, 0.5, 0.7, 1.0])
def test_the_shift_of_minor_loops_is_that_of_the_loop_that_is_shifted_most(small: float) -> None:
    effect = LIBRARY["minor_loops"](heating_shift=0.2, small=small)
    old = initial_state(COUPON, {"temperature": jnp.asarray(20.0), "stress": jnp.asarray(60e6)})
    start, turned = jnp.zeros(()), np.linspace(0.0, 1.0, 501)
    shifts = [
        float(
            effect.heating_distance(
                COUPON.wire.kinetics, start, start, start, dataclasses.replace(old.wire, xi_M=jnp.asarray(one))
            )
        )
        for one in turned
    ]
    assert max(shifts) == pytest.approx(0.2, rel=1e-4)
    assert min(shifts) >= 0.0
    assert shifts[-1] == 0.0  # a full cycle
