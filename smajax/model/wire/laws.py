"""The laws of a wire by name: the authors' kinetics (Elahinia 2004, Table 3.3), each a choice of shape, conditions and variants.

`integrated` is `enhanced` with the integrated form of the constitutive law: every cycle closes. Under the others the wire keeps
its form, that of the presets in rates.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from dataclasses import dataclass

from smajax.core.names import close_matches
from smajax.model.wire.conditions import AbstractConditions, Brinson, Enhanced, Liang
from smajax.model.wire.form import AbstractForm, IntegratedForm
from smajax.model.wire.shape import AbstractShape, Cosine, Exponential
from smajax.model.wire.variants import AbstractVariants, Single, Split
from smajax.model.wire.wire import Wire


def detwinning() -> Split:
    """Critical stresses chosen here: the source prints none, and calls the 41.6 MPa of its 75 g "enough to elongate the
    wire to fully detwinned martensite" (sec. 3.5.1)."""
    return Split(critical_stress_start=10e6, critical_stress_finish=40e6)


@dataclass(frozen=True)
class Law:
    """What makes a kinetics law that author's, and the form of the constitutive law where the name says it too."""

    shape: AbstractShape
    conditions: AbstractConditions
    variants: Callable[[], AbstractVariants]  # made when asked for: a parameter is an array of the caller's precision
    source: str
    form: AbstractForm | None = None  # of the constitutive law; None: the wire's own


LAWS: dict[str, Law] = {
    "tanaka": Law(Exponential(), Brinson(), Single, "Tanaka 1986; Elahinia 2004, eq. 2.3"),
    "liang": Law(Cosine(), Liang(), Single, "Liang and Rogers 1990; Elahinia 2004, eq. 2.8, 2.9, 3.11"),
    "brinson": Law(Cosine(), Brinson(), detwinning, "Brinson 1993; Elahinia 2004, eq. 2.14-2.17, 3.12"),
    "enhanced": Law(Cosine(), Enhanced(), Single, "Elahinia 2004, eq. 3.17, 3.18"),
    "integrated": Law(Cosine(), Enhanced(), Single, "Elahinia 2004, eq. 3.17, 3.18, 4.51", IntegratedForm()),
}


def under_law(wire: Wire, name: str) -> Wire:
    """The same wire under the named law; everything it is made of stays. KeyError lists the laws there are."""
    if not isinstance(wire, Wire):
        raise TypeError(
            f"a law is the wire's: give `system.wire`, not {type(wire).__name__}, or `compose(..., law={name!r})`."
        )
    if name not in LAWS:
        raise KeyError(f"No kinetics law `{name}`{close_matches(name, sorted(LAWS), 'there are')}.")
    law = LAWS[name]
    kinetics = dataclasses.replace(wire.kinetics, shape=law.shape, conditions=law.conditions, variants=law.variants())
    form = wire.constitutive.form if law.form is None else law.form
    return dataclasses.replace(wire, kinetics=kinetics, constitutive=dataclasses.replace(wire.constitutive, form=form))
