"""The wire: heat, resistance, kinetics and constitutive law together."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

import equinox as eqx
import jax.numpy as jnp

from smajax.core.parameters import parameter
from smajax.model.effects.base import AbstractEffect
from smajax.model.types import Scalar, WireState
from smajax.model.wire.constitutive import Constitutive
from smajax.model.wire.heat import Heat
from smajax.model.wire.kinetics import Kinetics, austenite_left, martensite_left
from smajax.model.wire.resistance import Resistance
from smajax.model.wire.two_populations import begun


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
    zero = jnp.zeros_like(stress)
    kept: dict[str, Scalar] = {}
    for effect in effects:
        kept.update(effect.kept_at_start(temperature, stress, fraction))
    detwinned = wire.kinetics.variants.detwinned_at_start(stress, fraction)
    whole = WireState(temperature, stress, strain, fraction, zero + 1.0, zero, zero, zero, detwinned + zero, zero, kept)
    h = martensite_left(wire.kinetics, effects, temperature, stress, whole)
    k = austenite_left(wire.kinetics, effects, temperature, stress, whole)
    laid = wire.kinetics.renewal.start(h, k, fraction)
    whole = dataclasses.replace(
        whole,
        xi_M=laid.xi_M,
        xi_A=laid.xi_A,
        heating_missed=laid.heating_missed + zero,
        cooling_missed=laid.cooling_missed + zero,
    )
    return begun(effects, whole)
