"""The distance to the least time: out of reach is no failure, and each limit of a command has its own least time."""

from __future__ import annotations

import math

import numpy as np
import pytest

from smajax.control.least_time import command_limit, distance
from smajax.control.presets import CONTROLLERS
from smajax.core.parameters import get_parameters, set_parameters
from smajax.model.rigs import arm

NEVER = math.inf


def test_what_is_out_of_reach_is_told_from_a_failure() -> None:
    found = distance(np.asarray([2.0, 3.0, NEVER, NEVER]), np.asarray([1.0, 2.0, 1.0, NEVER]))
    assert found == (1.75, 2.0, 2, 1, 1)


def test_a_run_that_begins_at_its_set_point_has_no_ratio() -> None:
    assert distance(np.asarray([0.0, 3.0]), np.asarray([0.0, 2.0])) == (1.5, 1.5, 2, 0, 0)


def test_where_no_run_settles_there_is_no_number() -> None:
    found = distance(np.full(3, NEVER), np.asarray([1.0, NEVER, 1.0]))
    assert np.isnan([found.median, found.worst]).all()
    assert found[2:] == (0, 2, 1)


@pytest.mark.parametrize(("name", "limit"), [("pid", 10.0), ("sld", 8.7), ("vsc3", 10.0), ("nvsc", 10.0)])
def test_the_limit_is_that_of_the_controller_or_of_the_drive(name: str, limit: float) -> None:
    system = arm()
    controller = CONTROLLERS[name].make(system)
    assert command_limit(system, controller) == pytest.approx(limit)
    gain = float(get_parameters(system, ["amplifier_gain"])[0])
    low = set_parameters(system, {"amplifier_limit": 6.0 * gain})
    assert command_limit(low, controller) == pytest.approx(6.0)


def test_a_switch_is_limited_by_its_higher_voltage() -> None:
    system = arm()
    assert command_limit(system, set_parameters(CONTROLLERS["vsc3"].make(system), {"high_voltage": 8.0})) == 8.0
