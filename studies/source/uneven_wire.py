"""The dead weight's wire in pieces which the air cools unevenly: one stress and one current, each at its own temperature.

Section 3.5.1 names a "nonuniform temperature distribution" and prints none. Here the heat that a piece keeps, the inverse of
its h_c, is spread as a logarithmic normal distribution of standard deviation `unevenness`; the amplifier gives
I = I_0/(1 + I_0/I_max), I_0 = g V/(R_M l_0), and h rises with temperature as of a thin wire in free convection
(`RisingConvection`). The wire is as long as the mean of its pieces. Neglected: conduction from piece to piece, and
the mass's inertia while pieces lengthen unlike each other.
"""

from __future__ import annotations

import dataclasses
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float
from scipy.stats import norm

from smajax.core.parameters import set_vector
from smajax.model.drive.current import Current
from smajax.model.effects.rising_convection import RisingConvection
from smajax.model.rigs import dead_weight
from smajax.model.system import System
from smajax.model.types import Scalar, Series
from smajax.model.wire.constitutive import young_modulus
from smajax.model.wire.resistance import resistance_per_metre
from smajax.simulation.simulate import simulate

from .unprinted import DEAD_WEIGHT

PIECES = 96
Lanes = Float[np.ndarray, "lanes time"]


class Hung(NamedTuple):
    """What the pieces do together, arrays of shape (lanes, time)."""

    rise: np.ndarray  # of the mass, m
    fraction: np.ndarray  # martensite, -
    hottest: np.ndarray  # temperature of the hottest piece, C
    compliance: np.ndarray  # mean of 1/E over the pieces, 1/Pa


def piece(law: str = "enhanced") -> System:
    """A wire all of which is cooled by the mean h_c, under a current."""
    system = dataclasses.replace(dead_weight(law), drive=Current())
    return dataclasses.replace(system, effects=(RisingConvection(slope=DEAD_WEIGHT["convection_slope"]),))


def kept_heat(unevenness: float = DEAD_WEIGHT["unevenness"]) -> np.ndarray:
    """What each piece keeps of the heat of the mean one, shape (pieces,)."""
    return np.asarray(np.exp(unevenness * norm.ppf((np.arange(PIECES) + 0.5) / PIECES)))


def limited(asked: Any, largest: float) -> Any:
    """I of I_0, A, by an amplifier with a largest current."""
    return asked / (1.0 + asked / largest)


def current(volts: np.ndarray) -> np.ndarray:
    """A, of the command in V."""
    wire = piece().wire
    cold = float(resistance_per_metre(wire, (), jnp.asarray(20.0), jnp.ones(())) * wire.wire_length)
    asked = DEAD_WEIGHT["amplifier_gain"] * np.asarray(volts) / cold
    return np.asarray(limited(asked, DEAD_WEIGHT["largest_current"]))


@eqx.filter_jit
def _hung(
    system: System, convections: Float[Array, " pieces"], current: Series, mass: Series, dt: float
) -> tuple[Series, ...]:
    def of(convection: Scalar) -> tuple[Series, ...]:
        whole = set_vector(system, ["convection_coefficient"], convection[None])
        run = simulate(whole, {"current": current, "mass": mass}, dt)
        compliance = 1.0 / young_modulus(system.wire, run.martensite_fraction)
        return run.position, run.martensite_fraction, run.temperature, compliance

    position, fraction, temperature, compliance = jax.vmap(of)(convections)
    return position.mean(axis=0), fraction.mean(axis=0), temperature.max(axis=0), compliance.mean(axis=0)


def hung(volts: Lanes, mass: Lanes, dt: float, law: str = "enhanced") -> Hung:
    """The mass (kg) on the wire under a command (V), one lane after the other; `dt` in s."""
    system = piece(law)
    convections = jnp.asarray(float(system.wire.heat.convection_coefficient) / kept_heat())
    # Lane by lane: one program for any number of them.
    lanes = [
        _hung(system, convections, jnp.asarray(amperes), jnp.asarray(masses), dt)
        for amperes, masses in zip(current(np.asarray(volts)), np.asarray(mass), strict=True)
    ]
    return Hung(*(np.stack([np.asarray(one) for one in ones]) for ones in zip(*lanes, strict=True)))
