"""The equation of motion of any moving load, as a controller that is derived from it reads it.

    inertia a + resistance(x, v) = lever A_w sigma,      strain = strain_0 - (lever / l_0) (x - start)

The first is the load's own (`model.load.base`), with what effects of the model add to its resistance; friction that sticks
and forces that change in time are left out, as disturbances. Of the second the lever follows by virtual work, which says
whether a load's lever and contraction are of one mechanism.
"""

from __future__ import annotations

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from smajax.model.load.base import AbstractMovingLoad
from smajax.model.load.force import ForceTerm, load_resistance
from smajax.model.system import System
from smajax.model.types import Scalar
from smajax.model.wire.heat import cross_section
from smajax.model.wire.wire import Wire


class LoadEquation(eqx.Module):
    """A load and the forces that effects add to it. Positions in m (rad), forces on the position in N (N m)."""

    load: AbstractMovingLoad
    forces: tuple[ForceTerm, ...] = ()

    def lever(self) -> Scalar | float:
        """Force on the position per newton in the wire: -, or m for an angle."""
        return self.load.lever()

    def inertia(self) -> Scalar:
        """kg, or kg m^2 for an angle."""
        return self.load.inertia({})

    def resistance(self, position: Scalar, velocity: Scalar) -> Scalar:
        """Force against the position, N or N m: any function of both that `jax` differentiates."""
        return load_resistance(self.load, self.forces, jnp.zeros_like(position), position, velocity, {})


def equation_of(system: System) -> LoadEquation:
    """That of a system's load. Raises ValueError of a load that does not move."""
    return LoadEquation(moving_load(system), tuple(system.terms.force))


def moving_load(system: System) -> AbstractMovingLoad:
    """Raises ValueError of a load that does not move."""
    if not isinstance(system.load, AbstractMovingLoad):
        raise ValueError(f"a {type(system.load).__name__} moves nothing that a controller could lead.")
    return system.load


def force_per_stress(system: System) -> Scalar:
    """alpha = lever A_w, N/Pa (N m/Pa): 2 r A_w of the arm (Elahinia 2004, below eq. 4.50)."""
    return moving_load(system).lever() * cross_section(system.wire)


def lever_by_virtual_work(load: AbstractMovingLoad, wire: Wire) -> Scalar:
    """-l_0 d(strain)/d(position): what A_w sigma does along the wire it does along the position."""

    def strain(position: Scalar) -> Scalar:
        return -load.contraction(wire) * (position - load.start())

    return -wire.wire_length * jax.grad(strain)(jnp.asarray(load.start(), dtype=float))


def stroke_of(system: System) -> Scalar:
    """Way from the start to all austenite, m (rad): the recoverable strain, up to the upper stop."""
    load = moving_load(system)
    whole = system.wire.constitutive.recoverable_strain / load.contraction(system.wire)
    return jnp.minimum(whole, load.limits()[1] - load.start())


def missing_for_equation(system: System) -> str:
    """What of the equation of motion the load does not give, in words; "" where it is whole.

    Of values that are known: under `jit` nothing is said.
    """
    load = moving_load(system)
    if load.inputs_required:
        names = ", ".join(sorted(load.inputs_required))
        return f"its equation of motion needs the input {names}, which no controller is told"
    equation = equation_of(system)
    at = jnp.asarray(load.start(), dtype=float) + 0.5 * stroke_of(system)
    slope = jax.jacfwd(equation.resistance, argnums=(0, 1))
    try:
        values = {
            "its lever": (equation.lever(), True),
            "its inertia": (equation.inertia(), True),
            "its resistance": (equation.resistance(at, jnp.zeros_like(at)), False),
            "the derivative of its resistance": (jnp.stack(slope(at, jnp.zeros_like(at))), False),
        }
    except NotImplementedError as error:
        return f"a part of its equation of motion is not implemented ({error})"
    for name, (value, positive) in values.items():
        if isinstance(value, jax.core.Tracer):
            continue
        number = np.asarray(value, dtype=float)
        if not np.isfinite(number).all() or (positive and not (number > 0.0).all()):
            return f"{name} is {number.ravel()[0]:g}, expected a finite number{' above 0' if positive else ''}"
    return ""


def missing_for_stroke(system: System) -> str:
    """The same of the stroke."""
    value = stroke_of(system)
    if isinstance(value, jax.core.Tracer) or 0.0 < float(value) < np.inf:
        return ""
    return (
        f"its stroke is {float(value):g}: of the wire's recoverable strain, the load's contraction and its upper stop"
    )
