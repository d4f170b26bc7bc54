r"""One implicit step of a system: temperature, position, stress and martensite fraction solved together.

The source closes heat, kinetics, constitutive law and motion into one algebraic loop (Fig. 3.2). Here each stage of an
L-stable two-stage SDIRK scheme (order 2, $\gamma = 1 - 1/\sqrt 2$) solves

    heat          H(T, xi) = H_b + g [power - losses]
    motion        inertia a(x) + resistance(x, v(x)) + friction(x) = lever A_w sigma,  v = (x - x_b)/g, a = (v - v_b)/g;
                 x is at the end stop where this would carry it beyond (inelastic)
    constitutive  sigma = stress_at(strain(x), T, xi)                (eq. 3.2, increments exact: nothing drifts)
    kinetics      xi = closed form of eq. 3.3 or 3.5 at (T, sigma), or unchanged

with g = gamma dt. As in plasticity, a step is first tried with the fraction frozen; that decides the branch. On the
branch xi - xi(T, sigma) rises monotonically with xi (more martensite: warmer by latent heat and less stressed, so less
of it), so the root lies between the present fraction and the end of the branch, and Newton steps are held in that
bracket. Every pivot of the elimination in the order T, x, sigma, xi is positive for the same reason.

Gradients: the iteration itself is not differentiated. `lax.custom_root` gives the solution the derivatives of the
implicit function theorem, of any order, in forward and in reverse mode.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple, TypeVar

import equinox as eqx
import jax
import jax.numpy as jnp
from jax import lax

from smajax.load.base import AbstractMovingLoad
from smajax.load.coupon import Coupon, StrainCoupon
from smajax.system import System, ambient_temperature
from smajax.types import Inputs, Motion, Scalar, State, WireState
from smajax.wire.constitutive import strain_at, stress_at, young_modulus
from smajax.wire.heat import cross_section, heat_rate, stored_heat
from smajax.wire.kinetics import Branch, choose_branch, curves, fraction_on, open_branches, remembered, steepest_slope
from smajax.wire.resistance import resistance_per_metre
from smajax.wire.root import root

Tree = TypeVar("Tree")

GAMMA = 1.0 - 0.5**0.5
MOST_ITERATIONS = 50
UNDAMPED = 12  # iterations before every second step is halved
# Newton stops when no unknown moves by more than this share of its scale: 1 C, 1 % strain, 1e-4 E, and xi in full;
# in float32, by more than what rounding alone moves it.
TOLERANCE = 1e-8
ROUNDINGS = 1e3
# Coulomb friction builds up over this much motion (a bristle bends before it slips), in units of position.
PRESLIDING = 2e-5


class Unknowns(NamedTuple):
    """What a stage solves for, in the order of elimination."""

    temperature: Scalar
    position: Scalar
    stress: Scalar
    fraction: Scalar


class Stage(eqx.Module):
    """What a stage starts from: the state before it, and the base values of the scheme."""

    old: State
    time: Scalar
    step: Scalar  # g = gamma dt, s
    heat: Scalar  # H_b, J/m
    position: Scalar  # x_b
    velocity: Scalar  # v_b


def _friction(stage: Stage, position: Scalar) -> tuple[Scalar, Scalar]:
    """(share of the Coulomb limit in use, the same before it is held within -1..1)."""
    raw = stage.old.motion.friction + (position - stage.old.motion.position) / PRESLIDING
    return jnp.clip(raw, -1.0, 1.0), raw


def _friction_limit(system: System) -> Scalar | float:
    return sum(effect.friction_limit() for effect in system.effects)


def _heating(system: System, stage: Stage, inputs: Inputs, temperature: Scalar, fraction: Scalar) -> Scalar:
    wire, effects = system.wire, system.effects
    ohms = resistance_per_metre(wire, effects, temperature, fraction)
    power = system.drive.power(ohms, wire.wire_length, inputs)
    ambient = ambient_temperature(system, stage.time, inputs)
    return heat_rate(wire, effects, temperature, ambient, power)


def _rates(system: System, stage: Stage, inputs: Inputs, z: Unknowns) -> tuple[Scalar, Scalar, Scalar]:
    """(dH/dt, v, a) at the end of a stage."""
    velocity = (z.position - stage.position) / stage.step
    acceleration = (velocity - stage.velocity) / stage.step
    return _heating(system, stage, inputs, z.temperature, z.fraction), velocity, acceleration


def _free_position(system: System, stage: Stage, inputs: Inputs, z: Unknowns) -> Scalar:
    """The position less what the equation of motion is off by, in units of position; `z.position` where it holds."""
    load = system.load
    assert isinstance(load, AbstractMovingLoad)
    _, velocity, acceleration = _rates(system, stage, inputs, z)
    inertia = load.inertia(inputs)
    friction = _friction_limit(system) * _friction(stage, z.position)[0]
    pull = load.lever() * cross_section(system.wire) * z.stress
    resisting = load.resistance(z.position, velocity, inputs) + friction
    return z.position - (inertia * acceleration + resisting - pull) * stage.step**2 / inertia


def _residual(
    system: System, stage: Stage, inputs: Inputs, branch: Branch, z: Unknowns
) -> tuple[Unknowns, tuple[Scalar, Scalar]]:
    """The four equations of a stage, each scaled to the unknown that it is solved for; zero at the solution.

    Beside them the two curves of the kinetics at `z`, from which the branch is chosen.
    """
    wire, effects, load, old = system.wire, system.effects, system.load, stage.old.wire
    assert isinstance(load, AbstractMovingLoad)
    heating, _, _ = _rates(system, stage, inputs, z)
    capacity = stored_heat(wire, (), jnp.ones_like(z.temperature), z.fraction)
    heat = (stored_heat(wire, effects, z.temperature, z.fraction) - stage.heat - stage.step * heating) / capacity

    # Projected on the range between the end stops: at a stop the equation reads "position = stop".
    free = _free_position(system, stage, inputs, z)
    lower, upper = load.limits()
    motion = z.position - jnp.where(free < lower, lower, jnp.where(free > upper, upper, free))

    strain = -load.contraction(wire) * (z.position - load.start())
    asked = stress_at(wire, effects, old, strain, z.temperature, z.stress, z.fraction)
    heated, cooled = curves(wire.kinetics, effects, old, z.temperature, z.stress)
    kinetics = z.fraction - fraction_on(old, branch, heated, cooled)
    return Unknowns(heat, motion, z.stress - asked, kinetics), (heated, cooled)


def _eliminated(jacobian: list[list[Scalar]], residual: list[Scalar]) -> tuple[list[list[Scalar]], list[Scalar]]:
    """Forward elimination without pivoting (every pivot is positive, see the head of this file)."""
    rows, right = [list(row) for row in jacobian], list(residual)
    size = len(right)
    for pivot in range(size - 1):
        for row in range(pivot + 1, size):
            factor = rows[row][pivot] / rows[pivot][pivot]
            for column in range(pivot + 1, size):
                rows[row][column] = rows[row][column] - factor * rows[pivot][column]
            right[row] = right[row] - factor * right[pivot]
    return rows, right


def _back_substituted(rows: list[list[Scalar]], right: list[Scalar], last: Scalar) -> list[Scalar]:
    """The rest of the unknowns once the last one is known (it may have been held in its bracket)."""
    size = len(right)
    found: list[Scalar] = [last]
    for row in range(size - 2, -1, -1):
        known = sum(rows[row][row + 1 + k] * found[k] for k in range(size - 1 - row))
        found.insert(0, (right[row] - known) / rows[row][row])
    return found


class _Iterate(NamedTuple):
    z: Unknowns
    jacobian: list[list[Scalar]]  # at the iterate before `z`
    branch: Branch
    trying: Scalar  # bool: the fraction is still frozen
    low: Scalar
    high: Scalar
    at_low: Scalar  # kinetic residual there; infinite while it has not been tried
    at_high: Scalar
    finished: Scalar  # bool
    iterations: Scalar


def _linearised(
    system: System, stage: Stage, inputs: Inputs, branch: Branch, z: Unknowns
) -> tuple[list[Scalar], list[list[Scalar]], tuple[Scalar, Scalar]]:
    """(residual, Jacobian rows, kinetic curves) at `z`."""
    columns = []
    for field in Unknowns._fields:
        # One unknown at a time: what does not depend on it is then known to have no derivative and is never computed,
        # which a batched `jacfwd` cannot know.
        def along(value: Scalar, field: str = field) -> tuple[Unknowns, tuple[Scalar, Scalar]]:
            return _residual(system, stage, inputs, branch, z._replace(**{field: value}))

        here = getattr(z, field)
        value, column, curves_there = jax.jvp(along, (here,), (jnp.ones_like(here),), has_aux=True)
        columns.append(column)
    rows = [[column[row] for column in columns] for row in range(len(columns))]
    return list(value), rows, curves_there


def _solved(system: System, stage: Stage, inputs: Inputs) -> _Iterate:
    """Newton's method: first with the fraction frozen, then on the branch which that trial asks for.

    The fraction is held in its bracket, and friction passes through sticking on its way from one slip to the other.
    """
    load, law, old = system.load, system.wire.kinetics, stage.old.wire
    assert isinstance(load, AbstractMovingLoad)
    xi = old.martensite_fraction
    stress_scale = 1e-4 * young_modulus(system.wire, xi)
    position_scale = 0.01 / load.contraction(system.wire)
    slips = _friction_limit(system) > 0.0
    sticks = stage.old.motion.position - PRESLIDING * stage.old.motion.friction
    open_at_start = open_branches(law, system.effects, old)
    softest = jnp.minimum(law.stress_slope_austenite, law.stress_slope_martensite)
    steepest = steepest_slope(law)
    tolerance = max(TOLERANCE, ROUNDINGS * float(jnp.finfo(xi.dtype).eps))

    def iterate(at: _Iterate) -> _Iterate:
        residual, jacobian, (heated, cooled) = _linearised(system, stage, inputs, at.branch, at.z)
        here = at.z.fraction
        # The sign of the kinetic residual tells on which side the root lies, but only where the other three equations
        # hold at this fraction: what they are off by, as a change of the driving temperature, must not reach it.
        off = jnp.abs(residual[0]) + jnp.abs(residual[2]) / softest
        trusted = off * steepest < 0.5 * jnp.abs(residual[3])
        above, below = trusted & (residual[3] > 0.0), trusted & (residual[3] < 0.0)
        low, at_low = jnp.where(below, here, at.low), jnp.where(below, residual[3], at.at_low)
        high, at_high = jnp.where(above, here, at.high), jnp.where(above, residual[3], at.at_high)
        rows, right = _eliminated(jacobian, [-value for value in residual])
        free = here + right[3] / rows[3][3]
        # Safeguarded Newton: a step out of the bracket goes to its end once (the end of the range is a common
        # solution), and after that to the secant through both ends.
        inside = ((free > low) & (free < high)) | (jnp.abs(residual[3]) <= tolerance)
        end, at_end = jnp.where(free <= low, low, high), jnp.where(free <= low, at_low, at_high)
        share = jnp.clip(at_low / (at_low - at_high), 0.3, 0.7)
        secant = low + jnp.where(jnp.isfinite(share), share, 0.5) * (high - low)
        fraction = jnp.where(inside, free, jnp.where(jnp.isfinite(at_end), secant, end))
        # Not trusted and on its way out of the bracket: first mend the other three at this fraction.
        fraction = jnp.where(trusted | inside, fraction, here)
        fraction = jnp.where(at.trying, xi, fraction)
        step = _back_substituted(rows, right, fraction - here)
        # A stiff-soft-stiff wire (detwinning) can send Newton to and fro between its two stiff ends.
        late = (at.iterations > UNDAMPED) & (at.iterations % 2 == 0)
        step = [jnp.where(late, 0.5 * change, change) for change in step]
        fraction = here + step[3]
        position = at.z.position + step[1]
        _, before = _friction(stage, at.z.position)
        _, after = _friction(stage, position)
        jumped = slips & (jnp.abs(before) > 1.0) & (jnp.abs(after) > 1.0) & (before * after < 0.0)
        position = jnp.where(jumped, sticks, position)
        z = Unknowns(at.z.temperature + step[0], position, at.z.stress + step[2], fraction)

        change = jnp.maximum(jnp.abs(step[0]), jnp.abs(fraction - here))
        change = jnp.maximum(change, jnp.abs(position - at.z.position) / position_scale)
        # Never on the first iteration: the trial must have moved before it is asked which branch it is on.
        small = jnp.maximum(change, jnp.abs(step[2]) / stress_scale) <= tolerance
        converged = small & (at.iterations > 0)
        asked = choose_branch(law, old, open_at_start, at.z.temperature, at.z.stress, heated, cooled)
        starts = at.trying & converged & (asked.heating | asked.cooling)
        return _Iterate(
            z,
            jacobian,
            Branch(at.branch.heating | (starts & asked.heating), at.branch.cooling | (starts & asked.cooling)),
            at.trying & ~starts,
            jnp.where(at.trying, jnp.where(starts & asked.heating, 0.0, xi), low),
            jnp.where(at.trying, jnp.where(starts & asked.cooling, 1.0, xi), high),
            jnp.where(at.trying, -jnp.inf, at_low),
            jnp.where(at.trying, jnp.inf, at_high),
            converged & ~starts,
            at.iterations + 1,
        )

    def unfinished(at: _Iterate) -> Scalar:
        return ~at.finished & (at.iterations < MOST_ITERATIONS)

    no, zero = jnp.zeros_like(xi, bool), jnp.zeros_like(xi)
    guess = Unknowns(old.temperature, stage.old.motion.position, old.stress, xi)
    first = _Iterate(
        guess,
        [[zero] * 4 for _ in range(4)],
        Branch(no, no),
        ~no,
        xi,
        xi,
        zero - jnp.inf,
        zero + jnp.inf,
        no,
        jnp.zeros_like(xi, int),
    )
    return lax.while_loop(unfinished, iterate, first)


def _held(tree: Tree) -> Tree:
    return jax.tree.map(lax.stop_gradient, tree)


def _ended(system: System, stage: Stage, inputs: Inputs) -> tuple[WireState, Unknowns]:
    """Solve one stage: the wire at its end, and the unknowns there."""
    wire, effects, old = system.wire, system.effects, stage.old.wire
    solved = _solved(_held(system), _held(stage), _held(dict(inputs)))
    branch = solved.branch

    def equations(z: Unknowns) -> Unknowns:
        return _residual(system, stage, inputs, branch, z)[0]

    def corrected(f: Callable[[Unknowns], Unknowns], z: Unknowns) -> Unknowns:
        # The Jacobian of the last iteration is the one at the solution to rounding.
        rows, right = _eliminated(solved.jacobian, [-value for value in f(z)])
        step = _back_substituted(rows, right, right[3] / rows[3][3])
        return Unknowns(*(value + change for value, change in zip(z, step, strict=True)))

    def linear(g: Callable[[Unknowns], Unknowns], asked: Unknowns) -> Unknowns:
        one, zero = jnp.ones_like(asked.fraction), jnp.zeros_like(asked.fraction)
        columns = [g(Unknowns(*(one if k == at else zero for k in range(4)))) for at in range(4)]
        rows, right = _eliminated([list(row) for row in zip(*columns, strict=True)], list(asked))
        return Unknowns(*_back_substituted(rows, right, right[3] / rows[3][3]))

    z = lax.custom_root(equations, solved.z, corrected, linear)
    # Rounding of the last correction only; not `clip`, which halves the derivative at the ends themselves.
    xi = jnp.where(z.fraction > 1.0, 1.0, jnp.where(z.fraction < 0.0, 0.0, z.fraction))
    xi = jnp.where(branch.heating | branch.cooling, xi, old.martensite_fraction)
    stress = jnp.maximum(z.stress, 0.0)
    strain = strain_at(wire, effects, old, z.temperature, stress, xi)
    return remembered(wire.kinetics, effects, old, branch, z.temperature, stress, strain, xi), z


def _stage(system: System, stage: Stage, inputs: Inputs) -> tuple[State, Scalar, Scalar, Scalar]:
    """One stage of a moving load: (state at its end, dH/dt, v, a)."""
    load = system.load
    assert isinstance(load, AbstractMovingLoad)
    wire, z = _ended(system, stage, inputs)
    heating, velocity, acceleration = _rates(system, stage, inputs, z)
    lower, upper = load.limits()
    free = _free_position(system, stage, inputs, z)
    below, above = free < lower, free > upper
    position = jnp.where(below, lower, jnp.where(above, upper, z.position))
    velocity = jnp.where(below | above, 0.0, velocity)  # inelastic
    acceleration = jnp.where(below | above, 0.0, acceleration)
    friction, _ = _friction(stage, position)
    new = State(stage.time, wire, Motion(position, velocity, friction), stage.old.reading)
    return new, heating, velocity, acceleration


def _moving_step(system: System, state: State, inputs: Inputs, dt: Scalar) -> State:
    """SDIRK2: both stages are backward-Euler solves over gamma dt, the second from a base moved on by the first."""
    heat = stored_heat(system.wire, system.effects, state.wire.temperature, state.wire.martensite_fraction)
    rest = (1.0 - GAMMA) * dt

    def body(at: Stage, time: Scalar) -> tuple[Stage, None]:
        new, heating, velocity, acceleration = _stage(system, at, inputs)
        base = (at.heat + rest * heating, at.position + rest * velocity, at.velocity + rest * acceleration)
        return Stage(new, time, at.step, *base), None

    first = Stage(state, state.time + GAMMA * dt, GAMMA * dt, heat, state.motion.position, state.motion.velocity)
    # The scanned value is the time at which the *next* stage ends.
    end, _ = lax.scan(body, first, jnp.stack([state.time + dt, state.time + dt]))
    return State(end.time, end.old.wire, end.old.motion, end.old.reading)


def _coupon_step(system: System, state: State, inputs: Inputs, dt: Scalar) -> State:
    """Temperature and stress at the end of the step are prescribed: the fraction follows in closed form."""
    wire, effects, old = system.wire, system.effects, state.wire
    temperature, stress = inputs["temperature"], jnp.maximum(inputs["stress"], 0.0)
    heated, cooled = curves(wire.kinetics, effects, old, temperature, stress)
    open_at_start = open_branches(wire.kinetics, effects, old)
    branch = choose_branch(wire.kinetics, old, open_at_start, temperature, stress, heated, cooled)
    xi = fraction_on(old, branch, heated, cooled)
    strain = strain_at(wire, effects, old, temperature, stress, xi)
    new = remembered(wire.kinetics, effects, old, branch, temperature, stress, strain, xi)
    return State(state.time + dt, new, state.motion, state.reading)


def _strain_coupon_step(system: System, state: State, inputs: Inputs, dt: Scalar) -> State:
    """Temperature and strain at the end of the step are prescribed: the fraction is the root of one equation.

    For any fraction the strain gives the stress, and with it the curve; fraction less curve rises with the fraction,
    so the root lies between the present fraction and the end of the branch: Newton's method held in that bracket.
    """
    wire, effects, old = system.wire, system.effects, state.wire
    temperature, strain = inputs["temperature"], inputs["strain"]
    before = old.martensite_fraction

    def stress_of(xi: Scalar) -> Scalar:
        return stress_at(wire, effects, old, strain, temperature, old.stress, xi)

    frozen = stress_of(before)
    curve = curves(wire.kinetics, effects, old, temperature, frozen)
    branch = choose_branch(wire.kinetics, old, open_branches(wire.kinetics, effects, old), temperature, frozen, *curve)

    def miss(xi: Scalar) -> Scalar:
        return xi - fraction_on(old, branch, *curves(wire.kinetics, effects, old, temperature, stress_of(xi)))

    low = jnp.where(branch.heating, 0.0, before)
    high = jnp.where(branch.cooling, 1.0, before)
    xi = root(miss, before, low, high)
    stress = stress_of(xi)
    own = strain_at(wire, effects, old, temperature, stress, xi)
    new = remembered(wire.kinetics, effects, old, branch, temperature, stress, own, xi)
    return State(state.time + dt, new, Motion(-strain, jnp.zeros_like(strain), jnp.zeros_like(strain)), state.reading)


def step(system: System, state: State, inputs: Inputs, dt: Scalar | float) -> State:
    """Advance one system by `dt` seconds with `inputs` (SI, scalars) held.

    Pure and differentiable in every floating argument; `vmap` it over any of them. For a coupon `inputs` are the
    values at the end of the step. The result satisfies the constitutive law against `state` to rounding.
    """
    dt = jnp.asarray(dt, dtype=float)
    if isinstance(system.load, Coupon):
        new = _coupon_step(system, state, inputs, dt)
        shown = new.wire.strain
    elif isinstance(system.load, StrainCoupon):
        new = _strain_coupon_step(system, state, inputs, dt)
        shown = new.wire.stress
    else:
        new = _moving_step(system, state, inputs, dt)
        shown = new.motion.position
    # Backward Euler in the reading: unlike exp(-dt/tau) it has a slope at tau = 0, which a score test needs.
    lag = sum(effect.sensor_time_constant() for effect in system.effects)
    reading = shown if isinstance(lag, (int, float)) and lag == 0 else (lag * state.reading + dt * shown) / (lag + dt)
    return State(new.time, new.wire, new.motion, reading)
