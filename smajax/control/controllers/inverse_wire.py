"""The wire read backwards: angle and stress -> martensite fraction -> temperature, and power -> voltage (sec. 4.8).

Of the `System` that a controller believes in: eq. 4.51 to 4.53, 4.72 to 4.74 and 4.69. Its effects, its thermal modulus
and other forms of its stiffness are passed over, as the section passes them over, or come in through `strain_offset`.
"""

from __future__ import annotations

import jax.numpy as jnp
from jaxtyping import Array, Bool

from smajax.control.load_equation import equation_of, force_per_stress, moving_load
from smajax.control.measured_state import MeasuredState
from smajax.core.limited import limited
from smajax.model.system import System
from smajax.model.types import Scalar
from smajax.model.wire.heat import convection, mass_per_metre
from smajax.model.wire.resistance import resistance_per_metre
from smajax.model.wire.wire import Kinetics

# An amplitude of less than this is none: what is left of a branch is then taken as all of it.
NONE_LEFT = 1e-9
SMALLEST_VOLTAGE = 1e-3  # V: below it the voltage falls in proportion to the power, so that its slope stays finite
SMALLEST_ROOT = 1e-12  # of a discriminant, in units of (E_A eps_L)^2


def strain_at_angle(believed: System, position: Scalar) -> Scalar:
    r"""$\varepsilon = -2 r (\theta - \theta_0)/l_0 + \varepsilon_L + \sigma_0/E_M$, - (eq. 4.53).

    From the unloaded austenite. The source leaves out the last term, and with it the stress of the wire at rest.
    """
    load, law = moving_load(believed), believed.wire.constitutive
    start = load.start()
    at_rest = equation_of(believed).resistance(start, jnp.zeros_like(start)) / force_per_stress(believed)
    elastic = jnp.where(at_rest > 0.0, at_rest, 0.0) / law.young_modulus_martensite
    return law.recoverable_strain + elastic - load.contraction(believed.wire) * (position - start)


def strain_offset(believed: System, measured: MeasuredState) -> Scalar:
    r"""By how much eq. 4.53 is off at a measured state, -: the strain of the position less $\sigma/E(\xi) + \varepsilon_L \xi$.

    Zero of a wire of eq. 4.51. Of one with a thermal term, in rate form or with effects, what they add: with the strain
    corrected by it, what is read backwards passes through the measured state, and only differences are those of eq. 4.51.
    """
    law = believed.wire.constitutive
    softer = law.young_modulus_martensite - law.young_modulus_austenite
    modulus = law.young_modulus_austenite + measured.martensite_fraction * softer
    carried = measured.stress / modulus + law.recoverable_strain * measured.martensite_fraction
    return strain_at_angle(believed, measured.position) - carried


def stress_slopes(
    believed: System, position: Scalar, fraction: Scalar, offset: Scalar | float = 0.0
) -> tuple[Scalar, Scalar]:
    r"""(Gamma, $-2 r E(\xi)/l_0$): stress per fraction and per radian, Pa and Pa/rad (eq. 4.61)."""
    law = believed.wire.constitutive
    softer = law.young_modulus_martensite - law.young_modulus_austenite
    modulus = law.young_modulus_austenite + fraction * softer
    elastic = strain_at_angle(believed, position) - offset - law.recoverable_strain * fraction
    per_fraction = softer * elastic - modulus * law.recoverable_strain
    return per_fraction, -moving_load(believed).contraction(believed.wire) * modulus


def fraction_for(believed: System, position: Scalar, stress: Scalar, offset: Scalar | float = 0.0) -> Scalar:
    r"""Root of $[E_A + \xi (E_M - E_A)](\varepsilon - \varepsilon_L \xi) = \sigma$ in [0, 1] (eq. 4.72), -.

    offset: of the strain (`strain_offset`). At the end that lies nearer where no fraction gives that stress.
    """
    law = believed.wire.constitutive
    strain = strain_at_angle(believed, position) - offset
    softer = law.young_modulus_martensite - law.young_modulus_austenite
    scale = law.young_modulus_austenite * law.recoverable_strain
    # 0 = square xi^2 - line xi + constant; the smaller root, in the form that needs no square term.
    line = scale - softer * strain
    constant = law.young_modulus_austenite * strain - stress
    square = -law.recoverable_strain * softer
    discriminant = line**2 - 4.0 * square * constant
    smallest = SMALLEST_ROOT * scale**2
    real = jnp.where(discriminant > smallest, discriminant, smallest)
    return limited(2.0 * constant / (line + jnp.sqrt(real)), 0.0, 1.0)


def bounded_arccos(value: Scalar, edge: Scalar) -> Scalar:
    r"""arccos with the slope held at that of $\pm(1 - \mathrm{edge})$ beyond it, $1/\sqrt{2\,\mathrm{edge}}$ about; flat beyond +-1."""
    # By the distance to the nearer end: 1 - value^2 and arccos itself lose it, in single precision all but one digit at the edge.
    negative = value < 0.0
    distance = jnp.where(negative, 1.0 + value, 1.0 - value)
    within, held = limited(distance, 0.0, 1.0), limited(distance, edge, 1.0)
    from_end = 2.0 * jnp.arcsin(jnp.sqrt(0.5 * held)) - (held - within) / jnp.sqrt(held * (2.0 - held))
    return jnp.where(negative, jnp.pi - from_end, from_end)


def temperature_for(
    law: Kinetics,
    fraction: Scalar,
    stress: Scalar,
    heating: Bool[Array, ""],
    xi_M: Scalar,
    xi_A: Scalar,
    edge: Scalar,
) -> Scalar:
    """Temperature at which the wire has that fraction, on the heating curve (eq. 4.73) or the cooling curve (4.74), C."""
    left = jnp.where(xi_M > NONE_LEFT, fraction / jnp.where(xi_M > NONE_LEFT, xi_M, 1.0), 0.0)
    room = 1.0 - xi_A
    formed = jnp.where(room > NONE_LEFT, (1.0 - fraction) / jnp.where(room > NONE_LEFT, room, 1.0), 1.0)
    hot = (law.austenite_finish - law.austenite_start) / jnp.pi * bounded_arccos(2.0 * left - 1.0, edge)
    cold = (law.martensite_start - law.martensite_finish) / jnp.pi * bounded_arccos(1.0 - 2.0 * formed, edge)
    return jnp.where(
        heating,
        law.austenite_start + hot + stress / law.stress_slope_austenite,
        law.martensite_finish + cold + stress / law.stress_slope_martensite,
    )


def power_for(believed: System, temperature: Scalar, rate: Scalar) -> Scalar:
    r"""$U = m c_p \dot T + h_c A_c (T - T_\infty)$, W/m (eq. 4.68, 4.80)."""
    wire = believed.wire
    loss = convection(wire, temperature, wire.heat.ambient_temperature)
    return mass_per_metre(wire) * wire.heat.specific_heat * rate + loss


def voltage_for(believed: System, power: Scalar, temperature: Scalar, fraction: Scalar, largest: Scalar) -> Scalar:
    """V = sqrt(U R) (eq. 4.69) through the amplifier; nothing for a negative power (sec. 4.8.3), `largest` at most.

    Of a current source the current, of a power supply the power.
    """
    wire, drive = believed.wire, believed.drive
    ohms = resistance_per_metre(wire, (), temperature, fraction)
    at_one = drive.power(ohms, wire.wire_length, drive.from_command(jnp.ones_like(power)))
    squared = power / at_one
    if drive.command[1] == "W":
        return limited(squared, 0.0, largest)
    large = squared > SMALLEST_VOLTAGE**2
    root = jnp.sqrt(jnp.where(large, squared, 1.0))
    return limited(jnp.where(large, root, squared / SMALLEST_VOLTAGE), 0.0, largest)
