"""What may be wrong with a run that has been computed: notes, as records."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence

import jax.numpy as jnp
import numpy as np
import xarray as xr

from smajax.control.closed_loop import ClosedLoopSetup
from smajax.control.figures_of_merit import SetPointMerit
from smajax.control.position_unit import unit_of
from smajax.control.reach import reach_of, reach_sentence
from smajax.control.run_notes import (
    AboveAnnealing,
    AboveMelting,
    AboveStrength,
    CycleLeavesStrain,
    EndsEarly,
    Note,
    NotFinite,
    NotResolved,
)
from smajax.control.signal_path import check_set_points
from smajax.data.experiment.magnitude import ANNEALS, MELTS, STRENGTH
from smajax.model.system import System
from smajax.model.wire.constitutive import young_modulus
from smajax.model.wire.form import RateForm
from smajax.simulation.simulate import SHORTER

WHOLE = 1e-3  # of the martensite fraction: nearer to 1 is martensite alone
SAME_TEMPERATURE = 1.0  # K
LEFT = 5e-4  # strain that a cycle leaves; less is not said


def notes_of_run(data: xr.Dataset) -> list[Note]:
    """Notes on values that are not finite, on a wire that would melt, anneal or tear, and on a run that its integration does not resolve."""
    wrong = tuple(str(name) for name in data.data_vars if not np.isfinite(data[name].to_numpy()).all())
    notes: list[Note] = [NotFinite(wrong)] if wrong else []
    hottest = float(data["temperature"].max())
    if hottest > MELTS:
        notes.append(AboveMelting(hottest))
    elif hottest > ANNEALS:
        notes.append(AboveAnnealing(hottest))
    largest = float(data["stress"].max())
    if largest > STRENGTH:
        notes.append(AboveStrength(largest))
    error = json.loads(data.attrs.get("integration_error", "{}"))
    share, limit = error.get("largest_rms_over_stroke"), error.get("aimed_for")
    # A run of which the error was not measured has none; one with values that are not finite is said to have these.
    if not wrong and share is not None and limit is not None and share > limit:
        notes.append(NotResolved(share, limit, error["how"], loop="controller" in data.attrs))
    return notes


def notes_of_cycle(system: System, data: xr.Dataset) -> list[Note]:
    """A note on a strain that whole cycles leave in rate form; none of a wire with effects or split martensite, which have strains of their own that stay."""
    wire = system.wire
    if not isinstance(wire.constitutive.form, RateForm) or system.effects or wire.kinetics.variants.detwins:
        return []
    fraction, temperature, stress, strain = (
        data[name].to_numpy()[[0, -1]] for name in ("martensite_fraction", "temperature", "stress", "strain")
    )
    taut = np.all(stress > 0.0)  # the strain of a slack wire is its load's
    if not (taut and np.all(fraction > 1.0 - WHOLE) and abs(np.diff(temperature)[0]) < SAME_TEMPERATURE):
        return []
    left = float(np.diff(strain)[0] - np.diff(stress)[0] / float(young_modulus(wire, jnp.asarray(1.0))))
    return [CycleLeavesStrain(left)] if abs(left) > LEFT else []


def notes_of_length(asked: float, clock: np.ndarray, step: float) -> list[Note]:
    """A note on a run that is shorter than asked by more than a thousandth, for it consists of whole steps (s)."""
    end = float(clock[-1])
    return [EndsEarly(asked, end, step)] if asked - end > SHORTER * asked else []


def notes_of_set_points(system: System, position: np.ndarray) -> list[Note]:
    """A note on a set point beyond the stops of the load."""
    try:
        check_set_points(system, unit_of(system).of(np.unique([position.min(), position.max()])).tolist())
    except ValueError as error:
        return [f"A set point cannot be reached: {error}"]
    return []


def notes_of_reach(
    setup: ClosedLoopSetup, position: np.ndarray, figures: Mapping[str, float], by_set_point: Sequence[SetPointMerit]
) -> list[Note]:
    """A note on set points where the loop does not settle, and which no controller could reach."""
    missed = [one.set_point for one in by_set_point if not np.isfinite(one.merit.settling_time)]
    if figures and not math.isfinite(figures["settling_time"]):
        missed = [float(position[0])]
    if not missed:
        return []
    plant = setup.system
    shown = [float(f"{one:.6g}") for one in unit_of(plant).of(missed)]
    sentence = reach_sentence(reach_of(plant, setup.controller, setup.assumed), plant, [*dict.fromkeys(shown)])
    return [sentence] if sentence else []
