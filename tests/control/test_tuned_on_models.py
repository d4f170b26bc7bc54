"""What gains tuned on several models have in common: set points that all of them reach, and one pool of gains."""

from __future__ import annotations

import dataclasses
from types import SimpleNamespace
from typing import Any

import pytest

import smajax as sma
from smajax.control.gains_file import Gains, fixed_parameters
from smajax.control.model_as_plant import with_limit, within_limit
from smajax.control.presets import CONTROLLERS
from smajax.control.reach import out_of_reach, reach_of, shared_set_points
from smajax.control.tune.settings import TuneSettings, settings_for
from smajax.control.tune.tuning import best_gains, problem_of
from smajax.control.tuned_on_models import QUICK, tuned_on_models
from smajax.core.parameters import parameter_values
from smajax.data.model_file.actuator_model import ActuatorModel
from smajax.data.model_file.of_presets import model_of_presets
from smajax.data.model_file.record import ModelOutput
from smajax.model.system import System


class EndedError(Exception):
    """In the place of the end of a comparison."""


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


def test_models_share_bounds_and_all_that_is_not_tuned(monkeypatch: pytest.MonkeyPatch) -> None:
    """Scaled to each model they would differ by some per cent, and the loops with them."""
    preset = model_of_presets("flexinol_table_3_2", "dead_weight", "flexinol_voltage")

    def model(convection: float) -> ActuatorModel:
        own = dataclasses.replace(preset.parameters["convection_coefficient"], value=convection, origin="given")
        return dataclasses.replace(
            preset,
            parameters={**preset.parameters, "convection_coefficient": own},
            outputs=(ModelOutput("position", "m", 1e-4, False),),
            fitted_range={"voltage": (0.0, 5.0)},
        )

    asked: list[tuple[System, TuneSettings]] = []

    def seen(system: System, settings: TuneSettings, **more: Any) -> SimpleNamespace:
        asked.append((system, settings))
        if len(asked) == 2:
            raise EndedError
        return SimpleNamespace(after=None)

    monkeypatch.setattr("smajax.control.tuned_on_models.tune", seen)
    models = {"base model": model(80.0), "extended model": model(120.0)}
    with pytest.raises(EndedError):
        tuned_on_models(models, ("plant", models["base model"]), "pid", [5.0], weights={"settling_time": 1.0})
    first, second = (problem_of(*one) for one in asked)
    own = [CONTROLLERS["pid"].make(within_limit(one, one.system)) for one in models.values()]
    times = [parameter_values(one)["rate_filter"] for one in own]
    assert times[0] > 1.2 * times[1]
    for problem in (first, second):
        assert parameter_values(problem.controller)["rate_filter"] == times[0]
    assert fixed_parameters("pid", first.controller) == fixed_parameters("pid", second.controller)
    assert first.box == second.box
    assert [one.weights for _, one in asked] == [{"settling_time": 1.0}] * 2


def test_a_fixed_parameter_or_bound_that_there_is_not_is_refused() -> None:
    system = bench(0.04)
    with pytest.raises(ValueError, match="pid has no fixed parameter 'rate_filtr'; did you mean"):
        settings_for(system, "pid", fixed={"rate_filtr": 0.1}).check(system)
    with pytest.raises(ValueError, match=r"bounds are of proportional_gain, .*, all of them; not of integral_gain"):
        settings_for(system, "pid", box={"integral_gain": (1.0, 2.0)}).check(system)


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
