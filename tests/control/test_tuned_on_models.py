"""What gains tuned on several models have in common: set points that all of them reach, and one pool of gains."""

from __future__ import annotations

import dataclasses

import pytest

import smajax as sma
from smajax.control.gains_file import Gains
from smajax.control.kept_plant import with_limit
from smajax.control.presets import CONTROLLERS
from smajax.control.reach import out_of_reach, reach_of, shared_set_points
from smajax.control.tune.settings import settings_for
from smajax.control.tune.tuning import best_gains
from smajax.control.tuned_on_models import QUICK, tuned_on_models
from smajax.data.model_file.of_presets import model_of_presets
from smajax.model.system import System

LIMIT = 12.0  # V, at which the wire transforms whole


def bench(recoverable_strain: float) -> System:
    system = sma.compose("flexinol_table_3_2", "dead_weight", "voltage")
    changed = sma.set_parameters(system, {"recoverable_strain": recoverable_strain, "load_mass": 0.3})
    return with_limit(changed, LIMIT)


def test_default_set_points_are_within_the_reach_of_every_model() -> None:
    long, short = bench(0.05), bench(0.03)
    found = shared_set_points([long, short], 3)
    assert found == shared_set_points([short, long], 3)
    assert list(found) == sorted(found)
    for system in (long, short):
        assert out_of_reach(reach_of(system), system, found) == []
    alone = shared_set_points([long], 3)
    assert alone[-1] > found[-1]
    assert out_of_reach(reach_of(short), short, alone) == [alone[-1]]


def test_a_set_point_that_one_model_does_not_reach_is_said_before_the_search() -> None:
    preset = model_of_presets("flexinol_table_3_2", "dead_weight", "voltage")
    low = dataclasses.replace(preset.parameters["amplifier_limit"], value=2.0, origin="given")
    model = dataclasses.replace(preset, parameters={**preset.parameters, "amplifier_limit": low})
    with pytest.raises(
        ValueError, match=r"base model: The set point 20 mm is out of reach of every controller: with up to 2 V"
    ):
        tuned_on_models({"base model": model}, ("plant", model), "pid", [20.0], effort=QUICK)


def test_of_a_pool_the_gains_that_cost_least_on_this_plant_are_taken() -> None:
    system = bench(0.04)
    settings = settings_for(
        system, "pid", set_points=shared_set_points([system], 1), tried=2, starts=1, rounds=1, finish=0, unseen=1
    )
    box = CONTROLLERS["pid"].box_on(system)
    weak = Gains("pid", {name: low for name, (low, _) in box.items()})
    usual = Gains("pid", {name: float((low * high) ** 0.5) for name, (low, high) in box.items()})
    for pool in ([weak, usual], [usual, weak]):
        assert best_gains(system, settings, pool) == pytest.approx(usual.values, rel=1e-5)
