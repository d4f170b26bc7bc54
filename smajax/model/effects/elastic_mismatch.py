"""Elastic strain that goes with the phase at a held stress: the integrated form of the constitutive law, where the base has rates."""

from __future__ import annotations

from typing import ClassVar

from smajax.core.parameters import parameter
from smajax.model.effects.base import AbstractEffect
from smajax.model.effects.candidate import Actuator, Candidate, Width
from smajax.model.types import Scalar, WireState
from smajax.model.wire.constitutive import ConstitutiveTerm
from smajax.model.wire.form import RateForm
from smajax.model.wire.history import HistoryTerm
from smajax.model.wire.wire import Wire

OF_STRESS, OF_TEMPERATURE = "mismatch_of_stress", "mismatch_of_temperature"


def _applies(system: Actuator) -> bool:
    return isinstance(system.wire.constitutive.form, RateForm)


class ElasticMismatch(AbstractEffect, HistoryTerm, ConstitutiveTerm):
    r"""$\varepsilon \mathrel{+}= \int [\sigma - \theta_T (T - T_\infty)]\,d(1/E)$, $E = E_M [1 + a (1 - \xi)]$.

    The source's rate form $\dot\sigma = E \dot\varepsilon + \ldots$ (Elahinia 2004, eq. 3.2) leaves out how the elastic strain
    $\sigma/E(\xi)$ moves with the phase; its integrated form (eq. 4.51, 4.52, with the thermal term) has it. With
    $E_A = (1 + a) E_M$ for the wire's own moduli this effect turns the one into the other to rounding
    (`wire.form.IntegratedForm`), whatever the load. Under a constant stress the rate form knows nothing of the moduli.
    """

    contrast: Scalar = parameter(
        "-", -0.5, 5.0, "a: relative change of E from martensite to austenite, in the elastic strain", default=0.0
    )

    effect_name: ClassVar[str] = "elastic_mismatch"
    candidate: ClassVar[Candidate] = Candidate(
        title="elastic mismatch of the phases",
        equation="constitutive",
        formula="strain += int [sigma - theta_T (T - T_inf)] d(1/E), E = E_M [1 + a (1 - xi)]: eq. 3.2 in the integrated form "
        "(Elahinia 2004, eq. 4.51, 4.52)",
        sentence="Austenite stretches less than martensite under the same elastic stress (the stress less its thermal part), so a wire that "
        "is heated under a high stress also gives back elastic strain: the more, the higher the stress.",
        negative_sentence="Austenite stretches more than martensite under the same elastic stress (the stress less its thermal part), so a wire that "
        "is heated under a high stress recovers less: the less, the higher the stress.",
        switches=("contrast",),
        initial_guess={"contrast": 0.5},
        applies=_applies,
        prior_class="material",
        widths={
            "contrast": Width(1.5, "Elahinia 2004, Table 3.2: 28 and 75 GPa; NiTi data sheets: 28 to 41 and 83 GPa"),
        },
    )

    def _softness(self, fraction: Scalar) -> Scalar:
        """E_M/E."""
        return 1.0 / (1.0 + self.contrast * (1.0 - fraction))

    def history_at_start(self, at: WireState) -> dict[str, Scalar]:
        return {OF_STRESS: 0.0 * at.stress, OF_TEMPERATURE: 0.0 * at.stress}

    def history_after(self, old: WireState, new: WireState) -> dict[str, Scalar]:
        before, after = old.martensite_fraction, new.martensite_fraction
        first, middle, last = (self._softness(one) for one in (before, 0.5 * (before + after), after))

        def more(was: Scalar, now: Scalar) -> Scalar:
            """Change of x/E less dx/E, which the rate form has."""
            return now * last - was * first - (now - was) * middle

        return {
            OF_STRESS: old.history[OF_STRESS] + more(old.stress, new.stress),
            OF_TEMPERATURE: old.history[OF_TEMPERATURE] + more(old.temperature, new.temperature),
        }

    def strain(self, wire: Wire, at: WireState) -> Scalar | float:
        law = wire.constitutive
        # T counts from T_inf; of that constant only the change with the phase is left.
        warm = at.history[OF_TEMPERATURE] - wire.heat.ambient_temperature * self._softness(at.martensite_fraction)
        return (at.history[OF_STRESS] - law.thermal_modulus * warm) / law.young_modulus_martensite
