"""Where fits of sets of effects begin."""

from __future__ import annotations

import numpy as np

from smajax.attribution.laplace_evidence import fitted_model
from smajax.attribution.set_starts import as_fitted_before
from smajax.attribution.traces import Variant, traces_at
from tests.helpers.hot_weight import NOISE, UNKNOWNS, hot_weight


def test_a_shape_in_the_place_of_another_begins_as_it_was_fitted_before_too() -> None:
    """The temperatures of a wire with the one are not those with the other."""
    old, new, beside = "smooth_transformation", "two_part_transformation", "radiation"
    search = hot_weight({}, (old, new, beside))
    joint, slots = search.joint, search.joint.slots
    here, there = joint.problem.start_values(), joint.problem.start_values()
    here[slots[f"{old}.weight"]], here[slots[f"{beside}.emissivity"]] = 1.0, 0.4
    there[slots[UNKNOWNS[0]]] *= 1.1
    there[slots[f"{new}.heating_weight"]] = 0.6
    present = fitted_model(joint, (old, beside), here, (old, new, beside))
    alone = fitted_model(joint, (new,), there, (old, new, beside))
    traces = traces_at(joint, present, search.extent)
    subset = frozenset({Variant(new, -1), Variant(beside, -1)})
    (point,) = as_fitted_before(joint, subset, traces, [present, alone], NOISE)
    assert point[slots[f"{beside}.emissivity"]] == 0.4
    point[slots[f"{beside}.emissivity"]] = there[slots[f"{beside}.emissivity"]]
    np.testing.assert_array_equal(point, there)
    assert not as_fitted_before(joint, subset, traces, [present], NOISE)  # it was not fitted before
    with_both = frozenset({Variant(old, -1), Variant(new, -1), Variant(beside, -1)})
    assert not as_fitted_before(joint, with_both, traces, [present, alone], NOISE)  # it replaces none
