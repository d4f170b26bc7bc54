"""The stored sweep: its table is of its numbers, and what it counts as out of reach is out of reach of the plant."""

from __future__ import annotations

import json

import numpy as np
import pytest

from smajax.control.least_time import distance, least_reach_times
from smajax.control.presets import CONTROLLERS, OF_THE_SOURCE
from smajax.model.rigs import arm
from studies.sweep.table import HERE, MARK, table

RECORD = json.loads((HERE / "sweep.json").read_text(encoding="utf-8"))


def _infinite(values: list[float | None]) -> np.ndarray:
    return np.asarray([np.inf if value is None else value for value in values])


def test_the_table_is_of_the_stored_numbers() -> None:
    assert (HERE / "README.md").read_text(encoding="utf-8").split(MARK)[1].strip() == table(RECORD)
    assert set(RECORD["least_times"]) == set(CONTROLLERS) > set(OF_THE_SOURCE)


@pytest.mark.parametrize("name", sorted(RECORD["least_times"]))
def test_the_distances_are_of_the_settling_times_and_the_least_times(name: str) -> None:
    settling = _infinite(RECORD["controllers"][name]["settling_time"])
    drive, own = (RECORD["least_times"][name][of] for of in ("all_controllers", "controller"))
    for least in (drive, own):
        stored = [np.nan if one is None else one for one in least["settling_over_least_time"].values()]
        np.testing.assert_allclose(stored, list(distance(settling, _infinite(least["seconds"]))), rtol=1e-9)
    assert (_infinite(own["seconds"]) >= _infinite(drive["seconds"]) - 1e-9).all()
    perturbed = RECORD["sweep"]["settling_over_least_time"][name]
    for one in perturbed.values():
        assert one["settled"] + one["never"] + one["unreachable"] == 15 * 15 * len(settling)
        assert one["median"] >= 1.0
    assert perturbed["controller"]["unreachable"] >= perturbed["all_controllers"]["unreachable"] > 0


def test_stored_least_times_are_those_of_the_largest_commands() -> None:
    """To the steps of both: stored samples are 10 ms apart, these 5 ms."""
    targets, stored = np.asarray(RECORD["set_points_rad"]), RECORD["least_times"]["sld"]
    for least in stored.values():
        again = least_reach_times(arm(), targets, least["largest_command"])
        np.testing.assert_allclose(_infinite(least["seconds"]), again, atol=0.0151)
    assert stored["all_controllers"]["largest_command"] > stored["controller"]["largest_command"]
