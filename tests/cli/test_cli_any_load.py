"""`smajax tune`, `sweep` and `simulate` on a load other than the arm; what is wrong with such a plant is said."""

from __future__ import annotations

import csv
import json
from pathlib import Path

import pytest

from tests.helpers.small_bench import refused, smajax

pytestmark = pytest.mark.usefixtures("blank_pictures")

HANGING = ["--wire", "flexinol_table_3_2", "--load", "dead_weight", "--drive", "flexinol_voltage"]
SHORT = ["--seconds", "3s", "--tolerance", "none", "--no-open"]


@pytest.fixture(scope="module")
def tuned(tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("tune") / "out"
    little = ["--starts", "1", "--rounds", "2", "--finish", "2", "--fast"]
    words = ["tune", "pid", *HANGING, "--set-point", "5mm,1.2cm", "--variation", "payload=20%", *little, *SHORT]
    told = smajax(*words, "--noise", "10um", "--quantum", "0.02mm", "--limits", "overshoot=3mm", "--out", out)
    assert told.code == 0, told.said
    assert "V/m" in told.out
    return out


@pytest.mark.slow
def test_gains_are_tuned_on_a_dead_weight_in_millimetres(tuned: Path) -> None:
    record = json.loads((tuned / "tune.json").read_text(encoding="utf-8"))
    assert record["settings"]["set_points_mm"] == [5.0, 12.0]
    assert record["settings"]["noise_mm"] == pytest.approx(0.01)
    assert record["settings"]["quantum_mm"] == pytest.approx(0.02)
    assert record["loop"]["quantum"] == {"value": pytest.approx(2e-5), "unit": "m"}
    assert "in steps of 0.02 mm" in (tuned / "tune.html").read_text(encoding="utf-8")
    assert record["gains"]["integral_gain"]["unit"] == "V/(m s)"
    assert record["cost"]["after"] <= record["cost"]["before"]


@pytest.mark.slow
def test_the_tuned_gains_go_into_a_sweep_and_a_run_of_the_same_plant(tuned: Path, tmp_path: Path) -> None:
    gains = ["--gains", str(tuned / "gains.json")]
    words = [
        "sweep",
        *HANGING,
        *gains,
        "--over",
        "payload",
        "--points",
        "2",
        "--set-point",
        "5",
        "--gain-ratios",
        "1",
        *SHORT,
    ]
    told = smajax(*words, "--out", tmp_path / "sweep")
    assert told.code == 0, told.said
    with (tmp_path / "sweep" / "pid.csv").open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert [(row["payload_ratio"], row["set_point_mm"]) for row in rows] == [("0.5", "5"), ("2", "5")]
    words = ["simulate", *HANGING[1::2], *gains, "--set-point", "5:3s,8mm:3s", "--dt", "10ms", "--tolerance", "none"]
    told = smajax(*words, "--json", "--no-open", "--out", tmp_path / "run")
    assert told.code == 0, told.said
    record = json.loads(told.out)
    assert [one["set_point_m"] for one in record["merit_by_set_point"]] == [0.005, 0.008]
    assert record["merit_by_set_point"][0]["merit"]["overshoot"]["unit"] == "m"
    assert record["summary"]["position"]["last"] == pytest.approx(8e-3, abs=3e-4)


@pytest.mark.slow  # of the arm in `test_tuning_folder`
def test_the_same_folder_of_another_plant_is_refused(tuned: Path) -> None:
    words = ["tune", "pid", *HANGING, "--set", "load_mass='120 g'", "--set-point", "5mm,1.2cm", *SHORT]
    assert smajax(*words, "--out", tuned).code != 0


WRONG = {
    "tune pid --load dead_weight": "a plant is a wire, a load and a drive: give --wire and --drive too",
    "sweep --wire flexinol_table_3_2 --load dead_wieght --drive voltage": "did you mean 'dead_weight'?",
    "tune pid --wire flexinol_isobaric --load coupon --drive none": "a Coupon moves nothing that a controller could lead",
    "tune sld --wire flexinol_table_3_2 --load dead_weight --drive none": "every other load is heated and takes one of",
    "tune pid --wire flexinol_table_3_2 --load dead_weight --drive voltage --set-point 30deg": "not `30deg`",
    "tune pid --wire flexinol_table_3_2 --load dead_weight --drive voltage --set-point 80mm": "the stroke of the wire under this load",
    "tune pid --wire flexinol_table_3_2 --load dead_weight --drive voltage --noise 1deg": "'--noise'",
    "tune pid --wire flexinol_table_3_2 --load dead_weight --drive voltage --variation inertia=20%": "no variation `inertia`",
    "sweep --wire flexinol_table_3_2 --load dead_weight --drive voltage --over spring": "no mismatch `spring`",
    "sweep --wire flexinol_table_3_2 --load dead_weight --drive voltage --set load_mas=1": "did you mean 'load_mass'",
    "simulate flexinol_table_3_2 dead_weight flexinol_voltage --controller pid --set-point 5deg:1s": "got unit 'deg'",
}


@pytest.mark.parametrize("words", WRONG)
def test_a_plant_that_cannot_be_led_is_refused(tmp_path: Path, words: str) -> None:
    assert WRONG[words] in refused(*words.split(), "--out", tmp_path / "out")
    assert not (tmp_path / "out").exists()
