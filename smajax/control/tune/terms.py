r"""What tuning makes small, while a loop runs: the figures of `merit` with a derivative in the gains.

Overshoot, steady error, energy and peak temperature have one as they are (a maximum over time has that of its sample).
The settling time has none where it jumps from one swing to the next; in its place stands a memory of when the
angle was outside of the band b last,

    ds/dt = r(e) (t - s),      r = exp((|e|/b - 1)/w)/tau,

which follows the time while the angle is outside and holds it inside. With the softness w -> 0 it is the settling time.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import equinox as eqx
import jax.numpy as jnp
import numpy as np

from smajax.control.closed_loop import AbstractLoopObserver
from smajax.control.figures_of_merit import Merit, MeritObserver
from smajax.control.position_unit import DEGREES, PositionUnit
from smajax.model.types import Scalar, Series, State

FOLLOWS = 0.05  # s, tau: how fast the memory follows at the edge of the band
STEEPEST = 30.0  # exponent from where on it follows at once
EARLIEST, LATEST = 0.7, 0.95  # share of the run between which a loop that settles late becomes one that never does


class Term(NamedTuple):
    """A term as a user names and weighs it."""

    label: str
    unit: str  # shown, and of weights and limits
    factor: float  # from SI


# By the fields of `Terms`, of an angle.
TERMS = {
    "tracking_error": Term("error, weighted by time", "°", 180.0 / np.pi),
    "overshoot": Term("overshoot", "°", 180.0 / np.pi),
    "settling_time": Term("settling time", "s", 1.0),
    "steady_error": Term("steady error", "°", 180.0 / np.pi),
    "energy": Term("energy into the wire", "J", 1.0),
    "chatter": Term("chatter of the command", "V/s", 1.0),
    "peak_temperature": Term("peak temperature", "°C", 1.0),
}
FACTORS = np.asarray([term.factor for term in TERMS.values()])


def terms_in(unit: PositionUnit) -> dict[str, Term]:
    """`TERMS` of a load whose position is shown in this unit."""
    if unit == DEGREES:
        return TERMS
    own = {name: Term(term.label, unit.label, unit.factor) for name, term in TERMS.items() if term.unit == "°"}
    chatter = TERMS["chatter"]
    return {**TERMS, **own, "chatter": Term(chatter.label, f"{unit.command}/s", chatter.factor)}


def factors_in(unit: PositionUnit) -> np.ndarray:
    """From SI to the units of `terms_in`, (terms,)."""
    return np.asarray([term.factor for term in terms_in(unit).values()])


SETTLING = tuple(TERMS).index("settling_time")


class Terms(NamedTuple):
    """Of one closed loop, SI."""

    tracking_error: Scalar  # rad or m, mean of |e| weighted by the time since the start
    overshoot: Scalar  # rad or m
    settling_time: Scalar  # s, the memory s at the end: nearly the run's length where it never settles
    steady_error: Scalar  # rad or m
    energy: Scalar  # J
    chatter: Scalar  # V/s (A/s, W/s), how far the command moves in a second, up and down
    peak_temperature: Scalar  # C


class _Seen(NamedTuple):
    judged: Any  # of the figures of merit
    outside: Scalar  # s
    late: Scalar  # rad s^2, sum of t |e| dt
    command: Scalar  # V, the last one; nan before the first
    moved: Scalar  # V


class TermObserver(AbstractLoopObserver):
    """Terms and figures of merit of a loop while it runs: (`Terms`, `Merit`)."""

    merit: MeritObserver
    softness: Scalar  # w, share of the band

    def init(self, state: State) -> _Seen:
        zero = jnp.zeros_like(state.motion.position)
        return _Seen(self.merit.init(state), zero, zero, jnp.full_like(zero, jnp.nan), zero)

    def see(self, memory: _Seen, state: State, voltage: Scalar, dt: Scalar) -> _Seen:
        judged = self.merit.see(memory.judged, state, voltage, dt)
        since = judged.time - judged.began
        size = jnp.abs(state.motion.position - self.merit.target)
        steep = (size / self.merit.band - 1.0) / self.softness
        rate = jnp.exp(jnp.minimum(steep, STEEPEST)) / FOLLOWS
        first = jnp.isnan(memory.command)
        return _Seen(
            judged,
            memory.outside - jnp.expm1(-rate * dt) * (since - memory.outside),
            memory.late + since * size * dt,
            voltage,
            memory.moved + jnp.where(first, 0.0, jnp.abs(voltage - jnp.where(first, voltage, memory.command))),
        )

    def summary(self, memory: _Seen) -> tuple[Terms, Merit]:
        merit = self.merit.summary(memory.judged)
        seconds = memory.judged.time - memory.judged.began
        # To twice the run, which a loop costs that never settles, as the settling time comes near to the steady part.
        late = jnp.clip((memory.outside / seconds - EARLIEST) / (LATEST - EARLIEST), 0.0, 1.0)
        terms = Terms(
            memory.late / (0.5 * seconds**2),
            merit.overshoot,
            memory.outside + seconds * late**2 * (3.0 - 2.0 * late),
            merit.steady_error,
            merit.energy,
            memory.moved / seconds,
            merit.peak_temperature,
        )
        return terms, merit


def term_vector(terms: Terms, factors: Series) -> Scalar:
    """The terms as a vector, shape (terms,), in the units of `factors_in`."""
    return jnp.stack(terms) * factors


def exact_vector(terms: Terms, merit: Merit, seconds: Scalar | float, factors: Series) -> Scalar:
    """The same with the settling time itself, and twice the run where there is none: what a user asked for."""
    settling = jnp.where(jnp.isfinite(merit.settling_time), merit.settling_time, 2.0 * seconds)
    return term_vector(terms._replace(settling_time=settling), factors)


def term_observer(merit: MeritObserver, softness: Scalar) -> TermObserver:
    """The observer of terms around one of figures of merit."""
    return eqx.tree_at(
        lambda observer: observer.softness, TermObserver(merit, softness), jnp.asarray(softness, dtype=float)
    )
