"""The dead weight's wire in pieces which the air cools unevenly: one stress and one current, each at its own temperature.

Section 3.5.1 names a "nonuniform temperature distribution" and prints none. Here the heat that a piece keeps, the inverse of
its h_c, is spread as what many small causes make of it, a normal distribution of mean 1 and standard deviation `unevenness`;
it ends at `CUT` standard deviations, so that a wire in more pieces has no hotter one. The amplifier gives
I = I_0/(1 + I_0/I_max), I_0 = g V/(R_M l_0), and h rises with temperature as of a thin wire in free convection
(`RisingConvection`). The wire is as long as the mean of its pieces. Neglected: conduction from piece to piece, and
the mass's inertia while pieces lengthen unlike each other.

A piece transforms within a few per cent of the heat that it keeps. The pieces are therefore one ratio apart in it, a fraction of
that range, each with the share of the wire that lies around it.
"""

from __future__ import annotations

import dataclasses
from typing import Any, NamedTuple

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float
from scipy.stats import norm

from smajax.core.parameters import set_vector
from smajax.engine import program
from smajax.model.drive.current import Current
from smajax.model.effects.rising_convection import RisingConvection
from smajax.model.rigs import dead_weight
from smajax.model.system import System
from smajax.model.types import Scalar, Series
from smajax.model.wire.constitutive import young_modulus
from smajax.model.wire.resistance import resistance_per_metre
from smajax.simulation.simulate import simulate

from .unprinted import DEAD_WEIGHT

COOLING = "convection_coefficient"  # in which the pieces differ
PIECES = 768
CUT = 2.5  # standard deviations: 98.8 % of the normal distribution
Lanes = Float[np.ndarray, "lanes time"]


class Hung(NamedTuple):
    """What the pieces do together, arrays of shape (lanes, time) but for the temperature."""

    rise: np.ndarray  # of the mass, m
    fraction: np.ndarray  # martensite, -
    hottest: np.ndarray  # greatest temperature of the hottest piece, C, shape (lanes,)
    compliance: np.ndarray  # mean of 1/E over the pieces, 1/Pa


class Pieces(NamedTuple):
    """The wire, arrays of shape (pieces,)."""

    kept: np.ndarray  # of the heat that the mean piece keeps, -
    shares: np.ndarray  # of the wire's length, -


def piece(law: str = "enhanced") -> System:
    """A wire all of which is cooled by the mean h_c, under a current."""
    system = dataclasses.replace(dead_weight(law), drive=Current())
    return dataclasses.replace(system, effects=(RisingConvection(slope=DEAD_WEIGHT["convection_slope"]),))


def kept_heat(unevenness: float = DEAD_WEIGHT["unevenness"], pieces: int = PIECES, cut: float = CUT) -> Pieces:
    """What each piece keeps of the heat of the mean one, and how much of the wire does so."""
    kept = np.geomspace(1.0 - cut * unevenness, 1.0 + cut * unevenness, pieces)
    shares = norm.pdf((kept - 1.0) / unevenness) * kept
    shares[[0, -1]] *= 0.5  # the trapezoidal rule in the logarithm of the kept heat
    return Pieces(kept, shares / shares.sum())


def limited(asked: Any, largest: float) -> Any:
    """I of I_0, A, by an amplifier with a largest current."""
    return asked / (1.0 + asked / largest)


def current(volts: np.ndarray) -> np.ndarray:
    """A, of the command in V."""
    wire = piece().wire
    cold = float(resistance_per_metre(wire, (), jnp.asarray(20.0), jnp.ones(())) * wire.wire_length)
    asked = DEAD_WEIGHT["amplifier_gain"] * np.asarray(volts) / cold
    return np.asarray(limited(asked, DEAD_WEIGHT["largest_current"]))


class _Lane(eqx.Module):
    system: System
    current: Series
    mass: Series
    dt: Scalar


def _piece(lane: _Lane, own: dict[str, Scalar]) -> tuple[Series, Series, Scalar, Series]:
    system = set_vector(lane.system, [COOLING], own[COOLING][None])
    run = simulate(system, {"current": lane.current, "mass": lane.mass}, lane.dt)
    compliance = 1.0 / young_modulus(system.wire, run.martensite_fraction)
    return run.position, run.martensite_fraction, run.temperature.max(), compliance


def hung(volts: Lanes, mass: Lanes, dt: float, law: str = "enhanced", pieces: int = PIECES) -> Hung:
    """The mass (kg) on the wire under a command (V), one lane after the other; `dt` in s."""
    system = piece(law)
    kept, shares = kept_heat(pieces=pieces)
    own = {COOLING: float(system.wire.heat.convection_coefficient) / kept}
    lanes = []
    for amperes, masses in zip(current(np.asarray(volts)), np.asarray(mass), strict=True):
        lane = _Lane(system, jnp.asarray(amperes), jnp.asarray(masses), jnp.asarray(dt))
        position, fraction, hottest, compliance = program(_piece, lane, (COOLING,))(lane, own)
        lanes.append((shares @ position, shares @ fraction, hottest.max(), shares @ compliance))
    return Hung(*(np.stack(ones) for ones in zip(*lanes, strict=True)))
