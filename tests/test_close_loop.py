"""The main job, whole: the shipped benches and the measured data, with the numbers that they must reach."""

from __future__ import annotations

import tomllib
from importlib import resources
from pathlib import Path

import numpy as np
import pytest

from smajax.attribution.verdict import pooled
from smajax.catalogue import CATALOGUE
from smajax.close_loop import close_loop
from smajax.experiment.load import load_experiment
from smajax.report.findings import Findings, RunFinding

STUDIES = Path(__file__).parents[1] / "studies"


def _added(findings: Findings) -> set[str]:
    return {effect.name for effect in findings.effects if effect.added}


def _demo(name: str, tmp_path: Path) -> tuple[Findings, dict[str, float]]:
    with resources.as_file(resources.files("smajax") / "demo" / name) as folder:
        findings = close_loop(load_experiment(folder / "experiment.toml", CATALOGUE), memory=tmp_path)
        return findings, tomllib.loads((folder / "truth.toml").read_text())["parameters"]


def test_demo_names_the_hidden_effect_and_nothing_else(tmp_path: Path) -> None:
    findings, truth = _demo("latent", tmp_path)
    assert findings.verdict == "explained"
    assert _added(findings) == {"latent_heat"}
    found = next(effect for effect in findings.effects if effect.added).coefficients["enthalpy"]
    assert found.value == pytest.approx(truth.pop("latent_heat"), rel=0.03)
    after = {parameter.name: parameter for parameter in findings.after}
    for name, value in truth.items():
        if name in after:
            assert after[name].value == pytest.approx(value, rel=0.03), name
    noise = findings.noise_sigma
    assert pooled(findings.runs, "held-out", "before") > 5.0 * noise
    assert pooled(findings.runs, "held-out", "after") < 1.1 * noise
    assert pooled(findings.runs, "fit", "after") < 1.05 * noise


def test_demo_with_nothing_missing_is_adequate(tmp_path: Path) -> None:
    findings, truth = _demo("complete", tmp_path)
    assert findings.verdict == "adequate"
    assert _added(findings) == set()
    assert pooled(findings.runs, "held-out", "before") < 1.1 * findings.noise_sigma
    for parameter in findings.before:
        assert parameter.value == pytest.approx(truth[parameter.name], rel=0.03), parameter.name
        assert parameter.standard_error is not None
        # Four standard errors and the integrator's own error at this step.
        assert abs(parameter.value - truth[parameter.name]) < 4 * parameter.standard_error + 2e-3 * abs(parameter.value)


def test_one_run_no_unknown_and_no_candidate_still_give_an_answer(tmp_path: Path) -> None:
    """The base model taken as it is, on one run: said to be off, and that nothing could be tried or left out."""
    with resources.as_file(resources.files("smajax") / "demo" / "complete") as folder:
        head, *runs = (folder / "experiment.toml").read_text().split("[[runs]]")
        before, after = head.split("[unknown]")
        _, after = after.split("[nuisance]")
        text = f"{before}[effects]\nonly = []\n[nuisance]{after}[[runs]]{runs[0]}"
        (tmp_path / "experiment.toml").write_text(text)
        (tmp_path / "steps.csv").write_bytes((folder / "steps.csv").read_bytes())
    findings = close_loop(load_experiment(tmp_path / "experiment.toml", CATALOGUE), memory=tmp_path / "fits")
    assert findings.verdict == "not in the library"
    assert findings.before == ()
    assert "no candidate effect was to be tried" in findings.summary[0]
    assert any("no run could be left out" in line for line in findings.summary)
    assert any("Nothing is declared unknown" in line for line in findings.check)


def _change(run: RunFinding, which: str, start: float, end: float) -> float:
    series = getattr(run, which)
    near = [int(np.argmin(np.abs(run.time - at))) for at in (start, end)]
    # Half a second on either side: the sensor's increment is 0.02 mm.
    width = max(1, round(0.25 / float(run.time[1] - run.time[0])))
    return float(np.subtract(*[series[max(0, k - width) : k + width].mean() for k in reversed(near)]))


def test_bias_spring_bench(measured_data: Path, tmp_path: Path) -> None:
    """Below 0.12 mm on the fit runs and 0.55 mm on the run that was held out, and both events of Step02 right in sign."""
    assert measured_data.is_dir()
    findings = close_loop(
        load_experiment(STUDIES / "bias_spring_bench" / "experiment.toml", CATALOGUE), memory=tmp_path
    )
    assert 0.40e-3 < pooled(findings.runs, "fit", "before") < 0.50e-3
    assert pooled(findings.runs, "fit", "after") < 0.12e-3
    assert pooled(findings.runs, "held-out", "after") < 0.55e-3
    assert findings.verdict == "partly explained"
    assert "thermal_expansion" in _added(findings)
    step = next(run for run in findings.runs if run.name == "Step02")
    creep = {which: _change(step, which, 15.0, 29.9) for which in ("measured", "before", "after")}
    rebound = {which: _change(step, which, 29.9, 36.5) for which in ("measured", "before", "after")}
    assert creep["before"] > 0.0 > creep["measured"]
    assert -0.6e-3 < creep["after"] < -0.25e-3
    assert rebound["before"] < 0.5e-3
    assert rebound["after"] > 0.5e-3
    assert abs(rebound["after"] - rebound["measured"]) < 0.4e-3


def test_isobaric_flexinol(measured_data: Path, tmp_path: Path) -> None:
    """The held-out stress of 172 MPa at most 0.06 % strain off, from about 0.165."""
    assert measured_data.is_dir()
    findings = close_loop(
        load_experiment(STUDIES / "flexinol_isobaric" / "experiment.toml", CATALOGUE), memory=tmp_path
    )
    assert pooled(findings.runs, "held-out", "before") > 0.12e-2
    assert pooled(findings.runs, "held-out", "after") < 0.06e-2
    assert _added(findings)
