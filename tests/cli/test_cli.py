"""The command line lists what there is, and says what is wrong in one paragraph and exits with 2."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest

from smajax.control.presets import CONTROLLERS
from smajax.core.parameters import parameter_values
from smajax.model.presets import build
from smajax.model.rigs import arm
from tests.helpers.command_line import smajax_in


def test_help_names_the_commands(tmp_path: Path) -> None:
    told = smajax_in("--help", cwd=tmp_path)
    assert told.code == 0
    assert "close-loop" in told.out
    assert "demo" in told.out


def test_help_imports_no_heavy_package(tmp_path: Path) -> None:
    code = (
        "import sys\nfrom smajax.cli.main import app\ntry:\n    app(['--help'])\nexcept SystemExit:\n    pass\n"
        "print(sorted({'jax', 'numpy', 'matplotlib', 'pydantic', 'scipy', 'xarray'} & set(sys.modules)))"
    )
    told = subprocess.run([sys.executable, "-c", code], cwd=tmp_path, capture_output=True, text=True, timeout=60)
    assert told.stdout.strip().endswith("[]")


def test_effects_and_presets_are_listed_as_json(tmp_path: Path) -> None:
    effects = json.loads(smajax_in("effects", "--json", cwd=tmp_path).out)
    enthalpy = effects["latent_heat"]["parameters"]["latent_heat.enthalpy"]
    assert enthalpy["unit"] == "J/kg"
    assert effects["latent_heat"]["prior"] == {"class": "material", "odds": 0.1}
    assert {name: enthalpy["prior"][name] for name in ("base", "sigma", "unit", "of", "logarithmic")} == {
        "base": 0.0,
        "sigma": 2e4,
        "unit": "J/kg",
        "of": "",
        "logarithmic": False,
    }
    assert "data sheets" in enthalpy["prior"]["source"]
    assert effects["ambient_drift"]["parameters"]["ambient_drift.rate"]["prior"]["unit"] == "K per run"
    presets = json.loads(smajax_in("presets", "--json", cwd=tmp_path).out)
    assert {"arm", "dead_weight", "bias_spring"} <= set(presets["loads"])
    assert presets["wire_sizes"].keys() == set(presets["wires"])
    assert presets["wire_sizes"]["niti_table_3_1"] == {
        "wire_diameter": {"value": 150e-6, "unit": "m"},
        "wire_length": {"value": 0.9, "unit": "m"},
    }
    told = smajax_in("presets", cwd=tmp_path).out.splitlines()
    assert "  niti_table_3_1: diameter 0.15 mm, length 900 mm" in told
    lines = [next(line for line in told if line.startswith(f"  {drive}: ")) for drive in presets["drives"]]
    assert len({line.split(": ", 1)[1] for line in lines}) == len(lines)


def test_named_effects_and_those_of_an_equation_are_listed_alone(tmp_path: Path) -> None:
    told = json.loads(smajax_in("effects", "latent_heat", "electrical", "--json", cwd=tmp_path).out)
    assert "latent_heat" in told
    assert {one["equation"] for name, one in told.items() if name != "latent_heat"} == {"electrical"}


def test_an_effect_is_listed_with_its_odds_and_widths(tmp_path: Path) -> None:
    told = smajax_in("effects", "creep", "latent_heat", "sensor_offset", cwd=tmp_path).out
    assert "latent_heat  [heat; material, odds 0.1]" in told
    assert "      prior 0 ± 20000 J/kg; Elahinia 2004, Table 3.2, and NiTi data sheets: 24.2 kJ/kg" in told
    assert "      prior 5 s, times or over 4.5; " in told
    assert "      prior 0 ± 0.01 of the stroke; " in told
    misspelt = smajax_in("effects", "latent_heats", cwd=tmp_path)
    assert misspelt.code == 2
    assert "did you mean 'latent_heat'?" in misspelt.said


def test_the_parameters_of_named_presets_are_all_listed(tmp_path: Path) -> None:
    """What the answer to a misspelt one sends to."""
    model = ("niti_table_3_1", "arm", "amplified_voltage")
    told = json.loads(smajax_in("presets", *model, "--json", cwd=tmp_path).out)
    listed = {name: one["value"] for part in told.values() for name, one in part.items()}
    assert listed == pytest.approx(parameter_values(build(*model)))
    lines = smajax_in("presets", *model, cwd=tmp_path).out.splitlines()
    assert any(line.split()[:3] == ["wire_length", "0.9", "m"] for line in lines)
    wrong = smajax_in("presets", "arms", cwd=tmp_path)
    assert wrong.code == 2
    assert "no preset `arms`; did you mean 'arm'?" in wrong.said


def test_the_gains_of_a_listed_controller_are_listed_and_what_is_of_the_plant_is_not(tmp_path: Path) -> None:
    names = json.loads(smajax_in("presets", "--json", cwd=tmp_path).out)["controllers"]
    told = json.loads(smajax_in("presets", *names, "--json", cwd=tmp_path).out)
    assert list(told) == list(CONTROLLERS)
    for name, entries in told.items():
        preset = CONTROLLERS[name]
        values = parameter_values(preset.make(arm()))
        assert {*preset.box, preset.main_gain} <= set(entries)
        assert {one: entry["value"] for one, entry in entries.items()} == {one: values[one] for one in entries}
        assert not {"wire_length", "cross_section", "recoverable_strain"} & set(entries)
    lines = smajax_in("presets", "pid", cwd=tmp_path).out.splitlines()
    assert lines[0] == "pid  (gains of the arm, which are scaled to other loads)"
    assert lines[1].split()[:3] == ["proportional_gain", "12.8", "V/rad"]


def test_a_missing_experiment_file_is_an_error(tmp_path: Path) -> None:
    told = smajax_in("close-loop", "nowhere.toml", "--out", "report", cwd=tmp_path)
    assert told.code == 2
    assert "nowhere.toml" in told.said
    assert "Traceback" not in told.said


def test_an_output_folder_that_is_a_file_is_refused(tmp_path: Path) -> None:
    (tmp_path / "report").write_text("mine")
    (tmp_path / "experiment.toml").write_text("title = 'x'")
    told = smajax_in("close-loop", "experiment.toml", "--out", "report", cwd=tmp_path)
    assert told.code == 2
    assert "report" in told.said
    assert "Traceback" not in told.said
    assert (tmp_path / "report").read_text() == "mine"


def test_misspelt_parameter_is_named(tmp_path: Path) -> None:
    (tmp_path / "run.csv").write_text("t,v,x\n" + "\n".join(f"{k / 10},5,{k / 1e4}" for k in range(50)))
    (tmp_path / "experiment.toml").write_text(
        """
title = "typo"
[model]
wire = "flexinol_table_3_2"
load = "dead_weight"
drive = "voltage"
[unknown]
convection_coeficient = { low = "40 W/m^2/K", high = "400 W/m^2/K", start = "150 W/m^2/K" }
[sampling]
step = "100 ms"
[channels.voltage]
role = "input"
column = "v"
unit = "V"
[channels.position]
role = "output"
column = "x"
unit = "m"
noise = "0.1 mm"
[time]
column = "t"
unit = "s"
[[runs]]
name = "a"
role = "fit"
file = "run.csv"
"""
    )
    told = smajax_in("close-loop", "experiment.toml", "--out", "report", cwd=tmp_path)
    assert told.code == 2
    assert "convection_coefficient" in told.said  # the nearest known name
    assert "Traceback" not in told.said
