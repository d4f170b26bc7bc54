"""Plants that differ in several mismatches at once, and the picture of a sweep on them."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from smajax.control.sweep.spread_plants import spread_plants
from smajax.core.parameters import parameter_values, set_parameters
from smajax.model.rigs import arm
from smajax.report.sweep_batch_picture import most_telling
from tests.helpers.small_bench import smajax

THREE = ("inertia", "damping", "convection")


def test_each_half_of_every_range_has_half_of_the_plants_in_every_combination() -> None:
    system = arm()
    batch = spread_plants(system, THREE, 64, least=0.5, most=1.25)
    assert list(batch) == ["inertia_ratio", "damping", "convection_coefficient"]
    assumed = parameter_values(system)
    ratios = np.stack([values / assumed[name] for name, values in batch.items()])
    assert ratios.min() >= 0.5
    assert ratios.max() <= 1.25
    # Each of the eight corners, in which all three are wrong together, has an eighth of the plants.
    octant = (ratios > 1.0).T @ np.array([1, 2, 4])
    assert np.bincount(octant).tolist() == [8] * 8
    # Evenly by logarithm on either side.
    for row in ratios:
        below, above = np.log(row[row < 1.0]) / np.log(0.5), np.log(row[row > 1.0]) / np.log(1.25)
        for side in (below, above):
            assert np.quantile(side, [0.25, 0.5, 0.75]) == pytest.approx([0.25, 0.5, 0.75], abs=0.08)


def test_what_no_ratio_can_change_is_refused() -> None:
    with pytest.raises(ValueError, match=r"damping \(damping\) is 0 where the controller assumes it"):
        spread_plants(set_parameters(arm(), {"damping": 0.0}), THREE)
    with pytest.raises(ValueError, match="no mismatch `wind`"):
        spread_plants(arm(), ("wind",))


def test_the_parameters_drawn_are_those_on_which_the_figures_hang() -> None:
    random = np.random.default_rng(0)
    batch = random.uniform(size=(40, 5))
    never = np.where(batch[:, 3] > 0.8, np.nan, 1.0 + batch[:, 3])  # beyond 0.8 no loop settles
    assert most_telling(batch, [never, -(batch[:, 1] ** 3), np.zeros(40)], 2) == [1, 3]
    assert most_telling(batch[:, :2], [never], 2) == [0, 1]


def test_three_mismatches_at_once_are_a_batch_of_plants_with_a_picture_of_each(tmp_path: Path) -> None:
    short = [
        "--plants",
        "8",
        "--set-point",
        "20,60",
        "--gain-ratios",
        "1",
        "--seconds",
        "3",
        "--tolerance",
        "none",
        "--no-open",
    ]
    told = smajax("sweep", "--controllers", "pid", "--over", ",".join(THREE), *short, "--out", tmp_path / "sweep")
    assert told.code == 0, told.said
    record = json.loads((tmp_path / "sweep" / "sweep.json").read_text(encoding="utf-8"))
    assert {name: len(values) for name, values in record["sweep"]["plants"].items()} == {
        "inertia_ratio": 8,
        "damping": 8,
        "convection_coefficient": 8,
    }
    assert record["sweep"]["loops"] == 16
    page = (tmp_path / "sweep" / "index.html").read_text(encoding="utf-8")
    assert "Batch of 8 plants" in page
    assert "A point is a plant" in page
    assert (tmp_path / "sweep" / "pid_maps.png").stat().st_size > 10_000
