"""From logs to a tuned loop on the true plant, each step one command: new-experiment, close-loop, predict, tune, simulate."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

import smajax as sma
from tests.helpers.small_bench import smajax

DEMO = Path(sma.__file__).parent / "data" / "demo" / "latent"
NOISE = 1e-4  # m, of the demo's runs
KNOWN = (
    "ambient_temperature=23 degC",
    "wire_diameter=0.31 mm",
    "damping=100 N s/m",
    "young_modulus_austenite=75 GPa",
    "young_modulus_martensite=28 GPa",
    "stress_slope_austenite=6.89 MPa/K",
    "stress_slope_martensite=6.89 MPa/K",
    "thermal_modulus=0.55 MPa/K",
    "resistivity_austenite=84 uohm cm",
    "resistivity_martensite=76 uohm cm",
)


@pytest.mark.slow
def test_logs_become_a_model_a_prediction_and_a_controller_on_the_true_plant(tmp_path: Path) -> None:
    logs = [DEMO / f"{name}.csv" for name in ("steps", "triangle", "pulses", "heavier", "decaying_sine")]
    draft = tmp_path / "experiment.toml"
    ended = smajax("new-experiment", *logs, *(f"--known={one}" for one in KNOWN), "--out", draft)
    assert ended.code == 0, ended.said + ended.out

    # Not a step of the way: the search of the whole library takes minutes, and the demo's own tests have it.
    text = draft.read_text(encoding="utf-8") + '\n[effects]\nonly = ["latent_heat", "creep", "radiation"]\n'
    draft.write_text(text, encoding="utf-8")

    report = tmp_path / "report"
    ended = smajax("close-loop", draft, "--out", report)
    assert ended.code == 0, ended.said
    assert "Verdict: explained" in ended.out, ended.out
    model = sma.load_model(report / "model.toml")
    assert model.effects == ("latent_heat",)
    assert model.values["latent_heat.enthalpy"] == pytest.approx(24200.0, rel=0.03)

    apart = DEMO / "mass_change.csv"
    errors = {}
    for name in ("model", "base_model"):
        ended = smajax("predict", report / f"{name}.toml", apart, "--out", tmp_path / name, "--json")
        assert ended.code == 0, ended.said
        errors[name] = json.loads(ended.out)["outputs"]["position"]["rmse"]
    assert errors["model"] < 1.15 * NOISE
    assert errors["base_model"] > 5.0 * errors["model"]

    tuned = tmp_path / "tuned"
    effort = ["--fast", "--rounds", "3", "--finish", "5", "--plants", "4"]
    ended = smajax("tune", "pid", "--model", report, "--set-point", "4mm,12mm", *effort, "--out", tuned)
    assert ended.code == 0, ended.said

    loop: list[str | Path] = ["--model", report, "--plant", DEMO / "true_model.toml", "--gains", tuned / "gains.json"]
    words: list[str | Path] = ["--set-point", "12mm:20s", "--json", "--out", tmp_path / "loop"]
    ended = smajax("simulate", *loop, *words)
    assert ended.code == 0, ended.said
    record = json.loads(ended.out)
    assert record["mismatch"]["latent_heat.enthalpy"]["assumed"] == model.values["latent_heat.enthalpy"]
    merit = record["merit"]
    assert merit["settling_time"]["value"] < 10.0
    assert merit["steady_error"]["value"] < 2e-4
