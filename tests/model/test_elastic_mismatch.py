"""Elastic strain that goes with the phase: the integrated form of the constitutive law, found in coupons of the rate form."""

from __future__ import annotations

import dataclasses

import jax.numpy as jnp
import numpy as np
import pytest

from smajax.core.parameters import set_parameters
from smajax.data.model_catalogue import candidates
from smajax.model.extended import extended
from smajax.model.presets import build
from smajax.model.system import System
from smajax.model.wire.form import IntegratedForm, RateForm
from smajax.simulation.compiled import simulate_compiled
from tests.helpers.often import often

MARTENSITE, AUSTENITE = 28e9, 75e9
ON = {"elastic_mismatch.contrast": AUSTENITE / MARTENSITE - 1.0}
COUPON = set_parameters(
    build("flexinol_isobaric", "coupon", "none"),
    {"young_modulus_austenite": AUSTENITE, "young_modulus_martensite": MARTENSITE},
)


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
