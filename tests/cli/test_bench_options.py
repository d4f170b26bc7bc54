"""`smajax new-experiment` takes what is known of a bench, and lists what it left to the presets by how much the runs depend on it."""

from __future__ import annotations

import json
import re
import tomllib
from pathlib import Path

import pytest

from smajax.core.parameters import parameter_values
from smajax.data.experiment.load import load_experiment
from smajax.data.model_catalogue import CATALOGUE
from smajax.fit.base_model import base_model
from tests.helpers.command_line import DEMO
from tests.helpers.small_bench import log, refused, smajax

LOGS = [DEMO / name for name in ("steps.csv", "triangle.csv", "pulses.csv")]
SIZES = "wire_diameter=0.31 mm,ambient_temperature=23 degC"


def test_a_bench_is_declared_in_one_command(tmp_path: Path) -> None:
    """The demo's bench: its sizes are of its own file, the resistance is what they make of its wire."""
    out = tmp_path / "e.toml"
    ended = smajax(
        "new-experiment", *LOGS, "--known", SIZES, "--known", "damping=100 N s/m", "--ohms", "5.4 ohm", "--out", out
    )
    assert ended.code == 0, ended.said
    assert "resistivity_martensite = 7.59e-07 ohm m: 5.4 ohm of" in ended.out
    assert "resistivity_austenite = 8.389e-07 ohm m within 20 %: 1.105 times" in ended.out
    values = parameter_values(base_model(load_experiment(out, CATALOGUE)))
    assert (values["wire_diameter"], values["damping"]) == (0.31e-3, 100.0)


def test_what_is_left_to_the_preset_is_listed_by_its_importance(tmp_path: Path) -> None:
    out = tmp_path / "e.toml"
    ended = smajax("new-experiment", *LOGS, "--known", SIZES, "--out", out)
    (said,) = [line for line in ended.out.splitlines() if "these matter most on your runs" in line]
    first, *others = re.findall(r"(\w+) \([\d.]+ (?:%|K)", said.split(": ", 1)[1])
    text = out.read_text()
    asked = re.findall(
        r"^# (\w+) = .*?; ([\d.]+) (?:%|K) changes the output by ([\d.]+) times its noise$", text, re.MULTILINE
    )
    assert [name for name, *_ in asked][:5] == [first, *others]
    noises = [float(number) for *_, number in asked]
    assert noises == sorted(noises, reverse=True)
    assert noises[0] > 10.0
    assert "wire_diameter" not in {name for name, *_ in asked}
    assert "\n# amplifier_limit = " in text  # nothing depends on it, and it may be given all the same
    # A line without its first mark is a value of the file.
    uncommented = text.replace(f"# {first} = ", f"{first} = ")
    assert first in tomllib.loads(uncommented)["model"]["parameters"]


def test_the_record_has_the_influences_as_numbers(tmp_path: Path) -> None:
    ended = smajax("new-experiment", *LOGS, "--out", tmp_path / "e.toml", "--json")
    influences = json.loads(ended.out)["left_to_preset"]
    assert {"name", "unit", "value", "change", "relative", "noises"} == set(influences[0])
    assert influences[0]["noises"] == max(one["noises"] for one in influences)


def test_a_draft_that_cannot_be_loaded_is_not_ranked_and_says_so(tmp_path: Path) -> None:
    file = log(tmp_path / "a.csv")
    file.write_text(file.read_text().replace("t,U,x", "t,U,what"))
    ended = smajax("new-experiment", file, "--known", "wire_length=0.5 m", "--out", tmp_path / "e.toml")
    assert ended.code == 3
    assert "not listed by its importance: that takes a file that can be loaded" in ended.out
    assert 'wire_length = "0.5 m"' in (tmp_path / "e.toml").read_text()


def test_facts_that_cannot_be_are_refused_before_a_file_is_written(tmp_path: Path) -> None:
    out = tmp_path / "e.toml"
    for options, message in (
        (("--known", "wire_lenght=0.5 m"), "model.parameters.wire_lenght: there is no parameter 'wire_lenght'"),
        (("--known", "wire_length"), "each name once with its number"),
        (("--ohms", "-1"), "more than 0 ohm, not `-1`"),
        (("--ohms", "4 ohm", "--ohms-per-metre", "8"), "which say the same"),
        (("--mass", "steps"), "`500 g` for all runs, or each run once as in `ramp=500 g`, not `steps`"),
        (("--mass", "steps=500 g"), "the logs have a mass themselves"),
    ):
        assert message in refused("new-experiment", *LOGS, *options, "--out", out)
        assert not out.exists()


def test_a_mass_in_a_file_name_is_suggested_with_the_option_that_takes_it(tmp_path: Path) -> None:
    files = [log(tmp_path / f"step_{grams}g.csv", seed=grams) for grams in (300, 500)]
    for file in files:
        file.write_text(file.read_text().replace("t,U,x", "t [s],U [V],x [mm]"))
    out = tmp_path / "e.toml"
    ended = smajax("new-experiment", *files, "--out", out)
    assert "--mass 'step_300g=300 g' --mass 'step_500g=500 g'" in ended.out
    masses = ("--mass", "step_300g=300 g", "--mass", "step_500g=500 g")
    ended = smajax("new-experiment", *files, *masses, "--overwrite", "--out", out)
    assert ended.code == 0, ended.said
    assert [float(run.inputs["mass"][0]) for run in load_experiment(out, CATALOGUE).runs] == [0.3, 0.5]
    assert "load_mass" not in ended.out
    ended = smajax("new-experiment", *files, "--mass", "step_300g=0.3 g,step_500g=0.5 g", "--overwrite", "--out", out)
    assert "warning: the mass is no more than 0.0005 kg; is it in kg, and not in g?" in ended.out
    assert [float(run.inputs["mass"][0]) for run in load_experiment(out, CATALOGUE).runs] == [0.3e-3, 0.5e-3]


def test_a_coupon_is_ranked_too(tmp_path: Path) -> None:
    rows = ["t [s],T [degC],stress [MPa],strain [%]"]
    for k in range(120):
        warm = 25.0 + 90.0 * (1.0 - abs(k - 60) / 60.0)
        rows.append(f"{k},{warm:.2f},100,{4.0 * (warm < 80.0) + 0.01 * (k % 3):.3f}")
    (tmp_path / "oven.csv").write_text("\n".join(rows))
    ended = smajax("new-experiment", tmp_path / "oven.csv", "--out", tmp_path / "e.toml")
    assert ended.code == 0, ended.said
    assert re.search(
        r"stress_slope_\w+ \(20 % changes the output by [\d.]+ times its noise\), stress_slope_\w+ \(20 %: ", ended.out
    )
    assert "\n# stress_slope_austenite = " in (tmp_path / "e.toml").read_text()


@pytest.mark.parametrize(("volts", "start"), [(4.0, "150"), (5.5, "37.5"), (10.0, "150")])
def test_a_draft_begins_where_the_wire_transforms(volts: float, start: str, tmp_path: Path) -> None:
    """5.5 V do not transform the preset's wire at its convection, and moved this one; 4 V do at no convection within its bounds, 10 V at any."""
    rows = (f"{0.05 * k:.2f},{volts * (k % 200 > 99)},{18.0 * (k % 200 > 120)}" for k in range(400))
    (tmp_path / "log.csv").write_text("\n".join(["time_s,U_V,x_mm", *rows]), encoding="utf-8")
    known = "wire_length=0.537 m,wire_diameter=0.15 mm,load_mass=300 g"
    out = tmp_path / "e.toml"
    ended = smajax("new-experiment", tmp_path / "log.csv", "--known", known, "--out", out)
    assert ended.code == 0, ended.said
    unknown = tomllib.loads(out.read_text(encoding="utf-8"))["unknown"]["convection_coefficient"]
    assert unknown["start"] == f"{start} W/(m^2 K)"
    assert ("as the start in place of the preset's, at which the wire" in ended.out) == (start != "150")
