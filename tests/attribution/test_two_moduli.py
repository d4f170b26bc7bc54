"""Effects of a wire whose phases have two moduli are found by the loop in runs of an independent simulator."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import pytest

from smajax.attribution.close_loop import close_loop
from smajax.data.experiment.load import load_experiment
from smajax.data.model_catalogue import CATALOGUE
from studies.attribution_benchmark.cases import cases
from studies.attribution_benchmark.write import write

MARTENSITE, AUSTENITE = 28e9, 75e9
CONTRAST = AUSTENITE / MARTENSITE - 1.0
BESIDE_MISMATCH = ("elastic_mismatch", "thermal_expansion", "stress_dependent_width", "minor_loops", "two_way_memory")
BESIDE_MODULUS = (
    "phase_modulus",
    "thermal_expansion",
    "stress_dependent_strain",
    "series_compliance",
    "two_way_memory",
)


@pytest.mark.slow  # a loop
@pytest.mark.parametrize("hidden", [True, False])
def test_an_elastic_mismatch_is_found_in_an_independent_coupon_that_has_it_and_in_none_that_has_not(
    hidden: bool, tmp_path: Path
) -> None:
    name = "coupon-elastic_mismatch-10-02" if hidden else "coupon-null-0-01"
    true = write(next(case for case in cases() if case.name == name), tmp_path)
    experiment = load_experiment(tmp_path / name / "experiment.toml", CATALOGUE)
    findings = close_loop(dataclasses.replace(experiment, effects_only=BESIDE_MISMATCH))
    added = [effect for effect in findings.effects if effect.added]
    if not hidden:
        assert (findings.verdict, added) == ("adequate", [])
        return
    assert findings.verdict == "explained"
    assert [effect.name for effect in added] == ["elastic_mismatch"]
    # The generator has the share `elastic_mismatch` of sigma (1/E_M - 1/E_A), the library a modulus of its own.
    own = added[0].coefficients["contrast"]
    share = (1.0 - 1.0 / (1.0 + own.value)) / (1.0 - MARTENSITE / AUSTENITE)
    assert share == pytest.approx(true.effects["elastic_mismatch"], rel=0.15)
    assert all(run.rmse_after < 1.2 * experiment.noise_sigma for run in findings.runs if run.role == "held-out")


@pytest.mark.slow  # a loop
def test_a_phase_modulus_is_found_when_the_experiment_has_one_modulus(tmp_path: Path) -> None:
    name = "bias_spring-null-0-00"
    true = write(next(case for case in cases() if case.name == name), tmp_path)
    assert (true.wire.young_modulus_austenite, true.wire.young_modulus_martensite) == (AUSTENITE, MARTENSITE)
    path = tmp_path / name / "experiment.toml"
    one = "\n".join(f'young_modulus_{phase} = "28 GPa"' for phase in ("austenite", "martensite"))
    # What is given has no prior beside it.
    lines = [line for line in path.read_text(encoding="utf-8").splitlines() if not line.startswith("young_modulus_")]
    path.write_text(
        "\n".join(lines).replace("[model.parameters]", f"[model.parameters]\n{one}") + "\n", encoding="utf-8"
    )
    experiment = load_experiment(path, CATALOGUE)
    findings = close_loop(dataclasses.replace(experiment, effects_only=BESIDE_MODULUS))
    assert findings.verdict == "explained"
    (found,) = [effect for effect in findings.effects if effect.added]
    assert found.name == "phase_modulus"
    contrast = found.coefficients["contrast"]
    assert contrast.standard_error is not None
    assert abs(contrast.value - CONTRAST) < 3.0 * contrast.standard_error
    assert contrast.standard_error < 0.1
    held_out = [run for run in findings.runs if run.role == "held-out"]
    assert all(run.rmse_after < 1.2 * experiment.noise_sigma for run in held_out)
