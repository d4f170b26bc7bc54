"""`tune` on set points that the drive reaches, and the preset's own limit of the command does not."""

from __future__ import annotations

from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import pytest

from smajax.cli.commands.tune import _higher_limit, _said_of_limit
from smajax.control.position_unit import unit_of
from smajax.control.reach import Reach
from smajax.control.scales import HEADROOM
from smajax.core.parameters import set_parameters
from smajax.model.presets import build
from smajax.model.system import System

PRESET = 5.0  # V


def _plant(amplifier: float) -> System:
    return set_parameters(build("flexinol_table_3_2", "dead_weight", "voltage"), {"amplifier_limit": amplifier})


def _reach(plant: System, largest: float) -> Callable[[dict[str, float]], Reach]:
    """2 mm a volt, up to `largest` mm."""

    def of(fixed: dict[str, float]) -> Reach:
        volts = fixed.get("largest_voltage", PRESET)
        return Reach(0.0, min(2.0 * volts, largest), volts, unit_of(plant), False, ("largest_voltage",))

    return of


def _settings(**changed: Any) -> Any:
    return SimpleNamespace(**{"controller": "pid", "fixed": {}, "start": {}, "set_points": (4.0, 12.0), **changed})


def test_a_controller_may_give_what_a_set_point_needs_with_some_to_spare() -> None:
    plant = _plant(20.0)
    reach = _reach(plant, 30.0)
    raised = _higher_limit(reach({}), plant, _settings(), reach)["largest_voltage"]
    assert 6.0 <= raised / HEADROOM < 1.1 * 6.1
    said = _said_of_limit(reach({}), _settings(), raised)
    assert (
        "gives up to 5 V on this plant, with which the load comes to rest below 12 mm: here it may give up to" in said
    )
    assert _higher_limit(reach({}), _plant(7.0), _settings(), reach) == {
        "largest_voltage": 7.0
    }  # all that the drive has


@pytest.mark.parametrize(
    ("amplifier", "largest", "changed"),
    [
        (1e3, 30.0, {}),  # the presets' limit says that nobody knows it
        (20.0, 10.5, {}),  # no command reaches the set point
        (20.0, 30.0, {"set_points": (4.0, 9.0)}),  # all are reached
        (20.0, 30.0, {"fixed": {"largest_voltage": 5.0}}),  # somebody gave it
        (20.0, 30.0, {"start": {"proportional_gain": 1.0}}),  # or gains that have it
        (5.5, 30.0, {}),  # the drive has too little
    ],
)
def test_otherwise_the_limit_stays(amplifier: float, largest: float, changed: dict[str, Any]) -> None:
    plant = _plant(amplifier)
    reach = _reach(plant, largest)
    assert _higher_limit(reach({}), plant, _settings(**changed), reach) == {}


def test_a_limit_of_the_drive_is_not_raised() -> None:
    plant = _plant(5.0)
    own = Reach(0.0, 10.0, 5.0, unit_of(plant), True, ("largest_voltage",))
    assert _higher_limit(own, plant, _settings(), _reach(plant, 30.0)) == {}
