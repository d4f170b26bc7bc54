"""An SMA wire that pulls a slider against a spring, as an engineer writes it in numpy and scipy: no code of the package.

Three things differ from the package's base model, each of which `Bench` can do without: the convection is that of rising air, h = h_0 [(T - T_air)/50 K]^(1/4);
the constitutive law is integrated, stress = E(xi) (strain - H xi) with a modulus of each phase; and the guide has Coulomb friction. The wire transforms by
Liang and Rogers' rule, on heating to austenite and on cooling to martensite, whatever the stress does. The slider has no inertia: it rests while
wire and spring differ by less than the friction, and else follows where they differ by just that.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.optimize import brentq

STEP = 5e-3  # s


@dataclass(frozen=True)
class Bench:
    """SI, degC."""

    length: float = 0.5
    diameter: float = 0.5e-3
    density: float = 6450.0
    specific_heat: float = 840.0
    ohms_per_metre: float = 4.3
    air: float = 22.0
    convection: float = 68.0  # W/m^2/K at 50 K over the air
    exponent: float = 0.25
    austenite: tuple[float, float] = (88.0, 98.0)  # start, finish
    martensite: tuple[float, float] = (72.0, 62.0)
    slopes: tuple[float, float] = (8.5e6, 7.6e6)  # Pa/K, of austenite and martensite
    moduli: tuple[float, float] = (75e9, 28e9)  # Pa, the same
    recoverable_strain: float = 0.034
    stiffness: float = 450.0
    preload: float = 9.0
    friction: float = 0.4  # N

    @property
    def area(self) -> float:
        return math.pi * self.diameter**2 / 4.0


@dataclass
class State:
    temperature: float
    fraction: float = 1.0  # of martensite
    most: float = 1.0  # fraction from which the wire was heated last
    least: float = 1.0  # and cooled
    position: float = 0.0
    stress: float = 0.0


def simulated(bench: Bench, current: np.ndarray, sample: float) -> np.ndarray:
    """Position of the slider, m, at the beginning of every sample of a current that is held over it, A; a pull counts up."""
    state = State(bench.air, stress=bench.preload / bench.area)
    slack = state.stress / bench.moduli[1] + bench.recoverable_strain  # strain where the slider begins
    positions = np.empty(len(current))
    for place, amperes in enumerate(current):
        positions[place] = state.position
        for _ in range(round(sample / STEP)):
            _advance(bench, state, slack, float(amperes))
    return positions


def _advance(bench: Bench, state: State, slack: float, current: float) -> None:
    temperature = _heated(bench, state.temperature, current)
    fraction = _transformed(bench, state, temperature)

    def strain_of(stress: float) -> float:
        part = fraction(stress)
        return stress / _modulus(bench, part) + bench.recoverable_strain * part

    # The wire between clamps: does the slider hold?
    held = slack - state.position / bench.length
    stress = _root(lambda one: strain_of(one) - held, state.stress)
    out_of_balance = bench.area * stress - bench.preload - bench.stiffness * state.position
    if abs(out_of_balance) > bench.friction:
        pull = math.copysign(bench.friction, out_of_balance)

        def position_of(stress: float) -> float:
            return bench.length * (slack - strain_of(stress))

        stress = _root(
            lambda one: pull + bench.preload + bench.stiffness * position_of(one) - bench.area * one, state.stress
        )
        state.position = position_of(stress)
    part = fraction(stress)
    if part < state.fraction:
        state.least = part
    elif part > state.fraction:
        state.most = part
    state.fraction, state.stress, state.temperature = part, stress, temperature


def _heated(bench: Bench, temperature: float, current: float) -> float:
    """By Runge and Kutta's fourth order."""
    mass, surface = bench.density * bench.area, math.pi * bench.diameter  # of a metre

    def rate(now: float) -> float:
        above = now - bench.air
        film = bench.convection * (abs(above) / 50.0) ** bench.exponent
        return (current**2 * bench.ohms_per_metre - film * surface * above) / (mass * bench.specific_heat)

    first = rate(temperature)
    second = rate(temperature + 0.5 * STEP * first)
    third = rate(temperature + 0.5 * STEP * second)
    fourth = rate(temperature + STEP * third)
    return temperature + STEP / 6.0 * (first + 2.0 * second + 2.0 * third + fourth)


def _transformed(bench: Bench, state: State, temperature: float) -> Callable[[float], float]:
    """Fraction of martensite at a stress, after a step to that temperature."""
    warmer, colder = temperature > state.temperature, temperature < state.temperature

    def heated(stress: float) -> float:
        start, finish = bench.austenite
        share = _share((temperature - stress / bench.slopes[0] - start) / (finish - start))
        return min(state.fraction, state.most * (1.0 - share))

    def cooled(stress: float) -> float:
        start, finish = bench.martensite
        share = _share((start - temperature + stress / bench.slopes[1]) / (start - finish))
        return max(state.fraction, state.least + (1.0 - state.least) * share)

    def fraction(stress: float) -> float:
        less = heated(stress) if warmer else state.fraction
        return less if less < state.fraction else cooled(stress) if colder else state.fraction

    return fraction


def _share(place: float) -> float:
    """Of a transformation that is so far into its range: half a cosine."""
    return 0.5 * (1.0 - math.cos(math.pi * min(max(place, 0.0), 1.0)))


def _modulus(bench: Bench, fraction: float) -> float:
    austenite, martensite = bench.moduli
    return austenite + fraction * (martensite - austenite)


def _root(misfit: Callable[[float], float], near: float) -> float:
    """Where it vanishes; misfits rise with the stress, or fall."""
    width = 1e4
    while misfit(near - width) * misfit(near + width) > 0.0:
        width *= 4.0
    return float(brentq(misfit, near - width, near + width, xtol=1.0, rtol=1e-13))
