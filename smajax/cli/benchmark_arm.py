r"""The rotary arm as one explicit ODE, for integrators that know nothing of phases; imports no array library.

Enhanced kinetics, rate form (Elahinia 2004, eq. 3.1-3.8), constant voltage, from rest in cold martensite. Of the
kinetics only the heating branch and its end are here: the problem never comes near the cooling curve (`problem.py`
checks that). Given that, the fraction is the least that the heating curve ever asked for, $\xi = h(\max_t y)$ with
$y = T - \sigma/C_A$; so the state carries $y_{max}$ and no fraction drifts off its curve.

State, in this order, each scalar or of shape (members,), all of them of order 1 to 100 so that one tolerance serves:

    temperature   T, C
    tension       [sigma - eps_L (F(1) - F(xi))]/C_A, K: what the stress would be, had nothing transformed
    angle         rad
    rate          rad/s
    furthest      y_max, C

with $F(\xi) = \int_0^\xi E d\xi$, so that the rate form, $\dot\sigma = E \dot\varepsilon + \theta_T \dot T - E \varepsilon_L \dot\xi$,
leaves the tension a rate without $\dot\xi$: a step over the end of the range, where a rate of xi has a kink, would else
cost strain for good. A stress below zero is a slack wire, by that much over E of strain. On the curve y' = y_max':

    y_max' = [T' - (E eps' + theta_T T')/C_A] / [1 - h'(y_max) E eps_L/C_A]

Off it, when the arm swings back, y_max rests.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

Constants = Mapping[str, float]  # by smajax's names, SI, temperatures in C
State = tuple[Any, Any, Any, Any, Any]

GRAVITY = 9.81  # m/s^2
# y_max is drawn to y over this time, from either side but never down: without it an integrator's errors would take the
# wire off its curve, and a switch at y = y_max in its place makes LSODA stop. A wire that swings back to its curve moves
# again up to so much too early.
CATCH_UP = 0.03  # s


class Floats:
    """The few functions that `rates` needs, for plain floats: a fifth of what numpy takes for a scalar."""

    cos, sin = math.cos, math.sin
    maximum, minimum = max, min

    @staticmethod
    def where(condition: bool, one: float, other: float) -> float:
        return one if condition else other


def area(p: Constants) -> float:
    """Cross-section of the wire, m^2."""
    return 0.25 * math.pi * p["wire_diameter"] ** 2


def resistance(xp: Any, p: Constants, payload_mass: Any, angle: Any) -> Any:
    """Torque of gravity and spring against +angle, N m; payload in kg."""
    gravity = (payload_mass + 0.5 * p["link_mass"]) * GRAVITY * p["arm_length"] * xp.cos(angle)
    return gravity + p["spring_stiffness"] * p["spring_lever"] ** 2 * (angle - p["spring_rest_angle"])


def start(xp: Any, p: Constants, payload_mass: Any) -> State:
    """At rest in the air, the wire carrying all of the arm; payload in kg."""
    zero = 0.0 * payload_mass
    angle = p["start_angle"] + zero
    stress = resistance(xp, p, payload_mass, angle) / (2.0 * p["pulley_radius"] * area(p))
    shift = stress / p["stress_slope_austenite"]
    temperature = p["ambient_temperature"] + zero
    return temperature, shift, angle, zero, temperature - shift


def _half_turn(xp: Any, p: Constants, furthest: Any) -> Any:
    """The cosine's argument: 0 to pi over the range."""
    width = p["austenite_finish"] - p["austenite_start"]
    return xp.minimum(xp.maximum((furthest - p["austenite_start"]) * (math.pi / width), 0.0), math.pi)


def fraction(xp: Any, p: Constants, state: State) -> Any:
    """Martensite fraction, -."""
    return 0.5 * (1.0 + xp.cos(_half_turn(xp, p, state[4])))


def rates(xp: Any, p: Constants, voltage: Any, payload_mass: Any, state: State) -> State:
    """Time derivative of the state; V, kg. `xp` is numpy, jax.numpy or `Floats`. End stops are out of reach."""
    temperature, tension, angle, rate, furthest = state
    per_kelvin = 1.0 / p["stress_slope_austenite"]
    martensite, austenite = p["young_modulus_martensite"] * per_kelvin, p["young_modulus_austenite"] * per_kelvin
    half_turn = _half_turn(xp, p, furthest)
    xi = 0.5 * (1.0 + xp.cos(half_turn))
    steepness = -0.5 * math.pi / (p["austenite_finish"] - p["austenite_start"]) * xp.sin(half_turn)
    stiffness = austenite + xi * (martensite - austenite)
    # F(1) - F(xi) is the mean stiffness times what has transformed.
    gone = (1.0 - xi) * (austenite + 0.5 * (1.0 + xi) * (martensite - austenite))
    shift = tension + p["recoverable_strain"] * gone
    taut = shift > 0.0
    carried = xp.where(taut, shift, 0.0)

    cross = area(p)
    resistivity = p["resistivity_austenite"] + xi * (p["resistivity_martensite"] - p["resistivity_austenite"])
    power = (xp.minimum(p["amplifier_gain"] * voltage, p["amplifier_limit"]) / p["wire_length"]) ** 2
    loss = p["convection_coefficient"] * math.pi * p["wire_diameter"] * (temperature - p["ambient_temperature"])
    warming = (power * cross / resistivity - loss) / (p["density"] * cross * p["specific_heat"])
    stretching = -2.0 * p["pulley_radius"] / p["wire_length"] * rate
    tightening = stiffness * stretching + p["thermal_modulus"] * per_kelvin * warming

    driving = temperature - carried
    wanted = warming - xp.where(taut, tightening, 0.0) + (driving - furthest) / CATCH_UP
    pulling = xp.where(taut, -stiffness * p["recoverable_strain"] * steepness, 0.0)
    further = xp.maximum(wanted, 0.0) / (1.0 + pulling)

    torque = 2.0 * p["pulley_radius"] * cross * p["stress_slope_austenite"] * carried
    torque = torque - resistance(xp, p, payload_mass, angle) - p["damping"] * rate
    inertia = p["inertia_ratio"] * (payload_mass + p["link_mass"] / 3.0) * p["arm_length"] ** 2
    return warming, tightening, rate, torque / inertia, further
