"""Over which states a model's runs go, and so where an unknown term is sought and how large it may be."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import jax.numpy as jnp
import numpy as np

from smajax.attribution.unknown.terms import UNKNOWN, AbstractUnknown
from smajax.fit.packed_runs import RunBatch, simulate_batch
from smajax.model.drive.inputs import acting
from smajax.model.load.base import AbstractMovingLoad
from smajax.model.load.coupon import AbstractCoupon
from smajax.model.system import System
from smajax.model.wire.heat import cross_section, mass_per_metre

SPARED = 1e-3  # share of the samples on either side that may lie outside: a speed has peaks of one sample
MARGIN = 0.02  # of the range, beyond it
SAME = 1e-3  # of its own size: a state that moves by less is a constant
# Usual sizes of the function that is sought, half as much again as a standard deviation of its prior: the curve stays monotonic, |f| + |f'|/4 < 1, at 0.4
# (but for one in thirty of the functions of that prior);
# a softening of the wire stays below its stiffness at 0.15; transformation strain stays positive at 0.15 eps_L. Larger ones are unlikely by the prior, and no bound forbids them.
BENT, SOFTER, STRETCHED = 0.4, 0.15, 0.15
SHARE = 0.5  # of what the equation has in it: heat loss, stored heat, resistance, force, reading


@dataclass(frozen=True)
class Sought:
    """The terms that these runs can show, and the samples of their states, by name."""

    terms: tuple[AbstractUnknown, ...]
    states: Mapping[str, np.ndarray]


def _states(system: System, batch: RunBatch) -> dict[str, np.ndarray]:
    """Every term's state at the samples of all runs, by the term's name."""
    run = simulate_batch(system, batch)
    seen = batch.measured
    channels = {name: np.asarray(series) for name, series in batch.inputs.items()}
    own = dict(zip(batch.override_names, np.asarray(batch.overrides).T, strict=True))
    air = own.get("ambient_temperature", np.full(batch.runs, float(system.wire.heat.ambient_temperature)))
    ambient = channels.get("ambient_temperature", air[:, None])
    time = np.asarray(run.time) + ambient * 0.0
    ambient = ambient + np.asarray([[float(sum(e.ambient_shift(t) for e in system.terms.heat)) for t in time[0]]])
    fraction = np.asarray(run.martensite_fraction)
    found = {
        "unknown_loss_of_temperature": run.temperature - ambient,
        "unknown_heat_of_fraction": fraction,
        "unknown_resistance_of_temperature": run.temperature,
        "unknown_resistance_of_fraction": fraction,
        "unknown_heating_curve": fraction,
        "unknown_cooling_curve": 1.0 - fraction,
        "unknown_both_curves": fraction,
        "unknown_strain_of_temperature": run.temperature,
        "unknown_strain_of_stress": run.stress,
        "unknown_strain_of_fraction": fraction,
        "unknown_reading_of_value": run.reading,
        "unknown_reading_of_time": time,
    }
    for name in system.drive.inputs_required:  # each drive has one
        found["unknown_command_of_command"] = np.asarray(_acting(system, name, channels[name]))
    if isinstance(system.load, AbstractMovingLoad):
        lever = float(jnp.asarray(system.load.lever()))
        found["unknown_force_of_displacement"] = lever * (np.asarray(run.position) - float(system.load.start()))
        found["unknown_force_of_speed"] = lever * np.asarray(run.velocity)
    return {name: np.asarray(series)[seen] for name, series in found.items()}


def _acting(system: System, channel: str, recorded: np.ndarray) -> jnp.ndarray:
    """What the model's effects make of the drive's recorded commands, any shape."""
    acted = jnp.vectorize(lambda value: acting(system.drive, system.terms.supply.commands, {channel: value})[channel])
    return acted(jnp.asarray(recorded))


def _largest(system: System, states: Mapping[str, np.ndarray]) -> dict[str, float]:
    """The scale of every term."""
    wire = system.wire
    reach = {name: float(np.ptp(series)) for name, series in states.items()}
    warm = float(np.max(np.abs(states["unknown_loss_of_temperature"])))
    loss = float(wire.heat.convection_coefficient * jnp.pi * wire.wire_diameter) * warm
    stored = float(mass_per_metre(wire) * wire.heat.specific_heat) * warm
    stiffest = float(jnp.maximum(wire.constitutive.young_modulus_austenite, wire.constitutive.young_modulus_martensite))
    strain = STRETCHED * float(wire.constitutive.recoverable_strain)
    force = SHARE * float(cross_section(wire)) * float(np.max(states["unknown_strain_of_stress"]))
    return {
        "unknown_loss_of_temperature": SHARE * loss,
        "unknown_heat_of_fraction": SHARE * stored,
        "unknown_resistance_of_temperature": SHARE,
        "unknown_resistance_of_fraction": SHARE,
        "unknown_command_of_command": SHARE,
        "unknown_heating_curve": BENT,
        "unknown_cooling_curve": BENT,
        "unknown_both_curves": BENT,
        "unknown_strain_of_temperature": strain,
        "unknown_strain_of_stress": SOFTER * reach["unknown_strain_of_stress"] / stiffest,
        "unknown_strain_of_fraction": strain,
        "unknown_force_of_displacement": force,
        "unknown_force_of_speed": force,
        "unknown_reading_of_value": SHARE * reach["unknown_reading_of_value"],
        "unknown_reading_of_time": SHARE * reach["unknown_reading_of_value"],
    }


def sought(system: System, batch: RunBatch) -> Sought:
    """The unknown terms over the states that `system` goes through in the runs; those whose state rests are left out."""
    useless = {"heat", "electrical", "mechanics"} if isinstance(system.load, AbstractCoupon) else set()
    states = _states(system, batch)
    scale = _largest(system, states)
    terms = []
    for name, term in UNKNOWN.items():
        if term.candidate.equation in useless or name not in states or scale[name] <= 0.0:
            continue
        low, high = (float(one) for one in np.quantile(states[name], (SPARED, 1.0 - SPARED)))
        if (
            term.candidate.equation == "kinetics"
        ):  # whatever part of a branch the wire is on, the share left is counted from 1
            low, high = 0.0, 1.0
        width = high - low
        if width <= SAME * max(abs(low), abs(high)) or width == 0.0:
            continue
        ends = np.asarray([low - MARGIN * width, (1.0 + 2.0 * MARGIN) * width, scale[name]], dtype=float)
        terms.append(term(low=ends[0], width=ends[1], scale=ends[2]))
    return Sought(tuple(terms), states)
