"""What effects carry of a wire from step to step: entries of `WireState.history`, there only if an effect asks for them."""

from __future__ import annotations

import abc
import dataclasses
from collections.abc import Mapping, Sequence

import jax
import jax.numpy as jnp

from smajax.model.types import Scalar, WireState
from smajax.model.wire.wire import Kinetics

DURATION = "duration"  # s, of the step that is being made
TRANSFORMED = "transformed"  # -, sum of all |d xi| so far; 2 a full cycle


class HistoryTerm(abc.ABC):
    """An effect that depends on the path: a strain that creeps, temperatures that drift with cycles, a supply that tires.

    The one mechanism for it: whatever equation the effect changes reads its entries from `WireState.history`. They are
    part of what a step solves, so stress and strain belong to them exactly.
    """

    @abc.abstractmethod
    def history_at_start(self, at: WireState) -> dict[str, Scalar]:
        """Its entries by name, of the wire `at` rest."""

    def history_after(self, old: WireState, new: WireState) -> dict[str, Scalar]:
        """The same entries after a step from `old` to `new`, whose strain and own history are not known yet."""
        return {}

    def turn_within(self, law: Kinetics, temperature: Scalar, stress: Scalar, old: WireState) -> Scalar | None:
        """The share of a step from `old` at which what it carries turns, while both go to these along straight lines; None: it turns with them.

        The phases turn there too. So a coupon's step is made in two parts, to there and from there.
        """
        return None


def history_at_start(terms: Sequence[HistoryTerm], at: WireState) -> dict[str, Scalar]:
    """All entries of the wire `at` rest. Raises ValueError for a term that reads or writes an entry which none has at the start."""
    history: dict[str, Scalar] = {}
    for term in terms:
        history |= term.history_at_start(at)
    _check_entries(terms, dataclasses.replace(at, history=history))
    return history


def _check_entries(terms: Sequence[HistoryTerm], at: WireState) -> None:
    """Raise ValueError for a term whose `history_after` reads or returns what no `history_at_start` has."""
    for term in terms:
        name = getattr(term, "effect_name", type(term).__name__)
        try:
            after = jax.eval_shape(term.history_after, at, at)
        except (LookupError, ValueError) as missing:
            raise ValueError(f"effect `{name}`: {missing_entry(str(missing.args[0]), at.history)}") from None
        if strange := sorted(after.keys() - at.history.keys()):
            raise ValueError(f"effect `{name}`: {missing_entry(strange[0], at.history)}")


def missing_entry(entry: str, history: Mapping[str, Scalar]) -> str:
    """What to do about an entry that is not there; a message that already says so as it is."""
    if " " in entry:
        return entry
    there = ", ".join(sorted(history)) or "none"
    return (
        f"the wire's history has no entry {entry!r} (there are: {there}). The effect has to inherit from HistoryTerm, and its history_at_start "
        "to return each of its entries, and DURATION where the length of a step is asked for."
    )


def history_after(terms: Sequence[HistoryTerm], old: WireState, new: WireState) -> dict[str, Scalar]:
    """All entries after a step from `old` to the temperature, stress and fraction of `new`."""
    history = dict(old.history)
    for term in terms:
        history |= term.history_after(old, new)
    return history


def over(old: WireState, duration: Scalar | float) -> WireState:
    """`old` as the beginning of a step of `duration` seconds; 0: as it is."""
    if DURATION not in old.history:
        return old
    return dataclasses.replace(old, history={**old.history, DURATION: duration + jnp.zeros_like(old.stress)})


def transformed(old: WireState, new: WireState) -> dict[str, Scalar]:
    """The entry `TRANSFORMED` after a step."""
    return {TRANSFORMED: old.history[TRANSFORMED] + jnp.abs(new.martensite_fraction - old.martensite_fraction)}


def with_step_to(fraction: Scalar, old: WireState) -> WireState:
    """`old` with what has transformed by the end of a step to `fraction`, where an effect counts that; else as it is."""
    if TRANSFORMED not in old.history:
        return old
    return dataclasses.replace(
        old, history={**old.history, **transformed(old, dataclasses.replace(old, martensite_fraction=fraction))}
    )


def forgotten(steps: Scalar) -> Scalar:
    """1 - exp(-steps), without the cancellation that leaves single precision nothing of a small one."""
    small = steps < 1e-3
    short = jnp.where(small, steps, 0.0)
    return jnp.where(small, short * (1.0 - 0.5 * short * (1.0 - short / 3.0)), 1.0 - jnp.exp(-steps))


def following(old: WireState, name: str, before: Scalar, now: Scalar, time_constant: Scalar) -> Scalar:
    r"""The entry `name` after a step in which what it follows went from `before` to `now`, time constant $\tau$ in s.

    Exact for a straight line between the two, $x + (x_{old} - x_{before}) e^{-h/\tau} - (x - x_{before})(1 - e^{-h/\tau})\tau/h$:
    its value at the end of a step is as good for a lag of less than one as for a long one; where it turns within says `HistoryTerm.turn_within`. `now` itself at 0 s.
    """
    for entry in (DURATION, name):
        if entry not in old.history:
            raise ValueError(f"following {name!r}: {missing_entry(entry, old.history)}")
    # A time constant of a femtosecond is none, and has a derivative that zero has not.
    steps = jnp.maximum(old.history[DURATION], 1e-12) / (time_constant + 1e-15)
    gone = forgotten(steps)
    return now + (old.history[name] - before) * (1.0 - gone) - (now - before) * gone / steps
