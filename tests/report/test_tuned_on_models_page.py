"""Gains tuned on two models and evaluated on one plant: what is said of them, and what is written."""

from __future__ import annotations

import dataclasses
import json
import math
from pathlib import Path

import numpy as np
import pytest

import smajax as sma
from smajax.control.gains_file import Gains, read_gains
from smajax.control.position_unit import PositionUnit
from smajax.control.tuned_on_models import ControlComparison, EvaluatedLoop, OtherValue, TunedOnModel, differing
from smajax.report.tuned_on_models_page import conclusions, rows, worth, write_comparison
from tests.fit.test_predict import kept_model

GAINS = {"proportional_gain": 900.0, "integral_gain": 300.0, "derivative_gain": 20.0, "unwinding_time": 0.4}
UNITS = {"proportional_gain": "V/m", "integral_gain": "V/(m s)", "derivative_gain": "V s/m", "unwinding_time": "s"}


def loop(set_point: float, settling_time: float, overshoot: float = 0.0) -> EvaluatedLoop:
    time = np.linspace(0.0, 10.0, 50)
    return EvaluatedLoop(set_point, time, set_point * (1.0 - np.exp(-time)), settling_time, overshoot, 1e-14)


def compared(*settling: tuple[float, float], differs: tuple[OtherValue, ...] = ()) -> ControlComparison:
    names = ("base model", "extended model")
    tuned = tuple(
        TunedOnModel(name, Gains("pid", GAINS), UNITS, (loop(0.005, times[0], 1e-4), loop(0.01, times[1])))
        for name, times in zip(names, settling, strict=False)
    )
    return ControlComparison("pid", "true model", PositionUnit("mm", "m"), 10.0, tuned, differs)


@pytest.mark.parametrize(
    ("settling", "said"),
    [
        (((4.0, 6.0), (3.0, 5.0)), "makes it settle 20% earlier, after 4 s and not 5 s on average."),
        (((3.0, 5.0), (4.0, 6.0)), "makes it settle 25% later, after 5 s and not 4 s on average."),
        (((4.0, 6.0), (4.0, 6.05)), "changes the settling time by less than 2 %."),
        (((4.0, math.inf), (3.0, 5.0)), "makes it settle where it did not."),
        (((4.0, 6.0), (3.0, math.inf)), "keeps it from settling."),
        (((4.0, math.inf), (3.0, math.inf)), "does not make it settle at every set point."),
    ],
)
def test_what_the_found_model_is_worth_is_said(settling: tuple[tuple[float, float], ...], said: str) -> None:
    assert worth(compared(*settling)) == f"Tuning on the extended model in the place of the base model {said}"


def test_gains_that_are_evaluated_on_the_model_that_they_were_tuned_on_are_said_to_be() -> None:
    result = dataclasses.replace(compared((4.0, 6.0), (3.0, 5.0)), plant="extended model")
    assert any("evaluated on the model that they were tuned on" in one for one in conclusions(result))
    assert not any("evaluated on the model" in one for one in conclusions(compared((4.0, 6.0), (3.0, 5.0))))


def test_a_loop_that_never_settles_and_a_rounding_error_are_said_as_such() -> None:
    result = compared((4.0, math.inf), (3.0, 5.0), differs=(OtherValue("load_mass", 0.5, 1.0, "kg"),))
    first, second, mind, _ = conclusions(result)
    assert "tuned on the base model settles at 1 of 2 set points, with an overshoot of at most 0.1 mm" in first
    assert "settles after 4 s on average" in second
    assert mind == "Mind: the true model differs from the models in what was taken as known: load_mass (0.5 and 1 kg)."
    assert [row[2] for row in rows(result)] == ["4", "never", "3", "5"]
    assert {row[4] for row in rows(result)} == {"0"}  # of 1e-14 m


def test_the_gains_the_numbers_and_the_page_are_written(tmp_path: Path) -> None:
    page = write_comparison(compared((4.0, 6.0), (3.0, 5.0)), tmp_path, "smajax close-loop x --tune pid")
    assert {one.name for one in tmp_path.iterdir()} == {"pid_gains.json", "control_pid.json", "control_pid.html"}
    gains = read_gains(tmp_path / "pid_gains.json", kept_model().system)
    assert gains.values == GAINS
    record = json.loads((tmp_path / "control_pid.json").read_text(encoding="utf-8"))
    assert record["tuned_on"][1]["loops"][0]["settling_time"] == 3.0
    assert page.read_text(encoding="utf-8").count("<img") >= 1


def test_known_values_that_the_plant_has_others_of_are_named() -> None:
    import dataclasses

    model = kept_model()
    mass = dataclasses.replace(model.parameters["load_mass"], value=0.5, origin="given")
    known = dataclasses.replace(model, parameters={**model.parameters, "load_mass": mass})
    other = dataclasses.replace(mass, value=1.0)
    plant = dataclasses.replace(model, parameters={**model.parameters, "load_mass": other})
    assert differing(known, plant) == (OtherValue("load_mass", 0.5, 1.0, "kg"),)
    assert differing(known, known) == ()
    assert isinstance(known, sma.ActuatorModel)
