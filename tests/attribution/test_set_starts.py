"""Where fits of sets of effects begin."""

from __future__ import annotations

from typing import Any

import numpy as np

from smajax.attribution.laplace_evidence import fitted_model
from smajax.attribution.set_starts import as_fitted_before
from smajax.attribution.traces import Variant, traces_at
from tests.helpers.hot_weight import NOISE, UNKNOWNS, hot_weight


def test_a_shape_in_the_place_of_another_begins_as_it_was_fitted_before_too() -> None:
    """The temperatures of a wire with the one are not those with the other."""
    old, new, beside, more = "smooth_transformation", "two_part_transformation", "radiation", "latent_heat"
    search = hot_weight({}, (old, new, beside, more))
    joint, slots = search.joint, search.joint.slots
    here, there = joint.problem.start_values(), joint.problem.start_values()
    here[slots[f"{old}.weight"]], here[slots[f"{beside}.emissivity"]] = 1.0, 0.4
    there[slots[UNKNOWNS[0]]] *= 1.1
    there[slots[f"{new}.heating_weight"]] = 0.6
    there[slots[UNKNOWNS[1]]] = high = joint.bounds[UNKNOWNS[1]][1]
    present = fitted_model(joint, (old, beside), here, (old, new, beside, more))
    alone = fitted_model(joint, (new,), there, (old, new, beside, more))
    traces = traces_at(joint, present, search.extent)
    subset = frozenset({Variant(new, -1), Variant(beside, -1), Variant(more, -1)})
    start = np.array(here)
    start[slots[f"{more}.enthalpy"]] = 5e3  # what else is new, by the linear model
    (point,) = as_fitted_before(joint, subset, traces, start, [present, alone], NOISE)
    assert point[slots[f"{beside}.emissivity"]] == 0.4
    assert point[slots[f"{more}.enthalpy"]] == 5e3
    assert 0.99 * high < point[slots[UNKNOWNS[1]]] < high  # what begins on its bound stays there
    rest = [k for name, k in slots.items() if not name.startswith((beside, more)) and name != UNKNOWNS[1]]
    np.testing.assert_array_equal(point[rest], there[rest])
    assert not as_fitted_before(joint, subset, traces, start, [present], NOISE)  # it was not fitted before
    with_both = frozenset({Variant(old, -1), Variant(new, -1), Variant(beside, -1)})
    assert not as_fitted_before(joint, with_both, traces, start, [present, alone], NOISE)  # it replaces none


def test_it_is_the_likeliest_fit_of_some_of_the_set_with_the_new_shape() -> None:
    old, new, beside, other = "smooth_transformation", "two_part_transformation", "radiation", "latent_heat"
    candidates = (old, new, beside, other)
    search = hot_weight({}, candidates)
    joint, slots = search.joint, search.joint.slots

    def fitted(effects: tuple[str, ...], strain: float) -> Any:
        values = joint.problem.start_values()
        values[slots["recoverable_strain"]] *= strain
        for effect, name in ((new, "heating_weight"), (beside, "emissivity"), (other, "enthalpy")):
            if effect in effects:
                values[slots[f"{effect}.{name}"]] = 1e-3
        return fitted_model(joint, effects, values, candidates)

    present = fitted((old, beside), 1.0)
    traces = traces_at(joint, present, search.extent)
    subset = frozenset({Variant(new, -1), Variant(beside, -1)})
    near, far = fitted((new, beside), 1.01), fitted((new,), 1.2)
    others = [
        present,
        fitted((beside,), 1.0),
        fitted((new, other), 1.0),
    ]  # without the shape, and with what is not in the set
    for models in ([*others, near, far], [far, near, *others]):
        (point,) = as_fitted_before(joint, subset, traces, present.values, models, NOISE)
        assert point[slots["recoverable_strain"]] == near.values[slots["recoverable_strain"]]
    # A sensor's lag may stand in the place of a late input, which is no other shape of the same.
    alike = hot_weight({}, ("input_delay", "sensor_lag"))
    late = fitted_model(
        alike.joint, ("input_delay",), alike.joint.problem.start_values(), ("input_delay", "sensor_lag")
    )
    lag = fitted_model(alike.joint, ("sensor_lag",), alike.joint.problem.start_values(), ("input_delay", "sensor_lag"))
    its_traces = traces_at(alike.joint, late, alike.extent)
    assert (
        as_fitted_before(
            alike.joint, frozenset({Variant("sensor_lag", -1)}), its_traces, late.values, [late, lag], NOISE
        )
        == []
    )
