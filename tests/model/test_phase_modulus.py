"""A modulus of each phase where the base model has one: eq. 3.15 exactly, and found in what an independent rig shows."""

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
from smajax.model.wire.form import AbstractForm, IntegratedForm, RateForm
from smajax.model.wire.stiffness import Constant
from smajax.simulation.compiled import simulate_compiled

MARTENSITE, AUSTENITE = 28e9, 75e9
CONTRAST = AUSTENITE / MARTENSITE - 1.0
RIG = build("flexinol_ht_500um", "bias_spring", "duty")


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
