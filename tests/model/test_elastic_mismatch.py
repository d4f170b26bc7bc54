"""Elastic strain that goes with the phase: the integrated form of the constitutive law, found in coupons of the rate form."""

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
from smajax.model.wire.form import IntegratedForm, RateForm
from smajax.simulation.compiled import simulate_compiled
from studies.attribution_benchmark.cases import cases
from studies.attribution_benchmark.write import write
from tests.helpers.often import often

MARTENSITE, AUSTENITE = 28e9, 75e9
ON = {"elastic_mismatch.contrast": AUSTENITE / MARTENSITE - 1.0}
COUPON = set_parameters(
    build("flexinol_isobaric", "coupon", "none"),
    {"young_modulus_austenite": AUSTENITE, "young_modulus_martensite": MARTENSITE},
)
TEMPTING = ("elastic_mismatch", "thermal_expansion", "stress_dependent_width", "minor_loops", "two_way_memory")


def _formed(form: RateForm | IntegratedForm, system: System = COUPON) -> System:
    law = dataclasses.replace(system.wire.constitutive, form=form)
    return dataclasses.replace(system, wire=dataclasses.replace(system.wire, constitutive=law))


def _heated_under_one_stress_and_cooled_under_another() -> dict[str, jnp.ndarray]:
    share = np.linspace(0.0, 1.0, 401)
    temperature = np.interp(share, [0.0, 0.4, 0.6, 1.0], [30.0, 130.0, 130.0, 30.0])
    stress = np.interp(share, [0.0, 0.45, 0.55, 0.9, 1.0], [180e6, 180e6, 60e6, 60e6, 180e6])
    return {"temperature": jnp.asarray(temperature), "stress": jnp.asarray(stress)}


def test_with_the_wires_own_moduli_the_rate_form_becomes_the_integrated_one() -> None:
    """Elahinia 2004, eq. 4.51 with the thermal term; and its cycle closes, which that of the rate form does not."""
    inputs = _heated_under_one_stress_and_cooled_under_another()
    rates, integrated = (simulate_compiled(_formed(form), inputs, 1.0) for form in (RateForm(), IntegratedForm()))
    found = simulate_compiled(extended(_formed(RateForm()), ("elastic_mismatch",), ON), inputs, 1.0)
    assert float(found.martensite_fraction.min()) == 0.0
    assert float(found.martensite_fraction[-1]) == 1.0
    np.testing.assert_allclose(found.reading, integrated.reading, atol=1e-14)
    assert abs(float(found.reading[-1])) < 1e-12
    assert abs(float(rates.reading[-1])) > 1e-3


@pytest.mark.parametrize(
    ("load", "volts"), often([("dead_weight", 60.0), ("bias_spring", 60.0), ("arm", 16.0)], [("dead_weight", 60.0)])
)
def test_a_moving_load_by_rates_becomes_that_of_the_integrated_form(load: str, volts: float) -> None:
    """Their motions differ by far more than this effect leaves."""
    wire = "niti_table_3_1" if load == "arm" else "flexinol_table_3_2"
    base = set_parameters(
        build(wire, load, "voltage"), {"young_modulus_austenite": AUSTENITE, "young_modulus_martensite": MARTENSITE}
    )
    time = np.arange(0.0, 20.0, 0.02)
    inputs = {
        "voltage": jnp.asarray(np.select([time < 1.0, time < 8.0, time < 12.0, time < 16.0], [0.0, volts, 2.0, volts]))
    }
    rates, integrated = (
        simulate_compiled(_formed(form, base), inputs, 0.02) for form in (RateForm(), IntegratedForm())
    )
    found = simulate_compiled(extended(_formed(RateForm(), base), ("elastic_mismatch",), ON), inputs, 0.02)
    stroke = float(jnp.ptp(integrated.reading))
    assert float(jnp.abs(rates.reading - integrated.reading).max()) > 0.01 * stroke
    np.testing.assert_allclose(found.reading, integrated.reading, atol=1e-9 * stroke)


def test_models_of_the_rate_form_alone_have_the_candidate() -> None:
    assert "elastic_mismatch" in candidates(_formed(RateForm()), None, ())
    assert "elastic_mismatch" not in candidates(_formed(IntegratedForm()), None, ())
    for load in ("dead_weight", "bias_spring", "arm"):
        base = build("flexinol_isobaric", load, "voltage")
        assert "elastic_mismatch" in candidates(_formed(RateForm(), base), None, ())
        assert "elastic_mismatch" not in candidates(_formed(IntegratedForm(), base), None, ())


@pytest.mark.slow  # a loop
@pytest.mark.parametrize("hidden", [True, False])
def test_it_is_found_in_an_independent_coupon_that_has_it_and_in_none_that_has_not(
    hidden: bool, tmp_path: Path
) -> None:
    name = "coupon-elastic_mismatch-10-02" if hidden else "coupon-null-0-01"
    true = write(next(case for case in cases() if case.name == name), tmp_path)
    experiment = load_experiment(tmp_path / name / "experiment.toml", CATALOGUE)
    findings = close_loop(dataclasses.replace(experiment, effects_only=TEMPTING))
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
