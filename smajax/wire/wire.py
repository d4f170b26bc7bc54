"""The wire: heat, resistance, kinetics and constitutive law together."""

from __future__ import annotations

from collections.abc import Sequence

import equinox as eqx
import jax.numpy as jnp

from smajax.effects.base import AbstractEffect
from smajax.parameters import parameter
from smajax.types import Scalar, WireState
from smajax.wire.constitutive import Constitutive
from smajax.wire.heat import Heat
from smajax.wire.kinetics import Kinetics, austenite_left, martensite_left
from smajax.wire.resistance import Resistance


class Wire(eqx.Module):
    """One wire and its four laws."""

    wire_length: Scalar = parameter("m", 1e-3, 1e2, "l_0")
    wire_diameter: Scalar = parameter("m", 1e-5, 1e-2, "d")
    heat: Heat
    resistance: Resistance
    kinetics: Kinetics
    constitutive: Constitutive


def start(
    wire: Wire,
    effects: Sequence[AbstractEffect],
    temperature: Scalar,
    stress: Scalar,
    strain: Scalar,
    fraction: Scalar,
) -> WireState:
    """A wire at rest at the given temperature (C), stress (Pa), martensite fraction, and strain, which counts from here.

    xi_M = 1 and xi_A = 0 for a fully martensitic cold wire, as the source says (sec. 3.7); anywhere else both curves
    are laid through the given state.
    """
    h = martensite_left(wire.kinetics, effects, temperature, stress)
    k = austenite_left(wire.kinetics, effects, temperature, stress)
    kept = wire.kinetics.renewal.start(h, k, fraction)
    detwinned = wire.kinetics.variants.detwinned_at_start(stress, fraction)
    zero = jnp.zeros_like(stress)
    return WireState(
        temperature,
        stress,
        strain,
        fraction,
        kept.xi_M,
        kept.xi_A,
        kept.heating_missed + zero,
        kept.cooling_missed + zero,
        detwinned,
        zero,
    )
