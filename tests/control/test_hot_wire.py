"""A wire that gets hotter than it may: a note on a run, and no limit of a controller is raised for it."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr

from smajax.control.found_notes import notes_of_run
from smajax.control.position_unit import unit_of
from smajax.control.reach import Reach, higher_limit, reach_of
from smajax.control.run_notes import AboveAnnealing, AboveMelting
from smajax.core.parameters import set_parameters
from smajax.data.experiment.magnitude import ANNEALS
from smajax.model.presets import build
from smajax.report.note_words import note_sentences

PLANT = set_parameters(build("flexinol_table_3_2", "dead_weight", "voltage"), {"amplifier_limit": 20.0})


def _run(hottest: float) -> xr.Dataset:
    return xr.Dataset({"temperature": ("time", np.array([20.0, hottest])), "stress": ("time", np.array([0.0, 1e8]))})


@pytest.mark.parametrize(
    ("hottest", "noted"), [(0.9 * ANNEALS, None), (430.0, AboveAnnealing(430.0)), (2e3, AboveMelting(2e3))]
)
def test_a_wire_that_anneals_is_noted_once(hottest: float, noted: object) -> None:
    notes = notes_of_run(_run(hottest))
    assert notes == ([] if noted is None else [noted])
    if isinstance(noted, AboveAnnealing):
        (said,) = note_sentences(notes)
        assert said.startswith(
            "The wire reaches 430 degC: a trained nickel-titanium wire is annealed from about 300 degC on"
        )


def test_the_reach_says_how_hot_the_wire_is_with_the_largest_command() -> None:
    reach = reach_of(set_parameters(PLANT, {"amplifier_limit": 8.0}))
    assert reach is not None
    assert 60.0 < reach.hottest < ANNEALS
    hot = reach_of(PLANT)
    assert hot is not None
    assert hot.hottest > ANNEALS


@pytest.mark.parametrize(("a_volt", "raised"), [(20.0, True), (60.0, False)])
def test_a_limit_is_not_raised_to_where_the_wire_anneals(a_volt: float, raised: bool) -> None:
    """2 mm a volt, up to `a_volt` degC a volt: 12 mm need 6 V, which is 120 or 360 degC."""

    def reach_with(values: dict[str, float]) -> Reach:
        volts = values.get("largest_voltage", 4.0)
        return Reach(0.0, 2.0 * volts, volts, unit_of(PLANT), False, ("largest_voltage",), a_volt * volts)

    found = higher_limit(reach_with({}), PLANT, (4.0, 12.0), reach_with)
    assert bool(found) == raised
