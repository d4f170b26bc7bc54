"""Young's modulus that differs between the phases, where the base model has one for both."""

from __future__ import annotations

from typing import ClassVar

import jax.numpy as jnp

from smajax.core.parameters import all_by_numpy, by_numpy, parameter
from smajax.model.effects.base import AbstractEffect
from smajax.model.effects.candidate import Actuator, Candidate, Width
from smajax.model.load.coupon import Coupon
from smajax.model.types import Scalar
from smajax.model.wire.constitutive import ConstitutiveTerm
from smajax.model.wire.form import RateForm
from smajax.model.wire.wire import Wire


def _applies(system: Actuator) -> bool:
    if isinstance(system.load, Coupon) and isinstance(system.wire.constitutive.form, RateForm):
        return False
    wire = all_by_numpy(system.wire)
    hot, cold = (float(_own(wire, phase)) for phase in by_numpy(jnp.asarray([0.0, 1.0])))
    return abs(hot - cold) < 1e-6 * cold


class PhaseModulus(AbstractEffect, ConstitutiveTerm):
    r"""$E = E_M [1 + a (1 - \xi)]$: eq. 3.15 with $E_A = (1 + a) E_M$.

    A candidate of wires whose base model has one modulus (`wire.stiffness.Constant`, as sec. 3.3 takes it, or $E_A = E_M$);
    where it has two, give `young_modulus_austenite` as an unknown instead.

    In the source's rate form of eq. 3.2 the modulus multiplies rates alone: transforming under a constant stress $\sigma$ leaves no
    elastic mismatch $\sigma(1/E_A - 1/E_M)$, and a cycle that heats under one stress and cools under another does not
    close. The integrated form (`wire.constitutive.IntegratedForm`) has the first and not the second. So a coupon whose
    stress is given has no such candidate in rate form; `elastic_mismatch` is what the rate form leaves out there.
    """

    contrast: Scalar = parameter("-", -0.5, 5.0, "a: relative change of E from martensite to austenite", default=0.0)

    effect_name: ClassVar[str] = "phase_modulus"
    candidate: ClassVar[Candidate] = Candidate(
        title="Young's modulus depending on the phase",
        equation="constitutive",
        formula="E = E_M [1 + a (1 - xi)] in eq. 3.2 (Elahinia 2004, eq. 3.15, E_A = (1 + a) E_M)",
        sentence="Austenite is stiffer than martensite: a hot wire stretches less than a cold one when its load changes.",
        negative_sentence="Austenite is softer than martensite: a hot wire stretches more than a cold one when its load changes.",
        switches=("contrast",),
        initial_guess={"contrast": 0.5},
        applies=_applies,
        prior_class="material",
        widths={
            "contrast": Width(1.5, "Elahinia 2004, Table 3.2: 28 and 75 GPa; NiTi data sheets: 28 to 41 and 83 GPa"),
        },
    )

    def modulus_change(self, wire: Wire, fraction: Scalar) -> Scalar | float:
        return self.contrast * (1.0 - fraction) * _own(wire, jnp.ones_like(fraction))


def _own(wire: Wire, fraction: Scalar) -> Scalar:
    """The base model's modulus, Pa."""
    law = wire.constitutive
    return law.stiffness.young_modulus(law.young_modulus_austenite, law.young_modulus_martensite, fraction)
