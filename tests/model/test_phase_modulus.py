"""A modulus of each phase where the base model has one: eq. 3.15 exactly, and found in what an independent rig shows."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import jax.numpy as jnp
import numpy as np
import pytest

from smajax.attribution.close_loop import close_loop
from smajax.core.parameters import set_parameters
from smajax.data.experiment.load import load_experiment
from smajax.data.model_catalogue import CATALOGUE, candidates
from smajax.model.extended import extended
from smajax.model.presets import build
from smajax.model.system import System
from smajax.model.wire.form import AbstractForm, IntegratedForm, RateForm
from smajax.model.wire.stiffness import Constant
from smajax.simulation.compiled import simulate_compiled
from studies.attribution_benchmark.cases import cases
from studies.attribution_benchmark.write import write

MARTENSITE, AUSTENITE = 28e9, 75e9
CONTRAST = AUSTENITE / MARTENSITE - 1.0
RIG = build("flexinol_ht_500um", "bias_spring", "duty")
TEMPTING = ("phase_modulus", "thermal_expansion", "stress_dependent_strain", "series_compliance", "two_way_memory")


def _moduli(system: System, austenite: float) -> System:
    return set_parameters(system, {"young_modulus_austenite": austenite, "young_modulus_martensite": MARTENSITE})


def _constitutive(system: System, **changed: object) -> System:
    law = dataclasses.replace(system.wire.constitutive, **changed)
    return dataclasses.replace(system, wire=dataclasses.replace(system.wire, constitutive=law))


@pytest.mark.parametrize(
    ("form", "constant"), [(RateForm(), True), pytest.param(IntegratedForm(), False, marks=pytest.mark.slow)]
)
def test_the_effect_turns_one_modulus_into_the_mixture_of_two(form: AbstractForm, constant: bool) -> None:
    inputs = {"duty": 0.35 * jnp.concatenate([jnp.ones(150), 0.5 * jnp.ones(50), jnp.ones(50), jnp.zeros(200)])}
    two = _constitutive(_moduli(RIG, AUSTENITE), form=form)
    one = _constitutive(_moduli(RIG, AUSTENITE if constant else MARTENSITE), form=form)
    if constant:  # whatever E_A says
        one = _constitutive(one, stiffness=Constant())
    asked = simulate_compiled(two, inputs, 0.05)
    told = simulate_compiled(extended(one, ("phase_modulus",), {"phase_modulus.contrast": CONTRAST}), inputs, 0.05)
    plain = simulate_compiled(one, inputs, 0.05)
    stroke = float(jnp.ptp(asked.reading))
    np.testing.assert_allclose(told.reading, asked.reading, atol=1e-7 * stroke)
    assert float(jnp.abs(plain.reading - asked.reading).max()) > 1e-2 * stroke


def test_a_wire_of_two_moduli_does_not_have_the_candidate() -> None:
    assert "phase_modulus" not in candidates(RIG, None, ())
    assert "phase_modulus" in candidates(_moduli(RIG, MARTENSITE), None, ())


def test_a_coupon_under_stress_by_the_rate_form_does_not_have_the_candidate() -> None:
    """It leaves no elastic mismatch there; the integrated form does."""
    coupon = _moduli(build("flexinol_isobaric", "coupon", "none"), MARTENSITE)
    assert "phase_modulus" not in candidates(_constitutive(coupon, form=RateForm()), None, ())
    assert "phase_modulus" in candidates(_constitutive(coupon, form=IntegratedForm()), None, ())


@pytest.mark.slow  # a loop
def test_a_phase_modulus_is_found_when_the_experiment_has_one_modulus(tmp_path: Path) -> None:
    name = "bias_spring-null-0-00"
    true = write(next(case for case in cases() if case.name == name), tmp_path)
    assert (true.wire.young_modulus_austenite, true.wire.young_modulus_martensite) == (AUSTENITE, MARTENSITE)
    path = tmp_path / name / "experiment.toml"
    one = "\n".join(f'young_modulus_{phase} = "28 GPa"' for phase in ("austenite", "martensite"))
    path.write_text(
        path.read_text(encoding="utf-8").replace("[model.parameters]", f"[model.parameters]\n{one}"), encoding="utf-8"
    )
    experiment = load_experiment(path, CATALOGUE)
    findings = close_loop(dataclasses.replace(experiment, effects_only=TEMPTING))
    assert findings.verdict == "explained"
    (found,) = [effect for effect in findings.effects if effect.added]
    assert found.name == "phase_modulus"
    contrast = found.coefficients["contrast"]
    assert contrast.standard_error is not None
    assert abs(contrast.value - CONTRAST) < 3.0 * contrast.standard_error
    assert contrast.standard_error < 0.1
    held_out = [run for run in findings.runs if run.role == "held-out"]
    assert all(run.rmse_after < 1.2 * experiment.noise_sigma for run in held_out)
