"""`tune` on set points that the drive reaches, and the preset's own limit of the command does not."""

from __future__ import annotations

from types import SimpleNamespace

import pytest

from smajax.cli.commands.tune import _higher_limit, _said_of_limit
from smajax.control.position_unit import unit_of
from smajax.control.reach import Reach
from smajax.core.parameters import set_parameters
from smajax.model.presets import build

LIMIT = {"largest_voltage": 7.0}


@pytest.mark.parametrize(
    ("high", "by_drive", "fixed", "drive", "raised"),
    [
        (11.5, False, {}, 7.0, LIMIT),
        (18.0, False, {}, 7.0, {}),  # it reaches all set points
        (11.5, True, {}, 7.0, {}),  # the drive gives no more
        (11.5, False, {"largest_voltage": 5.0}, 7.0, {}),  # somebody gave it
    ],
)
def test_a_controller_may_give_what_the_drive_can_where_a_set_point_needs_it(
    high: float, by_drive: bool, fixed: dict[str, float], drive: float, raised: dict[str, float]
) -> None:
    plant = build("flexinol_table_3_2", "dead_weight", "voltage")
    plant = set_parameters(plant, {"amplifier_limit": drive})
    reach = Reach(0.0, high, 5.694, unit_of(plant), by_drive, ("largest_voltage",))
    settings = SimpleNamespace(controller="pid", fixed=fixed, set_points=(4.0, 12.0))
    assert _higher_limit(reach, plant, settings) == raised  # type: ignore[arg-type]
    said = _said_of_limit(reach, settings, 7.0)  # type: ignore[arg-type]
    assert "gives up to 5.694 V on this plant, with which the load comes to rest below 12 mm" in said
    assert said.endswith("here it may give what the drive can, 7 V.")
