"""Plants that differ in several mismatches at once, and the picture of a sweep on them."""

from __future__ import annotations

import csv
import html
import json
import re
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import xarray as xr
from matplotlib.figure import Figure

from smajax.control.position_unit import DEGREES
from smajax.control.sweep.run_sweep import sweep_controllers, sweep_settings_for
from smajax.control.sweep.spread_plants import spread_plants
from smajax.core.parameters import parameter_values, set_parameters
from smajax.model.rigs import arm
from smajax.report.sweep_batch_picture import draw_batch, most_telling
from smajax.report.sweep_numbers import SHOWN
from smajax.report.sweep_plants import hardest
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
    for wrong, said in (
        ({"mismatches": ("wind",)}, "no mismatch `wind`"),
        ({"mismatches": "inertia"}, "expected several names"),
        ({"mismatches": ("convection", "convection_coefficient")}, "`convection` twice"),
        ({"count": 0}, "got 0 plants"),
        ({"least": 0.0}, "from below 1 to above 1"),
        ({"least": 0.5, "most": 0.9}, "from below 1 to above 1"),
    ):
        given: dict[str, Any] = {"mismatches": THREE, **wrong}
        with pytest.raises(ValueError, match=said):
            spread_plants(arm(), **given)


def test_fewer_plants_are_the_first_of_more_in_any_order_of_the_names() -> None:
    many, few = spread_plants(arm(), THREE, 32), spread_plants(arm(), THREE[::-1], 10)
    assert list(many) == list(few)
    for name, values in few.items():
        np.testing.assert_array_equal(values, many[name][:10])


def test_the_figures_of_a_plant_are_the_same_whatever_the_number_of_plants() -> None:
    """Of a noisy position too: the noise goes by the loop's row."""
    small = {"seconds": 2.0, "set_points": (20.0, 60.0), "gain_ratios": (1.0,), "tolerance": None}
    settings = sweep_settings_for(arm(), ["pid"], noise=0.2, **small)
    (few,), (many,) = (
        list(sweep_controllers(arm(), settings, plants=spread_plants(arm(), THREE, count))) for count in (3, 6)
    )
    np.testing.assert_array_equal(few.nominal.steady_error, many.nominal.steady_error)
    np.testing.assert_array_equal(few.merits.steady_error, many.merits.steady_error[:3])
    assert len(np.unique(many.merits.steady_error)) == 12


def test_the_parameters_drawn_are_those_on_which_the_figures_hang() -> None:
    random = np.random.default_rng(0)
    batch = random.uniform(size=(40, 5))
    never = np.where(batch[:, 3] > 0.8, np.nan, 1.0 + batch[:, 3])  # beyond 0.8 no loop settles
    assert most_telling(batch, [never, -(batch[:, 1] ** 3), np.zeros(40)], 2) == [1, 3]
    assert most_telling(batch[:, :2], [never], 2) == [0, 1]


@pytest.fixture(scope="module")
def swept(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Of a controller with a lower limit than the other, which does not reach a warm set point of a wire that is cooled twice as well."""
    out = tmp_path_factory.mktemp("batch") / "sweep"
    words = ["--plants", "8", "--set-point", "20,60", "--gain-ratios", "1", "--seconds", "4", "--tolerance", "none"]
    told = smajax("sweep", "--controllers", "pid,sld", "--over", ",".join(THREE), *words, "--no-open", "--out", out)
    assert told.code == 0, told.said
    return out


def test_three_mismatches_at_once_are_a_batch_of_plants_with_a_point_each(swept: Path) -> None:
    record = json.loads((swept / "sweep.json").read_text(encoding="utf-8"))["sweep"]
    names = ("inertia_ratio", "damping", "convection_coefficient")
    assert {name: len(values) for name, values in record["plants"].items()} == dict.fromkeys(names, 8)
    assert record["assumed"] == pytest.approx({name: parameter_values(arm())[name] for name in names})
    assert record["units"]["damping"] == "N m s/rad"
    assert record["loops"] == 16
    page = (swept / "index.html").read_text(encoding="utf-8")
    assert "Batch of 8 plants" in page
    assert "the controller assumes 150)" in page
    assert "A point is a plant" in page
    assert (swept / "pid_maps.png").stat().st_size > 10_000


def test_the_worst_plant_is_on_the_page_and_its_values_beside_every_loop(swept: Path) -> None:
    with (swept / "pid.csv").open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    plants = json.loads((swept / "sweep.json").read_text(encoding="utf-8"))["sweep"]["plants"]
    for row in rows:
        assert float(row["damping"]) == pytest.approx(plants["damping"][int(row["plant"]) - 1], rel=1e-4)
    loops = xr.load_dataset(swept / "sweep.nc")
    np.testing.assert_allclose(loops["damping"], plants["damping"])
    assert loops["damping"].dims == ("plant",)
    # By the rows: most set points in reach at which it does not settle first, then the largest error.
    unsettled = {plant: 0 for plant in range(1, 9)}
    error = dict.fromkeys(unsettled, 0.0)
    for row in rows:
        if row["least_time_s"]:
            unsettled[int(row["plant"])] += not row["settling_time_s"]
            error[int(row["plant"])] = max(error[int(row["plant"])], float(row["steady_error_deg"]))
    worst = max(unsettled, key=lambda plant: (unsettled[plant], error[plant]))
    assert unsettled[worst] > 0
    page = html.unescape((swept / "index.html").read_text(encoding="utf-8"))
    table = page[page.index("does not settle at") :]
    assert re.search(r"<td[^>]*>(\d+)</td>", table)[1] == str(worst)  # type: ignore[index]
    assert f"--mismatch inertia_ratio={plants['inertia_ratio'][worst - 1]:.6g},damping=" in page


def test_what_is_out_of_reach_of_the_controllers_own_limit_is_said(swept: Path) -> None:
    with (swept / "sld.csv").open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    failed = [row for row in rows if row["least_time_s"] and not row["settling_time_s"]]
    beyond = [row for row in failed if not row["least_time_own_limit_s"]]
    assert beyond
    page = (swept / "index.html").read_text(encoding="utf-8")
    if len(failed) > 1:
        said = f"Of the {len(failed)} runs in which it does not settle {len(beyond)} are out of reach of its own largest command, 8.7 V."
    else:
        said = "The one run in which it does not settle is out of reach of its own largest command, 8.7 V."
    assert said in page
    assert "of those that its own 8.7 V reach" in page


def test_another_number_of_plants_is_named_in_the_folder(swept: Path) -> None:
    told = smajax(
        "sweep",
        "--controllers",
        "pid,sld",
        "--over",
        ",".join(THREE),
        "--plants",
        "4",
        "--set-point",
        "20,60",
        "--out",
        swept,
    )
    assert told.code != 0
    assert "8 over convection, damping, inertia, 0.5 to 2 times" in " ".join(told.said.split())


def test_a_plant_in_reach_of_nothing_has_no_cross() -> None:
    """And one that fails at some of its set points has another mark than one that fails at most of them."""
    merits = {name: np.ones((4, 1, 3, 1)) for name in SHOWN}
    merits["settling_time"][1, 0, :2] = np.inf  # most
    merits["settling_time"][2, 0, 0] = np.inf  # some
    merits["settling_time"][3] = np.inf
    least = np.ones((4, 1, 3))
    least[3] = np.inf  # none in reach
    sweep: Any = SimpleNamespace(merits=SimpleNamespace(**merits), least=SimpleNamespace(grid=least))
    batch = np.array([[1.0], [2.0], [3.0], [4.0]])
    plants = SimpleNamespace(unit=DEGREES, batch=batch, columns=("damping",), units=("N m s/rad",), nominal=np.ones(1))
    grid: Any = SimpleNamespace(ratios=np.arange(1.0, 5.0), gains=np.ones(1), plants=plants)
    figure = Figure(figsize=(10.0, 14.0))
    draw_batch(figure, grid, sweep)
    marks = {line.get_label(): np.asarray(line.get_xdata()).tolist() for line in figure.axes[0].lines[1:]}
    assert marks["never settles (arrives) at more than half"] == [2.0]
    assert marks["never settles (arrives) at some"] == [3.0]
    assert marks["no set point in reach"] == [4.0]
    assert [one.plant for one in hardest(grid, sweep)] == [1, 2, 0]
