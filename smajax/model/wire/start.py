"""A wire at rest, at the start of a run."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

import jax.numpy as jnp

from smajax.model.types import Scalar, WireState
from smajax.model.wire.history import HistoryTerm, history_at_start
from smajax.model.wire.kinetics import austenite_left, martensite_left
from smajax.model.wire.kinetics_terms import NO_TERMS, KineticsTerms
from smajax.model.wire.two_populations import with_second_population
from smajax.model.wire.wire import Wire


def start(
    wire: Wire,
    temperature: Scalar,
    stress: Scalar,
    strain: Scalar,
    fraction: Scalar,
    terms: KineticsTerms = NO_TERMS,
    history: Sequence[HistoryTerm] = (),
) -> WireState:
    """A wire at rest at the given temperature (C), stress (Pa), martensite fraction, and strain, which counts from here.

    xi_M = 1 and xi_A = 0 for a fully martensitic cold wire, as the source says (sec. 3.7); anywhere else both curves
    are laid through the given state.
    """
    zero = jnp.zeros_like(stress)
    detwinned = wire.kinetics.variants.detwinned_at_start(stress, fraction)
    state = WireState(
        temperature=temperature,
        stress=stress,
        strain=strain,
        martensite_fraction=fraction,
        xi_M=zero + 1.0,
        xi_A=zero,
        heating_missed=zero,
        cooling_missed=zero,
        detwinned_fraction=detwinned + zero,
        formed_by_loading=zero,
    )
    state = dataclasses.replace(state, history=history_at_start(history, state))
    h = martensite_left(wire.kinetics, terms, temperature, stress, state)
    k = austenite_left(wire.kinetics, terms, temperature, stress, state)
    amplitudes = wire.kinetics.renewal.start(h, k, fraction)
    state = dataclasses.replace(
        state,
        xi_M=amplitudes.xi_M,
        xi_A=amplitudes.xi_A,
        heating_missed=amplitudes.heating_missed + zero,
        cooling_missed=amplitudes.cooling_missed + zero,
    )
    return with_second_population(terms, state)
