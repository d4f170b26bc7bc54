r"""The hysteresis loop of a plant at rest, and its inverse: position -> temperature that holds it -> command that holds that.

Along the stroke the load at rest gives the stress, and the position the strain (`control.load_equation`),

    sigma(x) = resistance(x, 0) / (lever A_w),      strain(x) = strain_0 - (x - x_0) lever / l_0,

and the temperature is the root of strain(T, sigma(x)) = strain(x) for the model's own wire, which is led from the start to the end of
the stroke and back. So the loop has the kinetics law, the form of the constitutive law and the effects of a found model in it, and it has the angles
of an arm at which no constant voltage stops. Minor loops follow from the two branches as in eq. 3.3 and 3.5: the share of what can still transform
has the temperature that the same share has on the whole branch, moved by the stress.
"""

from __future__ import annotations

import dataclasses

import equinox as eqx
import jax
import jax.numpy as jnp
from jax import lax

from smajax.control.load_equation import equation_of, force_per_stress, moving_load, stroke_of
from smajax.control.scales import scales_of
from smajax.core.limited import limited
from smajax.model.drive.none import NoDrive
from smajax.model.load.coupon import Coupon
from smajax.model.system import System, heating_power, initial_state
from smajax.model.types import Scalar, Series, State
from smajax.model.wire.heat import HeatState, convection, heat_rate, mass_per_metre
from smajax.model.wire.history import history_at_start
from smajax.model.wire.resistance import resistance_per_metre
from smajax.simulation.step import step

KNOTS = 49  # along the stroke
WARM = 33  # temperatures of the holding command
FIRST, LAST = 0.01, 0.99  # shares of the stroke: beyond, the temperature changes much and the position little
ABOVE = 40.0  # K above the end of the transformation, for laws and effects with a tail
HALVINGS = 36
LONGEST = 1.0  # s, of a step along the loop
NONE_LEFT = 1e-6  # a share of the wire that is none

FARTHEST = 2.0  # the largest command looked at, in those that hold the end of the transformation


class Hysteresis(eqx.Module):
    """Tables of a plant at rest. Those over the position and over the temperature have their own knots."""

    position: Series  # rad, m
    stress: Series  # Pa
    heating_fraction: Series  # -, on the way there
    heating_temperature: Series  # C
    cooling_fraction: Series  # -, on the way back
    cooling_temperature: Series  # C
    temperature: Series  # C
    austenite_command: Series  # V (A, W): holds that temperature
    martensite_command: Series  # V (A, W)
    heating_slope: Scalar  # Pa/K, C_A
    cooling_slope: Scalar  # Pa/K, C_M
    time: Scalar  # s, m c_p / (h_c A_c)


class Turns(eqx.Module):
    """Where the wanted position has turned back."""

    position: Scalar  # rad, m: the last one wanted
    heating: Scalar  # 1 on the heating branch, else 0
    start_fraction: Scalar  # xi_M: where the heating branch began
    floor_fraction: Scalar  # xi_A: where the cooling branch began


def piecewise(at: Scalar, knots: Series, values: Series) -> Scalar:
    """The broken line through (knots, values) at a point; knots rise. Without a search, so that any engine runs it."""
    width, rise = jnp.diff(knots), jnp.diff(values)
    share = limited((at - knots[:-1]) / jnp.where(width > 0.0, width, 1.0), 0.0, 1.0)
    return values[0] + jnp.sum(jnp.where(width > 0.0, share, 1.0 * (at >= knots[:-1])) * rise)


@eqx.filter_jit
def hysteresis_of(system: System) -> Hysteresis:
    """The loop of a system whose load moves. Its numbers have no derivative in the system's parameters."""
    system = jax.tree.map(lambda leaf: lax.stop_gradient(leaf) if eqx.is_array(leaf) else leaf, system)
    load, wire, equation = moving_load(system), system.wire, equation_of(system)
    way = load.start() + stroke_of(system) * jnp.linspace(FIRST, LAST, KNOTS)
    carried = jax.vmap(equation.resistance)(way, jnp.zeros_like(way)) / force_per_stress(system)
    stress = jnp.maximum(carried, 0.0)
    rest = initial_state(system, system.drive.from_command(jnp.zeros(())))
    strain = rest.wire.strain - load.contraction(wire) * (way - load.start())
    coupon = dataclasses.replace(system, load=Coupon(), drive=NoDrive())
    air = wire.heat.ambient_temperature
    hottest = wire.kinetics.austenite_finish + jnp.max(stress) / wire.kinetics.stress_slope_austenite + ABOVE

    def knot(state: State, at: tuple[Scalar, Scalar]) -> tuple[State, tuple[Scalar, Scalar]]:
        stress, strain = at

        def halved(_: int, now: tuple[Scalar, Scalar, State]) -> tuple[Scalar, Scalar, State]:
            low, high, _ = now
            middle = 0.5 * (low + high)
            new = step(coupon, state, {"temperature": middle, "stress": stress}, LONGEST)
            long = new.wire.strain > strain
            return jnp.where(long, middle, low), jnp.where(long, high, middle), new

        _, _, new = lax.fori_loop(0, HALVINGS, halved, (air, hottest, state))
        return new, (new.wire.temperature, new.wire.martensite_fraction)

    # Between the way there and the way back a strain that no wire has: the hottest one, so that all of it is transformed.
    both = (
        jnp.concatenate([stress, stress[-1:], stress[::-1]]),
        jnp.concatenate([strain, strain[:1] - 1.0, strain[::-1]]),
    )
    _, (temperature, fraction) = lax.scan(knot, rest, both)
    hot, left = temperature[:KNOTS], fraction[:KNOTS]
    cold, formed = temperature[:KNOTS:-1], fraction[:KNOTS:-1]
    warm = air + FARTHEST**2 * (hottest - air) * jnp.linspace(0.0, 1.0, WARM) ** 2
    commands = jax.vmap(lambda phase: _holding(system, warm, phase, rest))(jnp.asarray([0.0, 1.0]))
    time = mass_per_metre(wire) * wire.heat.specific_heat / convection(wire, air + 1.0, air)
    slopes = wire.kinetics.stress_slope_austenite, wire.kinetics.stress_slope_martensite
    return Hysteresis(way, stress, left, hot, formed, cold, warm, *commands, *slopes, time)


def _holding(system: System, temperatures: Series, fraction: Scalar, rest: State) -> Series:
    """The command that holds each temperature: what the wire loses is what the drive gives, by halving."""
    wire, terms, air = system.wire, system.terms, system.wire.heat.ambient_temperature
    one = jnp.ones_like(air)
    most = jnp.minimum(FARTHEST * scales_of(system).command, system.drive.largest_command())

    def command(temperature: Scalar) -> Scalar:
        # What follows the wire's temperature has come to it.
        held = dataclasses.replace(rest.wire, temperature=temperature)
        held = dataclasses.replace(held, history={**held.history, **history_at_start(terms.history, held)})
        at = HeatState(temperature, air, fraction, 0.0 * one, held, one)
        lost = -heat_rate(wire, terms.heat, at, 0.0 * one)
        ohms = resistance_per_metre(wire, terms.resistance, temperature, fraction)

        def halved(_: int, ends: tuple[Scalar, Scalar]) -> tuple[Scalar, Scalar]:
            middle = 0.5 * (ends[0] + ends[1])
            little = heating_power(system, ohms, system.drive.from_command(middle)) < lost
            return jnp.where(little, middle, ends[0]), jnp.where(little, ends[1], middle)

        low, high = lax.fori_loop(0, HALVINGS, halved, (0.0 * most, most))
        return jnp.where(lost > 0.0, 0.5 * (low + high), 0.0)

    return jax.vmap(command)(temperatures)


def no_turns(position: Scalar) -> Turns:
    """Before the first set point: a cold wire, which can only be heated."""
    one = jnp.ones_like(position)
    return Turns(position, one, one, 0.0 * one)


def turned(hysteresis: Hysteresis, turns: Turns, wanted: Scalar) -> Turns:
    """The branch of the next wanted position. Where it turns back a new branch begins at the fraction there."""
    up, down = wanted > turns.position, wanted < turns.position
    was_heating = turns.heating > 0.5
    left = piecewise(turns.position, hysteresis.position, hysteresis.heating_fraction)
    formed = piecewise(turns.position, hysteresis.position, hysteresis.cooling_fraction)
    begins_heating, begins_cooling = up & ~was_heating, down & was_heating
    return Turns(
        wanted,
        jnp.where(up, 1.0, jnp.where(down, 0.0, turns.heating)),
        jnp.where(begins_heating, formed, turns.start_fraction),
        jnp.where(begins_cooling, left, turns.floor_fraction),
    )


def branch_temperature(hysteresis: Hysteresis, turns: Turns, position: Scalar) -> Scalar:
    """Temperature that holds the plant at a position on the branch of `turns`, C."""
    loop = hysteresis
    stress = piecewise(position, loop.position, loop.stress)

    def on(fraction: Series, temperature: Series, slope: Scalar, share: Scalar) -> Scalar:
        # The fraction falls along the stroke: its knots rise the other way round.
        unstressed = temperature - loop.stress / slope
        return piecewise(share, fraction[::-1], unstressed[::-1]) + stress / slope

    begun = turns.start_fraction
    left = piecewise(position, loop.position, loop.heating_fraction) / jnp.where(begun > NONE_LEFT, begun, 1.0)
    room = 1.0 - turns.floor_fraction
    grown = (1.0 - piecewise(position, loop.position, loop.cooling_fraction)) / jnp.where(room > NONE_LEFT, room, 1.0)
    hot = on(loop.heating_fraction, loop.heating_temperature, loop.heating_slope, limited(left, 0.0, 1.0))
    cold = on(loop.cooling_fraction, loop.cooling_temperature, loop.cooling_slope, 1.0 - limited(grown, 0.0, 1.0))
    return jnp.where(turns.heating > 0.5, hot, cold)


def leading_command(hysteresis: Hysteresis, turns: Turns, position: Scalar, velocity: Scalar) -> Scalar:
    """The command that leads the plant along a position with a velocity, or holds it: V, of other drives A or W.

    The heat is what is lost and what is stored, m c_p T' + h_c A_c (T - T_inf): that which holds T + tau T'.
    """
    loop, speed = hysteresis, jnp.asarray(velocity, dtype=float)
    temperature, rate = jax.jvp(lambda at: branch_temperature(loop, turns, at), (position,), (speed,))
    warm = temperature + loop.time * rate
    fractions = jnp.where(turns.heating > 0.5, loop.heating_fraction, loop.cooling_fraction)
    fraction = limited(piecewise(position, loop.position, fractions), 0.0, 1.0)
    austenite = piecewise(warm, loop.temperature, loop.austenite_command)
    martensite = piecewise(warm, loop.temperature, loop.martensite_command)
    return austenite + fraction * (martensite - austenite)
