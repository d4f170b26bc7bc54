r"""Receding horizon (model predictive) control: every period a plan of commands is improved by a Gauss-Newton step, and its first command held.

A plan is N shares q_j of the largest heating power, in [0, 1], each held for the time h: the command is u_max sqrt(q_j), of a power supply u_max q_j. From the measured
state on the package's own step (`simulation.step`) gives positions x_k at M times t_k and the velocity v at the end. With the set point x_d extrapolated by its own
derivatives, and q_{-1} the share that is held now,

    J(q) = 1/M sum_k (b_k (x_k - x_d(t_k) - I))^2 + (tau_v (v - v_d))^2 + w^2 sum_j (q_j - q_{j-1})^2 = r(q)^T r(q),

b_k = b where an error grows beyond the set point, else 1: a wire that went too far comes back only through its hysteresis. With A = dr/dq by automatic differentiation a step is

    (A^T A + mu^2 1) s = -A^T r,      q <- q + s within [0, 1]

(Gauss-Newton damped as by Levenberg 1944, one step a period as in Diehl, Bock and Schloeder 2005, SIAM J. Control Optim. 43, 1714). A share that comes to a limit is held there, and the others are
solved for again. The next period begins with the plan shifted by a period.

Two memories take what the model has wrong. The air is believed warmer by a, which sums up how much warmer the wire became in a period than was predicted: it stands for a wrong convection, air
or supply. I follows what error is left: dI/dt = (x_d - x)/T_i, the error within a band, while the command is within its limits.
"""

from __future__ import annotations

import dataclasses
from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
from jax import lax
from jaxtyping import Array, Float

from smajax.control.controllers.base import AbstractController
from smajax.control.controllers.position_integral import next_integral
from smajax.control.controllers.preset import EQUATION, STATE, Box, ControllerPreset
from smajax.control.load_equation import moving_load
from smajax.control.measured_state import MeasuredState
from smajax.control.reference import Reference
from smajax.core.limited import limited
from smajax.core.parameters import parameter
from smajax.model.system import System, initial_state
from smajax.model.types import Scalar, State
from smajax.model.wire.two_populations import moved
from smajax.simulation.input_delay import refuse_lag
from smajax.simulation.integrate import Carry, Schedule, integrate
from smajax.simulation.step import step

Plan = Float[Array, " pieces"]
# The smallest share: the root of a smaller one has no slope. A command is 0 there; else it is a thousandth of the largest one at least.
LEAST = 1e-6


class RecedingHorizonMemory(eqx.Module):
    """What goes from one call to the next."""

    plan: Plan  # -, heating shares from now on
    held: Scalar  # -, the share that was asked for last
    expected: State  # what the model says of now
    air: Scalar  # K, by which the air is believed warmer than the model's
    integral: Scalar  # rad, m


class Normal(NamedTuple):
    """The normal equations of a least squares problem near a plan: summed up as residuals come, which are not stored."""

    matrix: Float[Array, "pieces pieces"]  # A^T A
    downhill: Plan  # -A^T r

    def with_residual(self, residual: Scalar, slopes: Plan) -> Normal:
        """With one more residual, which has these derivatives by the plan."""
        return Normal(self.matrix + slopes[:, None] * slopes[None, :], self.downhill - residual * slopes)


def solved(matrix: list[list[Scalar]], right: list[Scalar]) -> list[Scalar]:
    """x of a positive definite system, by elimination, written out for its size: any engine and the export run it."""
    size = len(right)
    rows = [[*row, value] for row, value in zip(matrix, right, strict=True)]
    for k in range(size):
        for below in range(k + 1, size):
            share = rows[below][k] / rows[k][k]
            rows[below] = [
                *rows[below][: k + 1],
                *(rows[below][j] - share * rows[k][j] for j in range(k + 1, size + 1)),
            ]
    answer: list[Scalar] = []
    for k in reversed(range(size)):
        rest = sum(rows[k][k + 1 + j] * one for j, one in enumerate(answer))
        answer.insert(0, (rows[k][size] - rest) / rows[k][k])
    return answer


def improved(plan: Plan, normal: Normal, damping: Scalar) -> Plan:
    """The plan after one damped Gauss-Newton step within [LEAST, 1]; the quadratic that the step minimises never rises.

    Each round goes towards the solution for the shares that are free, as far as the first one that comes to a limit, and holds it there.
    """
    size = plan.shape[0]
    matrix, downhill = normal.matrix + damping**2 * jnp.eye(size, dtype=plan.dtype), normal.downhill
    at_limit = ((plan <= LEAST) & (downhill < 0.0)) | ((plan >= 1.0) & (downhill > 0.0))

    def round_(_: int, now: tuple[Plan, Plan]) -> tuple[Plan, Plan]:
        new, free = now
        # Those that are held have an equation of their own: no change.
        reduced = matrix * free[:, None] * free[None, :] + jnp.diag(1.0 - free)
        right = free * (downhill - matrix @ (new - plan))
        rows = [list(jnp.unstack(row)) for row in jnp.unstack(reduced)]
        change = jnp.stack(solved(rows, list(jnp.unstack(right))))
        limit = jnp.where(change > 0.0, 1.0, LEAST)
        moves = change != 0.0
        share = jnp.where(moves, (limit - new) / jnp.where(moves, change, 1.0), jnp.inf)
        first = jnp.min(share)
        whole = first >= 1.0
        reached = ~whole & (share <= first)
        further = limited(new + jnp.where(whole, 1.0, first) * change, LEAST, 1.0)
        return jnp.where(reached, limit, further), jnp.where(reached, 0.0, free)

    new, _ = lax.fori_loop(0, size, round_, (plan, jnp.where(at_limit, 0.0, 1.0)))
    return new


class RecedingHorizon(AbstractController):
    """Needs the whole state; `believed` is the plant as the controller knows it, with its effects."""

    believed: System
    largest_voltage: Scalar = parameter("V", 0.0, 1e4, "largest command; the smallest is zero", limits_command=True)
    piece_time: Scalar = parameter("s", 1e-4, 1e4, "h: for how long a command of the plan is held")
    velocity_time: Scalar = parameter("s", 0.0, 1e4, "tau_v: weight of the velocity at the end of the horizon")
    beyond_weight: Scalar = parameter("-", 1.0, 1e4, "b: weight of an error that grows, beyond the set point")
    change_weight: Scalar = parameter("rad", 0.0, 1e4, "w: weight of a change from no heating to the largest")
    damping_weight: Scalar = parameter("rad", 1e-9, 1e4, "mu: weight of a step away from the last plan")
    integral_time: Scalar = parameter("s", 1e-3, 1e9, "T_i: time constant with which an error is integrated")
    integral_band: Scalar = parameter("rad", 0.0, 1e4, "larger errors are integrated as if they were this one")
    air_gain: Scalar = parameter(
        "-", 0.0, 1e4, "warmth of the air that is believed for a wire warmer than predicted, a period"
    )
    pieces: int = eqx.field(static=True, default=5)  # N
    steps: int = eqx.field(static=True, default=4)  # of the model, in a piece
    iterations: int = eqx.field(static=True, default=1)  # Gauss-Newton steps, a period

    def start(self, measured: MeasuredState, wanted: Reference) -> RecedingHorizonMemory:
        zero = jnp.zeros_like(measured.position)
        rest = initial_state(self.believed, self.believed.drive.from_command(zero))
        none = LEAST + zero
        return RecedingHorizonMemory(
            jnp.full(self.pieces, LEAST) + zero, none, self._measured(rest, measured), zero, zero
        )

    def step(
        self, memory: RecedingHorizonMemory, measured: MeasuredState, wanted: Reference, period: Scalar
    ) -> tuple[RecedingHorizonMemory, Scalar]:
        air = memory.air + self.air_gain * (measured.temperature - memory.expected.wire.temperature)
        state = self._measured(memory.expected, measured)
        shifted = dataclasses.replace(wanted, position=wanted.position + memory.integral)
        plan = memory.plan
        for _ in range(self.iterations):
            plan = improved(plan, self.normal(plan, memory.held, state, shifted, air), self.damping_weight)
        share = plan[0]
        command = jnp.where(share > LEAST, self._command(share), 0.0)
        expected = step(self.believed, state, self._inputs(share, air), period)
        error = limited(measured.position - wanted.position, -self.integral_band, self.integral_band)
        error = error / self.integral_time
        integral = memory.integral - next_integral(jnp.zeros_like(air), error, period, command, self.largest_voltage)
        passed = jnp.minimum(period / self.piece_time, 1.0)
        later = plan + passed * (jnp.append(plan[1:], plan[-1]) - plan)
        return RecedingHorizonMemory(later, share, expected, air, integral), command

    def normal(self, plan: Plan, held: Scalar, state: State, wanted: Reference, air: Scalar) -> Normal:
        """The normal equations of J at a plan that begins in a state; held: the share until now."""
        pieces, count, dt = self.pieces, self.pieces * self.steps, self.piece_time / self.steps
        one = jnp.eye(pieces, dtype=plan.dtype)

        def advance(carry: Carry, now: tuple[Scalar, Scalar, Plan]) -> Carry:
            state, along, normal = carry.state
            share, number, moves = now
            time = number * dt
            after, along = self._advanced(state, along, share, moves, air, dt)
            goal = wanted.position + time * (wanted.velocity + 0.5 * time * wanted.acceleration)
            error = after.motion.position - goal
            beyond = error * (after.motion.velocity - wanted.velocity) > 0.0
            weight = jnp.where(beyond, self.beyond_weight, 1.0) / count**0.5
            return Carry((after, along, normal.with_residual(weight * error, weight * along.motion.position)))

        # Along each share of the plan the derivative of the state, one below the other.
        still = jax.tree.map(lambda leaf: jnp.zeros((pieces, *jnp.shape(leaf)), leaf.dtype), state)
        nothing = Normal(0.0 * one, 0.0 * plan)
        # Broadcast, since the derivative of a repetition is a lookup that machine code has not.
        shares = jnp.reshape(jnp.broadcast_to(plan[:, None], (pieces, self.steps)), (count,))
        moved_by = jnp.reshape(jnp.broadcast_to(one[:, None, :], (pieces, self.steps, pieces)), (count, pieces))
        numbers = 1.0 * jnp.arange(1, count + 1)
        start = Carry((state, still, nothing))
        march = integrate(advance, start, (shares, numbers, moved_by), Schedule(count))
        end, along, normal = march.end.state
        over = end.motion.velocity - wanted.velocity - count * dt * wanted.acceleration
        normal = normal.with_residual(self.velocity_time * over, self.velocity_time * along.motion.velocity)
        before, moves_before = held, 0.0 * plan
        for share, moves in zip(jnp.unstack(plan), jnp.unstack(one), strict=True):
            change = self.change_weight * (share - before)
            normal = normal.with_residual(change, self.change_weight * (moves - moves_before))
            before, moves_before = share, moves
        return normal

    def _advanced(
        self, state: State, along: State, share: Scalar, moves: Plan, air: Scalar, dt: Scalar
    ) -> tuple[State, State]:
        """The model's state after a step, and its derivatives along each share of the plan."""

        def advance(state: State, share: Scalar) -> State:
            return step(self.believed, state, self._inputs(share, air), dt)

        def one(along: State, moves: Scalar) -> tuple[State, State]:
            return jax.jvp(advance, (state, share), (along, moves))

        return jax.vmap(one, out_axes=(None, 0))(along, moves)

    def _command(self, share: Scalar) -> Scalar:
        """V; A, W of other drives."""
        return self.largest_voltage * (share if self.believed.drive.command[1] == "W" else jnp.sqrt(share))

    def _inputs(self, share: Scalar, air: Scalar) -> dict[str, Scalar]:
        ambient = self.believed.wire.heat.ambient_temperature + air
        return {**self.believed.drive.from_command(self._command(share)), "ambient_temperature": ambient}

    def _measured(self, state: State, measured: MeasuredState) -> State:
        """The model's state with what is measured put in; what is not (the history of effects) is as the model says."""
        load = moving_load(self.believed)
        wire = dataclasses.replace(
            state.wire,
            temperature=measured.temperature,
            stress=measured.stress,
            strain=-load.contraction(self.believed.wire) * (measured.position - load.start()),
            martensite_fraction=measured.martensite_fraction,
            detwinned_fraction=self.believed.wire.kinetics.variants.detwinned(
                state.wire, measured.stress, measured.martensite_fraction
            ),
            xi_M=measured.xi_M,
            xi_A=measured.xi_A,
        )
        wire = moved(self.believed.terms.kinetics, state.wire, wire)
        motion = dataclasses.replace(state.motion, position=measured.position, velocity=measured.velocity)
        return dataclasses.replace(state, wire=wire, motion=motion, unsolved=jnp.zeros_like(state.unsolved))


def receding_horizon(system: System) -> RecedingHorizon:
    """Gains of the arm, searched on the filter `adaptive` with noise and delay (studies/requirement)."""
    refuse_lag(system, "a receding horizon")
    return RecedingHorizon(
        believed=system,
        largest_voltage=10.0,
        piece_time=0.075,
        velocity_time=0.1,
        beyond_weight=20.0,
        change_weight=0.03,
        damping_weight=0.01,
        integral_time=1.7,
        integral_band=0.002,
        air_gain=3.0,
    )


BOX: Box = {
    "piece_time": (0.04, 0.3),
    "velocity_time": (0.001, 1.0),
    "beyond_weight": (1.0, 100.0),
    "change_weight": (1e-4, 1.0),
    "damping_weight": (1e-5, 0.1),
    "integral_time": (0.05, 10.0),
    "integral_band": (0.001, 0.1),
    "air_gain": (0.01, 50.0),
}
PRESET = ControllerPreset(
    receding_horizon, "change_weight", STATE, BOX, needs=EQUATION, known=frozenset({"believed"}), derivatives_by="xla"
)
