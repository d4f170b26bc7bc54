"""The wire: its dimensions and the constants of its four laws. The equations are in the file of each law beside this one."""

from __future__ import annotations

import equinox as eqx

from smajax.core.parameters import parameter
from smajax.model.types import Scalar
from smajax.model.wire.branch_amplitude import AbstractRenewal, Corrected
from smajax.model.wire.conditions import AbstractConditions
from smajax.model.wire.form import AbstractForm, RateForm
from smajax.model.wire.shape import AbstractShape, Cosine
from smajax.model.wire.stiffness import AbstractStiffness, Mixed
from smajax.model.wire.variants import AbstractVariants, Single


class Heat(eqx.Module):
    """Constants of eq. 3.1 (`heat.py`)."""

    density: Scalar = parameter("kg/m^3", 1e3, 2e4, "density of the wire")
    specific_heat: Scalar = parameter("J/(kg K)", 50.0, 5e3, "specific heat of the wire")
    convection_coefficient: Scalar = parameter("W/(m^2 K)", 1.0, 5e3, "heat lost per surface and degree")
    ambient_temperature: Scalar = parameter("degC", -100.0, 150.0, "temperature of the air around the wire")


class Resistance(eqx.Module):
    """Resistivity of the two phases (`resistance.py`)."""

    resistivity_austenite: Scalar = parameter("ohm m", 1e-7, 1e-5, "resistivity of austenite")
    resistivity_martensite: Scalar = parameter("ohm m", 1e-7, 1e-5, "resistivity of martensite")


class Kinetics(eqx.Module):
    """Transformation temperatures at zero stress, their slopes, and the four parts of a law (`kinetics.py`)."""

    austenite_start: Scalar = parameter("degC", -100.0, 400.0, "A_s at zero stress")
    austenite_finish: Scalar = parameter("degC", -100.0, 400.0, "A_f at zero stress")
    martensite_start: Scalar = parameter("degC", -150.0, 400.0, "M_s at zero stress")
    martensite_finish: Scalar = parameter("degC", -150.0, 400.0, "M_f at zero stress")
    stress_slope_austenite: Scalar = parameter("Pa/K", 1e6, 1e8, "C_A: stress per degree of A_s and A_f")
    stress_slope_martensite: Scalar = parameter("Pa/K", 1e6, 1e8, "C_M: stress per degree of M_s and M_f")
    conditions: AbstractConditions
    shape: AbstractShape = Cosine()
    renewal: AbstractRenewal = Corrected()
    variants: AbstractVariants = Single()


class Constitutive(eqx.Module):
    """Constants of eq. 3.2, which of them depend on the fraction, and the form in which it is integrated (`constitutive.py`)."""

    young_modulus_austenite: Scalar = parameter("Pa", 1e9, 2e11, "E_A")
    young_modulus_martensite: Scalar = parameter("Pa", 1e9, 2e11, "E_M")
    recoverable_strain: Scalar = parameter("-", 0.0, 0.12, "eps_L: strain between all martensite and all austenite")
    thermal_modulus: Scalar = parameter(
        "Pa/K", -5e6, 5e6, "theta_T = -E alpha; the source prints +0.55 MPa/C, which is a wire that shrinks when heated"
    )
    stiffness: AbstractStiffness = Mixed()
    form: AbstractForm = RateForm()


class Wire(eqx.Module):
    """One wire and its four laws."""

    wire_length: Scalar = parameter("m", 1e-3, 1e2, "l_0")
    wire_diameter: Scalar = parameter("m", 1e-5, 1e-2, "d")
    heat: Heat
    resistance: Resistance
    kinetics: Kinetics
    constitutive: Constitutive
