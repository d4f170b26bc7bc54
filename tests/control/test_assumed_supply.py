"""A duty is made of a command by the supply that the controller's model has: a lower one heats less."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest

import smajax as sma
from smajax.control.closed_loop import ClosedLoopSetup
from smajax.control.compiled_loop import evaluated_loop_compiled
from smajax.control.found_notes import notes_of_reach
from smajax.control.least_time import Largest
from smajax.control.plants import plant_set
from smajax.control.reach import reach_of
from smajax.control.reference import clock, constant
from smajax.control.sweep.batched_loops import LoopSetup, closed_loops
from smajax.control.sweep.grid import loop_rows
from smajax.control.tuned_on_models import loop_on_plant
from smajax.model.drive.duty import Duty
from smajax.model.presets import build
from smajax.model.system import System

VOLTS = 12.0
SECONDS = 2.0


def _plant(supply: float = VOLTS) -> System:
    return dataclasses.replace(build("flexinol_table_3_2", "dead_weight", "none"), drive=Duty(supply))


OPEN = Largest(4.0)  # all of it, and too little to transform


@pytest.mark.parametrize("ratio", [0.5, 1.0, 2.0])
def test_the_energy_of_a_command_goes_as_the_square_of_the_supply(ratio: float) -> None:
    wanted = constant(clock(0.2, 0.02), 1.0)
    setup = ClosedLoopSetup(_plant(ratio * VOLTS), OPEN, wanted, 0.02, assumed=_plant())
    own = dataclasses.replace(setup, system=_plant(), assumed=None)
    (_, found), (_, known) = (evaluated_loop_compiled(one) for one in (setup, own))
    assert float(found.energy / known.energy) == pytest.approx(ratio**2, rel=1e-9)


def test_a_sweep_over_the_supply_and_a_loop_on_such_a_plant_are_the_same() -> None:
    plant = _plant()
    found = plant_set(plant)
    ratios = np.array([0.5, 0.75, 1.0])
    rows = loop_rows({"supply": ratios}, np.full(3, 3e-3), 1.0, found)
    controller = sma.loop_around(plant, "pid").controller
    setup = LoopSetup(plant, controller, "proportional_gain", SECONDS, 0.02, perturbation=found.perturbation)
    swept = closed_loops(setup, rows).merits
    for number, ratio in enumerate(ratios):
        loop = sma.loop_around(_plant(ratio * VOLTS), "pid", assumed=plant)
        run = sma.simulate_loop_dataset(loop, "3 mm", SECONDS, dt=0.02, period=0.02)
        single = loop_on_plant(loop.system, controller, 3e-3, SECONDS, plant)
        assert float(run["temperature"].max()) == pytest.approx(float(swept.peak_temperature[number]), rel=1e-3)
        assert single.position[-1] == pytest.approx(float(run["position"][-1]), abs=1e-4)
    assert np.all(np.diff(swept.energy) > 0.0)


def test_the_model_of_a_loop_is_one_to_make_another_loop_of() -> None:
    loop = sma.loop_around(_plant(9.0), "pid", assumed=_plant())
    again = sma.loop_around(loop.system, "pid")
    own = sma.loop_around(_plant(9.0), "pid")
    first, second = (sma.simulate_loop_dataset(one, "3 mm: 1 s", dt=0.02, period=0.02) for one in (again, own))
    assert first["position"].to_numpy().tolist() == second["position"].to_numpy().tolist()


def test_a_lower_supply_is_in_reach_of_all_of_the_duty() -> None:
    """Of a command of 12 V, which the controller's model allows, the duty is 1 whatever the supply."""
    truth, reach = _plant(9.0), reach_of(_plant(9.0))
    known = reach_of(truth, None, _plant())
    assert reach is not None
    assert known is not None
    assert known.high == pytest.approx(reach.high)
    assert known.command == pytest.approx(VOLTS)
    setup = ClosedLoopSetup(truth, Largest(6.0), constant(clock(1.0, 0.02), 1.0), 0.02, assumed=_plant())
    (said,) = notes_of_reach(setup, np.full(2, 0.02), {"settling_time": math.inf}, ())
    at_half = reach_of(truth, Largest(6.0), _plant())
    assert at_half is not None
    assert at_half.words() in str(said)
    assert at_half.high < reach.high
