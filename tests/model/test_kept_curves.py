"""What a wire remembers of a curve that the conditions, the end of its range, or a filter's correction keep it from."""

from __future__ import annotations

import dataclasses

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from smajax.core.parameters import set_parameters
from smajax.model.system import initial_state
from smajax.model.types import WireState
from smajax.model.wire.branch_amplitude import UNKNOWN, Amplitudes, Corrected
from smajax.model.wire.kinetics import austenite_left, martensite_left
from smajax.model.wire.kinetics_terms import NO_TERMS
from tests.helpers.driven_coupon import COUPON, EACH, driven, under

AMPLITUDES = [field.name for field in dataclasses.fields(Amplitudes)]


@pytest.mark.parametrize("more", [6.9e6, 8e6, 20e6, 200e6])
@pytest.mark.parametrize("cold", [False, True])
def test_a_curve_that_the_conditions_kept_the_wire_from_stays_where_the_stress_returns(more: float, cold: bool) -> None:
    """By Liang's conditions: the stress goes past the point where the wire turned back, against the temperature, and returns."""
    system = under(COUPON, "liang")
    wire, level = system.wire.kinetics, 250e6
    shift, sign = level / 6.89e6, 1.0 if cold else -1.0
    turn = (47.0 if cold else 73.0) + shift
    temperature = [20.0, 140.0] if cold else [20.0]
    begun = len(temperature)
    temperature += [turn, turn + sign, turn + 2.0 * sign, turn + 7.0 * sign, turn + 0.1 * sign, turn - 2.0 * sign]
    stress = [level] * len(temperature)
    stress[begun + 1] += sign * more
    xi = np.asarray(driven(system, temperature, stress).martensite_fraction)[::EACH][begun:]
    left = austenite_left if cold else martensite_left
    there, after = (
        float(left(wire, NO_TERMS, jnp.asarray(one), jnp.asarray(level))) for one in (turn, temperature[-1])
    )
    np.testing.assert_allclose(xi[:5], 1.0 - there if cold else there, atol=1e-9)
    np.testing.assert_allclose(xi[5], 1.0 - after if cold else after, atol=1e-9)


@pytest.mark.parametrize("law", ["enhanced", "liang", "brinson"])
def test_a_wire_behind_the_end_of_a_range_has_no_curve_of_it(law: str) -> None:
    """Ranges that overlap under stress: it transforms above A_f', comes back into the heating range, and is heated again."""
    slopes = {"stress_slope_austenite": 12e6, "stress_slope_martensite": 5e6, "start_fraction": 0.0}
    crossed = set_parameters(under(COUPON, law), slopes)
    run = driven(crossed, [180.0, 115.0, 50.0, 102.0, 108.0, 112.0], [400e6] * 6)
    xi = np.asarray(run.martensite_fraction)
    assert 0.2 < xi[::EACH][4] < 0.3
    assert xi[-1] == pytest.approx(0.0, abs=1e-9)
    assert -np.diff(xi).min() < 0.03


@pytest.mark.parametrize("law", ["enhanced", "liang"])
def test_a_wire_that_starts_behind_the_end_of_a_range_goes_on_from_its_fraction(law: str) -> None:
    begun = set_parameters(under(COUPON, law), {"start_fraction": 0.5})
    level = 250e6
    shift = level / 6.89e6
    xi = np.asarray(driven(begun, [180.0, 73.0 + shift, 74.0 + shift, 90.0 + shift], [level] * 4).martensite_fraction)
    np.testing.assert_allclose(xi[: EACH + 1], 0.5)
    assert 0.25 < xi[2 * EACH] < 0.49
    assert xi[-1] == pytest.approx(0.0, abs=1e-9)
    assert -np.diff(xi).min() < 0.1


def _of_wire(state: WireState, **numbers: float) -> WireState:
    return dataclasses.replace(state, **{name: jnp.asarray(value) for name, value in numbers.items()})


@pytest.mark.parametrize("heating", [True, False])
@pytest.mark.parametrize("off", [-1e-6, 0.0, 1e-6, 0.1])
def test_a_corrected_wire_that_was_kept_from_a_curve_goes_on_from_where_it_is(heating: bool, off: float) -> None:
    """A filter's fraction tells no curve, however near it is: until the wire follows one, it is laid through the present state."""
    state = initial_state(COUPON, {"temperature": jnp.asarray(20.0), "stress": jnp.asarray(100e6)}).wire
    share, still = jnp.asarray(0.4), jnp.asarray(False)
    # The wire is at 0.5, on the curve through it, and was kept from one that begins at a fraction of 1 (ends at one of 0).
    amplitudes = {"xi_M": 1.25, "heating_missed": 1.0} if heating else {"xi_A": -0.25, "cooling_missed": 1.0}
    kept = _of_wire(state, martensite_fraction=0.5, **amplitudes)
    xi = 0.5 + off if heating else 0.5 - off

    def missed(amplitudes: Amplitudes) -> float:
        return float(amplitudes.heating_missed if heating else amplitudes.cooling_missed)

    def on_curve(amplitudes: Amplitudes, share: jax.Array) -> float:
        return float(amplitudes.xi_M * share if heating else 1.0 - (1.0 - amplitudes.xi_A) * share)

    after = Corrected().corrected(kept, still, share, share, jnp.asarray(xi))
    assert missed(after) == UNKNOWN
    # A curve that it is put short of is followed from where it crosses the fraction.
    assert on_curve(after, share) == pytest.approx(0.5 if off < 0.0 else xi, rel=1e-12)
    wire = _of_wire(kept, martensite_fraction=xi, **{name: float(getattr(after, name)) for name in AMPLITUDES})
    for other in (0.6, 0.9, 0.3):
        then = Corrected().renewed(wire, still, still, jnp.asarray(other), jnp.asarray(other), jnp.asarray(xi))
        assert missed(then) == UNKNOWN
        assert on_curve(then, jnp.asarray(other)) == pytest.approx(xi, rel=1e-12)
    followed = Corrected().renewed(wire, jnp.asarray(heating), jnp.asarray(not heating), share, share, jnp.asarray(xi))
    assert missed(followed) == 0.0


@pytest.mark.parametrize("heating", [True, False])
def test_a_wire_that_transforms_the_other_way_forgets_the_curve_that_it_was_kept_from(heating: bool) -> None:
    state = initial_state(COUPON, {"temperature": jnp.asarray(20.0), "stress": jnp.asarray(100e6)}).wire
    share = jnp.asarray(0.4)
    amplitudes = {"xi_M": 1.25, "heating_missed": 1.0} if heating else {"xi_A": -0.25, "cooling_missed": 1.0}
    kept = _of_wire(state, martensite_fraction=0.5, **amplitudes)
    there = jnp.asarray(0.6 if heating else 0.4)
    after = Corrected().renewed(kept, jnp.asarray(not heating), jnp.asarray(heating), share, share, there)
    assert float(after.heating_missed if heating else after.cooling_missed) == 0.0
    reached = after.xi_M * share if heating else 1.0 - (1.0 - after.xi_A) * share
    assert float(reached) == pytest.approx(float(there))
