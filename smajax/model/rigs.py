"""The source's three rigs: which presets, which kinetics law and which form of the constitutive law go together.

A preset is one part of a `System`; the choices that several commands, figures and studies share are made here, once.
"""

from __future__ import annotations

import dataclasses

from smajax.model.presets import build
from smajax.model.system import System
from smajax.model.wire.form import AbstractForm, IntegratedForm


def arm(law: str = "enhanced", form: AbstractForm | None = None) -> System:
    """The rotary arm of section 3.1, with the rate form (eq. 3.2) of the constitutive law, as section 3.3 has it, where neither `law` nor `form` says another."""
    made = build("niti_table_3_1", "arm", "amplified_voltage", law)
    return made if form is None else _formed(made, form)


def dead_weight(law: str = "enhanced", form: AbstractForm | None = None) -> System:
    """The hanging mass of section 3.5.

    With the integrated form (eq. 4.51) of the constitutive law: under the rate form a cycle does not close (M11).
    """
    return _formed(build("flexinol_table_3_2", "dead_weight", "flexinol_voltage", law), form or IntegratedForm())


def coupon(law: str = "enhanced", load: str = "coupon", form: AbstractForm | None = None) -> System:
    """The wire of Table 3.2 on a prescribed path of temperature and stress (or strain), integrated form."""
    return _formed(build("flexinol_table_3_2", load, "none", law), form or IntegratedForm())


def _formed(system: System, form: AbstractForm) -> System:
    constitutive = dataclasses.replace(system.wire.constitutive, form=form)
    return dataclasses.replace(system, wire=dataclasses.replace(system.wire, constitutive=constitutive))
