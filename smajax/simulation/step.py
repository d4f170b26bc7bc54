r"""One implicit step of a system: temperature, position, stress and martensite fraction solved together.

The source closes heat, kinetics, constitutive law and motion into one algebraic loop (Fig. 3.2). Here each stage of an
L-stable two-stage SDIRK scheme (order 2, $\gamma = 1 - 1/\sqrt 2$) solves

    heat          H(T, xi) = H_b + g [power - losses]
    motion        inertia a(x) + resistance(x, v(x)) + friction(x) = lever A_w sigma,  v = (x - x_b)/g, a = (v - v_b)/g;
                 x is at the end stop where this would carry it beyond (inelastic)
    constitutive  sigma = stress_at(strain(x), T, xi)                (eq. 3.2, increments exact: nothing drifts)
    kinetics      xi = closed form of eq. 3.3 or 3.5 at (T, sigma), or unchanged

with g = gamma dt (`stage_solver` says how).

Gradients: the iteration itself is not differentiated. `lax.custom_root` gives the solution the derivatives of the
implicit function theorem: of any order in forward mode, of the first two where reverse mode is among them.
"""

from __future__ import annotations

import dataclasses
import itertools
import math
from collections.abc import Callable
from typing import NamedTuple, TypeVar

import equinox as eqx
import jax
import jax.numpy as jnp
from jax import lax

from smajax.core.checkpointed_scan import recomputed, solved
from smajax.core.traced_once import traced_once
from smajax.model.effects.history_errors import history_entries_named
from smajax.model.load.base import AbstractMovingLoad
from smajax.model.load.coupon import Coupon, StrainCoupon
from smajax.model.load.friction import in_use, rubbing
from smajax.model.sensor_reading import followed, reading_of, time_constant
from smajax.model.system import System, load_resistance, with_supply_history
from smajax.model.types import Inputs, Motion, Scalar, State, WireState
from smajax.model.wire.constitutive import reached, stress_at
from smajax.model.wire.heat import cross_section, stored_heat
from smajax.model.wire.history import over, with_step_to
from smajax.model.wire.kinetics import Branch
from smajax.model.wire.root import root
from smajax.model.wire.two_populations import choose_branch, curve_on, open_branches, settled, with_amplitudes
from smajax.simulation.stage_equations import Stage, Unknowns, beyond_stops, equations, motion_rates
from smajax.simulation.stage_solver import Solution, solve, solved_linear

Tree = TypeVar("Tree")


class Scheme(NamedTuple):
    """A diagonally implicit Runge-Kutta scheme whose last stage is its result, in the order in which stages need it.

    Shares of dt. Stage i + 1 starts from `later` moved by `moved[i]` of the slopes of stage i; `later` is then moved by
    `later_moved[i]` of them.
    """

    gamma: float
    ends: tuple[float, ...]  # of the stages
    moved: tuple[float, ...]
    later_moved: tuple[float, ...]
    compared: tuple[float, ...]  # weights less those of a scheme of one order less
    enough: float  # of `Stage`


# Shortest part of a step that is made in two. Rounding in a derivative by the length of a step grows as its
# inverse square: at 1e-6 it is 2e-4 of the derivative.
SHORTEST_PART = 3e-6
SHORTEST_LAG = 1e-3  # of a step: below, exp(-dt/lag) is zero in double precision
_TWO, _THREE = 1.0 - 0.5**0.5, 0.435866521508459
# Alexander 1977: order 2 and 3, L-stable; the stages go forward in time, as a wire with a memory has to.
ORDER_TWO = Scheme(_TWO, (_TWO, 1.0), (1.0 - _TWO, 0.0), (0.0, 0.0), (0.0, 0.0), enough=1e-4)
ORDER_THREE = Scheme(
    gamma=_THREE,
    ends=(_THREE, 0.5 * (1.0 + _THREE), 1.0),
    moved=(0.5 * (1.0 - _THREE), 1.5 * _THREE**2 - 5.0 * _THREE + 1.25, 0.0),
    later_moved=(-1.5 * _THREE**2 + 4.0 * _THREE - 0.25, 0.0, 0.0),
    compared=(_THREE, -2.0 * _THREE, _THREE),
    enough=1e-3,  # its square is far below what a step is tolerated to be off by
)


class _Bases(NamedTuple):
    """What a scheme carries from stage to stage: three numbers each, of H, position and velocity."""

    stage: Stage
    later: list[Scalar]
    error: list[Scalar]


def _held(tree: Tree) -> Tree:
    return jax.tree.map(lax.stop_gradient, tree)


@eqx.filter_custom_jvp
def _solved(given: tuple[System, Stage, Inputs]) -> Solution:
    """The end of a stage."""
    return solve(*given)


@_solved.def_jvp
def _solved_jvp(primals, tangents):  # type: ignore[no-untyped-def]  # the signature is equinox's
    return eqx.filter_jvp(_differentiable, primals, tangents)


@traced_once
def _differentiable(given: tuple[System, Stage, Inputs]) -> Solution:
    """The same, and one linear correction: its derivatives, the second too, are then those of the equations' root.

    Only where a derivative is taken: what the solver leaves is of the size of its tolerance squared, and moves a derivative
    by some 2e-6 of its largest with one step a sample, no more than another order of the same sums does. Where JAX computes what is known beforehand it follows no rule but goes through the correction: without one,
    forward over reverse mode takes the root for a constant. Derivatives of the first order alone do without.
    """
    system, stage, inputs = given
    wire, terms, old = system.wire, system.terms.kinetics, stage.old.wire
    result = solved(solve(_held(system), _held(stage), _held(dict(inputs))))

    def all_four(z: Unknowns) -> Unknowns:
        residuals = equations(system, stage, inputs, z)
        on_curve = curve_on(wire.kinetics, terms, old, result.branch, z.temperature, z.stress)
        return Unknowns(residuals.heat, residuals.motion, residuals.stress, z.fraction - on_curve)

    def linear(g: Callable[[Unknowns], Unknowns], right: Unknowns) -> Unknowns:
        one, zero = jnp.ones_like(right.fraction), jnp.zeros_like(right.fraction)
        columns = [g(Unknowns(*(one if k == at else zero for k in range(4)))) for at in range(4)]
        return Unknowns(*solved_linear(list(zip(*columns, strict=True)), list(right))[0])

    def corrected(f: Callable[[Unknowns], Unknowns], rough: Unknowns) -> Unknowns:
        residuals, along = jax.linearize(f, rough)
        change = linear(along, residuals)
        return Unknowns(*(value - step for value, step in zip(rough, change, strict=True)))

    def as_found(f: Callable[[Unknowns], Unknowns], rough: Unknowns) -> Unknowns:
        return rough

    z = lax.custom_root(all_four, result.z, as_found if stage.once else corrected, linear)
    return Solution(z, result.branch, result.free, result.unsolved)


def _ended(system: System, stage: Stage, inputs: Inputs) -> tuple[WireState, Scalar, Scalar, Scalar]:
    """Solve one stage: (the wire at its end, the displacement, that without end stops, 1 where it did not converge)."""
    wire, terms, old = system.wire, system.terms, stage.old.wire
    z, branch, free, unsolved = _solved((system, stage, dict(inputs)))
    at = z.temperature, jnp.maximum(z.stress, 0.0)
    xi, parts = settled(wire.kinetics, terms.kinetics, old, branch, z.temperature, z.stress, z.fraction)
    new = reached(wire, terms.constitutive, old, *at, xi)
    return with_amplitudes(wire.kinetics, terms.kinetics, old, branch, new, parts), z.displacement, free, unsolved


def _stage(system: System, stage: Stage, inputs: Inputs) -> tuple[State, Scalar, Scalar, Scalar]:
    """One stage of a moving load: (state at its end, dH/dt, v, a)."""
    load = system.load
    assert isinstance(load, AbstractMovingLoad)
    terms, old = system.terms, over(stage.old.wire, stage.elapsed)
    stage = dataclasses.replace(stage, old=dataclasses.replace(stage.old, wire=old))
    wire, displacement, free, unsolved = _ended(system, stage, inputs)
    wire = with_supply_history(system, inputs, old, wire)
    lower, upper = load.limits()
    below, above = beyond_stops(system, stage, free)
    velocity, acceleration = motion_rates(stage, displacement)
    position = jnp.where(below, lower, jnp.where(above, upper, stage.position + displacement))
    velocity = jnp.where(below | above, 0.0, velocity)  # inelastic
    acceleration = jnp.where(below | above, 0.0, acceleration)
    # What the heat equation says where it is solved, at the cost of a difference.
    heating = (
        stored_heat(system.wire, terms.heat, wire.temperature, wire.martensite_fraction) - stage.heat
    ) / stage.step
    before = stage.old.motion
    rubs = rubbing(load, terms.friction, before, stage.velocity, inputs)
    friction = {one.name: in_use(one, before, position) for one in rubs}
    motion = Motion(position, velocity, friction)
    new = dataclasses.replace(
        stage.old, time=stage.time, wire=wire, motion=motion, unsolved=stage.old.unsolved + lax.stop_gradient(unsolved)
    )
    return new, heating, velocity, acceleration


@traced_once
def _moving_step(
    system: System, state: State, inputs: Inputs, dt: Scalar, scheme: Scheme, once: bool = False
) -> tuple[State, tuple[Scalar, Scalar, Scalar]]:
    """(state at the end, estimated error of H, position and velocity): every stage a backward-Euler solve over gamma dt.

    A stage starts from a base that those before it have moved on.
    """
    start = (
        stored_heat(system.wire, system.terms.heat, state.wire.temperature, state.wire.martensite_fraction),
        state.motion.position,
        state.motion.velocity,
    )

    def body(carry: _Bases, now: tuple[Scalar, ...]) -> tuple[_Bases, None]:
        ends, elapsed, moved, later_moved, compared = now
        new, *slopes = _stage(system, carry.stage, inputs)
        bases = [base + moved * slope for base, slope in zip(carry.later, slopes, strict=True)]
        later = [base + later_moved * slope for base, slope in zip(carry.later, slopes, strict=True)]
        error = [total + compared * slope for total, slope in zip(carry.error, slopes, strict=True)]
        return _Bases(Stage(new, ends, elapsed, carry.stage.step, *bases, scheme.enough, once), later, error), None

    gamma = scheme.gamma * dt
    to_first = scheme.ends[0] * dt
    first = Stage(state, state.time + to_first, to_first, gamma, *start, scheme.enough, once)
    # The times scanned over are those of the *next* stage: its end, and from that of the one before.
    ends = (*scheme.ends, 1.0)
    times = jnp.stack([state.time + share * dt for share in ends[1:]])
    elapsed = jnp.stack([(share - before) * dt for before, share in itertools.pairwise(ends)])
    shares = [jnp.stack([share * dt for share in row]) for row in (scheme.moved, scheme.later_moved, scheme.compared)]
    none = [0.0 * one for one in start]  # with a derivative, as in `simulate`
    end, _ = lax.scan(recomputed(body), _Bases(first, list(start), none), (times, elapsed, *shares))
    heat, position, velocity = end.error
    new = dataclasses.replace(end.stage.old, time=end.stage.time)
    return _after_impact(system, state, new, inputs), (heat, position, velocity)


def _after_impact(system: System, old: State, new: State, inputs: Inputs) -> State:
    """`new` with the derivative of a load that met an end stop within the step and begins to leave it again; its values stay.

    An impact that comes later by dt leaves the load behind by a dt where its forces pull it away at once with an acceleration a, as at the end of a snap.
    It comes when the load has gone the way to the stop at the speed that it had. A load that is pressed to the stop stays, and one that friction may hold.
    """
    load, terms = system.load, system.terms
    assert isinstance(load, AbstractMovingLoad)
    limits = load.limits()
    if terms.friction or all(isinstance(end, float) and math.isinf(end) for end in limits):
        return new
    lower, upper = limits
    before, motion = old.motion, new.motion
    above = (motion.position >= upper) & (before.position < upper) & (before.velocity > 0.0)
    below = (motion.position <= lower) & (before.position > lower) & (before.velocity < 0.0)
    met = above | below
    speed = jnp.where(met, before.velocity, 1.0)
    at = (jnp.where(above, upper, lower) - before.position) / speed
    pull = load.lever() * cross_section(system.wire) * new.wire.stress
    still = jnp.zeros_like(motion.velocity)
    away = (pull - load_resistance(system, new.time, motion.position, still, inputs)) / load.inertia(inputs)
    leaves = (above & (away < 0.0)) | (below & (away > 0.0))
    later = jnp.where(met & leaves, at - lax.stop_gradient(at), 0.0)
    velocity = motion.velocity - lax.stop_gradient(jnp.where(leaves, away, 0.0)) * later
    return dataclasses.replace(new, motion=dataclasses.replace(motion, velocity=velocity))


def _root_on(branch: Branch, before: Scalar, miss: Callable[[Scalar], Scalar]) -> Scalar:
    """The fraction at which `miss`, which rises, is zero: between that before the step and the end of the branch."""
    return root(miss, before, jnp.where(branch.heating, 0.0, before), jnp.where(branch.cooling, 1.0, before))


@traced_once
def _coupon_step(system: System, state: State, inputs: Inputs, dt: Scalar) -> State:
    """Temperature and stress at the end of the step are prescribed: the fraction follows in closed form, or of a range that it moves as a root."""
    wire, terms, old = system.wire, system.terms, over(state.wire, dt)
    temperature, stress = inputs["temperature"], jnp.maximum(inputs["stress"], 0.0)
    law, changed, at, before = wire.kinetics, terms.kinetics, (temperature, stress), old.martensite_fraction
    branch = choose_branch(law, changed, old, open_branches(law, changed, old), *at)
    if changed.move_within_step:
        xi = _root_on(branch, before, lambda to: to - curve_on(law, changed, with_step_to(to, old), branch, *at))
    else:
        xi = curve_on(law, changed, old, branch, *at)
    ranges = with_step_to(xi, old)
    xi, parts = settled(law, changed, ranges, branch, *at, xi)
    new = with_amplitudes(law, changed, ranges, branch, reached(wire, terms.constitutive, old, *at, xi), parts)
    return dataclasses.replace(state, time=state.time + dt, wire=new)


@traced_once
def _strain_coupon_step(system: System, state: State, inputs: Inputs, dt: Scalar) -> State:
    """Temperature and strain at the end of the step are prescribed: the fraction is the root of one equation.

    For any fraction the strain gives the stress, and with it the curve; fraction less curve rises with the fraction,
    so the root lies between the present fraction and the end of the branch: Newton's method held in that bracket.
    """
    wire, terms, old = system.wire, system.terms, over(state.wire, dt)
    temperature, strain = inputs["temperature"], inputs["strain"]
    law, changed, before = wire.kinetics, terms.kinetics, old.martensite_fraction

    def stress_of(xi: Scalar) -> Scalar:
        return stress_at(wire, terms.constitutive, old, strain, temperature, old.stress, xi)

    frozen = stress_of(before)
    branch = choose_branch(law, changed, old, open_branches(law, changed, old), temperature, frozen)

    def miss(xi: Scalar) -> Scalar:
        return xi - curve_on(law, changed, with_step_to(xi, old), branch, temperature, stress_of(xi))

    xi = _root_on(branch, before, miss)
    ranges = with_step_to(xi, old)
    xi, parts = settled(law, changed, ranges, branch, temperature, stress_of(xi), xi)
    new = reached(wire, terms.constitutive, old, temperature, stress_of(xi), xi)
    new = with_amplitudes(law, changed, ranges, branch, new, parts)
    still = jnp.zeros_like(strain)
    return dataclasses.replace(state, time=state.time + dt, wire=new, motion=Motion(-strain, still))


def _in_two_parts(
    one: Callable[[System, State, Inputs, Scalar], State], system: System, state: State, inputs: Inputs, dt: Scalar
) -> State:
    """A coupon's step by `one`: where an effect's history turns within, to there and from there, with inputs on straight lines."""
    old = over(state.wire, dt)
    stress = jnp.maximum(inputs["stress"], 0.0) if "stress" in inputs else old.stress
    turns = [
        term.turn_within(system.wire.kinetics, inputs["temperature"], stress, old) for term in system.terms.history
    ]
    shares = [share for share in turns if share is not None]
    if not shares:
        return one(system, state, inputs, dt)
    share = jnp.clip(shares[0], SHORTEST_PART, 1.0 - SHORTEST_PART)
    before = {**inputs, "temperature": old.temperature, "stress": old.stress, "strain": -state.motion.position}
    there = {name: before[name] + share * (end - before[name]) for name, end in inputs.items()}
    ends = {name: jnp.stack([there[name], jnp.asarray(end, dtype=float)]) for name, end in inputs.items()}

    def part(at: State, now: tuple[Scalar, Inputs]) -> tuple[State, None]:
        length, acting = now
        return one(system, at, acting, length), None

    new, _ = lax.scan(recomputed(part), state, (dt * jnp.stack([share, 1.0 - share]), ends))
    return dataclasses.replace(new, time=state.time + dt)


@history_entries_named()
def step(system: System, state: State, inputs: Inputs, dt: Scalar | float, once: bool = False) -> State:
    """Advance one system by `dt` seconds with `inputs` (SI, scalars) held.

    Pure and differentiable in every floating argument; `vmap` it over any of them. For a coupon `inputs` are the
    values at the end of the step. `once`: it will be differentiated once at most, which is quicker; derivatives of the second order
    are wrong then. The result satisfies the constitutive law against `state` to rounding.
    """
    dt = jnp.asarray(dt, dtype=float)
    if isinstance(system.load, Coupon):
        new = _in_two_parts(_coupon_step, system, state, inputs, dt)
        return _read(system, state, new, (state.wire.strain, new.wire.strain), dt)
    if isinstance(system.load, StrainCoupon):
        new = _in_two_parts(_strain_coupon_step, system, state, inputs, dt)
        return _read(system, state, new, (state.wire.stress, new.wire.stress), dt)
    new, _ = _moving_step(system, state, inputs, dt, ORDER_TWO, once)
    return _read(system, state, new, _sensed(system, state, new), dt)


@history_entries_named()
def step_and_error(
    system: System, state: State, inputs: Inputs, dt: Scalar, once: bool = False
) -> tuple[State, tuple[Scalar, Scalar, Scalar]]:
    """The same of a moving load by the scheme of order 3, and what it may be off by: (C, m or rad, m/s or rad/s)."""
    new, (heat, position, velocity) = _moving_step(system, state, inputs, dt, ORDER_THREE, once)
    capacity = stored_heat(system.wire, (), jnp.ones_like(heat), new.wire.martensite_fraction)
    read = _read(system, state, new, _sensed(system, state, new), dt)
    return read, (heat / capacity, position, velocity)


def _sensed(system: System, old: State, new: State) -> tuple[Scalar, Scalar]:
    """What the own sensor of a moving load measures before and after a step."""
    load = system.load
    assert isinstance(load, AbstractMovingLoad)
    return load.sensed(old.motion.position), load.sensed(new.motion.position)


def _read(system: System, old: State, new: State, shown: tuple[Scalar, Scalar], dt: Scalar) -> State:
    """`new` with what the sensor reads of what is `shown` before and after the step.

    Exact where that moves evenly over the step, which may be many times as long as the sensor's lag. It has a slope at no lag,
    which a score test needs.
    """
    before, after = shown
    lag, late = time_constant(system.terms.sensor), after
    if lag is not None:
        behind = lag * (after - before) / dt
        # Without a lag nothing of the start is left; by the quotient the derivative would be NaN there.
        lags = lag > SHORTEST_LAG * dt
        left = jnp.where(lags, jnp.exp(-dt / jnp.where(lags, lag, dt)), 0.0)
        late = after - behind + (followed(old) - before + behind) * left
    reading, sensor = reading_of(system.terms.sensor, late, new.time, old.sensor)
    return dataclasses.replace(new, reading=reading, sensor=sensor)
