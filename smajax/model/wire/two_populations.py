"""A wire of which a share follows other branch conditions than the law's: two parts with memories of their own.

Temperature and stress are the same in both, xi is the mean. Everything here is `kinetics` itself where no effect asks
for a second part.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

import jax.numpy as jnp
from jaxtyping import Array, Bool

from smajax.model.effects.base import AbstractEffect
from smajax.model.types import Scalar, WireState
from smajax.model.wire import kinetics
from smajax.model.wire.conditions import AbstractConditions
from smajax.model.wire.history import kept_after
from smajax.model.wire.kinetics import Branch, Kinetics

OWN = "fraction_of_own"  # entries of `WireState.kept`; the amplitudes of the law's own part are where they always are
OTHER = "other_"
OF_OTHER = ("martensite_fraction", "xi_M", "xi_A", "heating_missed", "cooling_missed")


def second(effects: Sequence[AbstractEffect]) -> tuple[AbstractConditions, Scalar] | None:
    """(conditions of the second part, its share); None where the wire is one. One effect has a second part at most."""
    return next((found for effect in effects if (found := effect.second_conditions()) is not None), None)


def begun(effects: Sequence[AbstractEffect], state: WireState) -> WireState:
    """`state`, at rest, with a second part like the first."""
    if second(effects) is None:
        return state
    other = {OTHER + name: getattr(state, name) for name in OF_OTHER}
    return dataclasses.replace(state, kept={**state.kept, OWN: state.martensite_fraction, **other})


def _parts(state: WireState) -> tuple[WireState, WireState]:
    """The two parts as wires."""
    own = dataclasses.replace(state, martensite_fraction=state.kept[OWN])
    return own, dataclasses.replace(state, **{name: state.kept[OTHER + name] for name in OF_OTHER})


def _joined(whole: WireState, own: WireState, other: WireState) -> WireState:
    amplitudes = {name: getattr(own, name) for name in OF_OTHER if name != "martensite_fraction"}
    entries = {OTHER + name: getattr(other, name) for name in OF_OTHER}
    kept = {**whole.kept, OWN: own.martensite_fraction, **entries}
    return dataclasses.replace(whole, **amplitudes, kept=kept)


def open_branches(law: Kinetics, effects: Sequence[AbstractEffect], old: WireState) -> Branch:
    """`kinetics.open_branches`, of each part where there are two."""
    if second(effects) is None:
        return kinetics.open_branches(law, effects, old)
    own, other = (kinetics.open_branches(law, effects, part) for part in _parts(old))
    return Branch(own.heating | other.heating, own.cooling | other.cooling, (own, other))


def choose_branch(
    law: Kinetics,
    effects: Sequence[AbstractEffect],
    old: WireState,
    open_at_start: Branch,
    temperature: Scalar,
    stress: Scalar,
) -> Branch:
    """The branch of a step to (`temperature`, `stress`), tried with the fraction frozen; that of each part within it."""

    def of(law: Kinetics, old: WireState, opened: Branch) -> Branch:
        at = temperature, stress
        return kinetics.choose_branch(law, effects, old, opened, *at, *kinetics.curves(law, effects, old, *at))

    found = second(effects)
    if found is None or open_at_start.parts is None:
        return of(law, old, open_at_start)
    conditions, share = found
    other_law = dataclasses.replace(law, conditions=conditions)
    (own_old, other_old), (own_open, other_open) = _parts(old), open_at_start.parts
    own, other = of(law, own_old, own_open), of(other_law, other_old, other_open)
    # A part of no size does not move the whole: the base model's solver is then the base model's.
    counts = share > 0.0
    return Branch(own.heating | (counts & other.heating), own.cooling | (counts & other.cooling), (own, other))


def curve_on(
    law: Kinetics,
    effects: Sequence[AbstractEffect],
    old: WireState,
    branch: Branch,
    temperature: Scalar,
    stress: Scalar,
) -> Scalar:
    """xi at the end of a step on `branch` to (`temperature`, `stress`)."""
    if branch.parts is None:
        return kinetics.curve_on(law, effects, old, branch, temperature, stress)
    own, other = _fractions(law, effects, old, branch, temperature, stress)
    return _mean(effects, own, other)


def _mean(effects: Sequence[AbstractEffect], own: Scalar, other: Scalar) -> Scalar:
    found = second(effects)
    assert found is not None
    return (1.0 - found[1]) * own + found[1] * other


def _fractions(
    law: Kinetics,
    effects: Sequence[AbstractEffect],
    old: WireState,
    branch: Branch,
    temperature: Scalar,
    stress: Scalar,
) -> tuple[Scalar, Scalar]:
    assert branch.parts is not None
    of = [
        kinetics.curve_on(law, effects, *one, temperature, stress)
        for one in zip(_parts(old), branch.parts, strict=True)
    ]
    return of[0], of[1]


def _within(xi: Scalar) -> Scalar:
    # Rounding only; not `clip`, which halves the derivative at the ends themselves.
    return jnp.where(xi > 1.0, 1.0, jnp.where(xi < 0.0, 0.0, xi))


def _settled(old: WireState, branch: Branch, xi: Scalar) -> Scalar:
    return jnp.where(branch.heating | branch.cooling, _within(xi), old.martensite_fraction)


def settled(
    law: Kinetics,
    effects: Sequence[AbstractEffect],
    old: WireState,
    branch: Branch,
    temperature: Scalar,
    stress: Scalar,
    xi: Scalar,
) -> tuple[Scalar, tuple[Scalar, Scalar] | None]:
    """(the fraction that a step ends with, those of the parts), `xi` as the solver left it: rounding taken off.

    A part that transforms takes what the solver is off by; one that does not stays as it is.
    """
    if branch.parts is None:
        return _settled(old, branch, xi), None
    fractions = _fractions(law, effects, old, branch, temperature, stress)
    off = xi - _mean(effects, *fractions)
    own, other = (
        _settled(part, of, fraction + off)
        for part, of, fraction in zip(_parts(old), branch.parts, fractions, strict=True)
    )
    return _mean(effects, own, other), (own, other)


def remembered(
    law: Kinetics,
    effects: Sequence[AbstractEffect],
    old: WireState,
    branch: Branch,
    temperature: Scalar,
    stress: Scalar,
    strain: Scalar,
    fractions: tuple[Scalar, tuple[Scalar, Scalar] | None],
) -> WireState:
    """`kinetics.remembered` after a step to `fractions` of `settled`, each part by itself."""
    xi, parts = fractions
    if parts is None or branch.parts is None:
        return kinetics.remembered(law, effects, old, branch, temperature, stress, strain, xi)
    own, other = (
        kinetics.remembered(law, effects, part, of, temperature, stress, strain, own_xi)
        for part, of, own_xi in zip(_parts(old), branch.parts, parts, strict=True)
    )
    whole = dataclasses.replace(
        own,
        martensite_fraction=xi,
        detwinned_fraction=law.variants.detwinned(old, stress, xi),
        kept=kept_after(effects, old, temperature, stress, xi),
    )
    return _joined(whole, own, other)


def moved(effects: Sequence[AbstractEffect], old: WireState, new: WireState) -> WireState:
    """`new`, which has another fraction than `old` and its parts, with both parts moved as far."""
    if second(effects) is None:
        return new
    by = new.martensite_fraction - old.martensite_fraction
    fractions = {name: _within(old.kept[name] + by) for name in (OWN, OTHER + "martensite_fraction")}
    return dataclasses.replace(new, kept={**new.kept, **fractions})


def corrected(
    law: Kinetics, effects: Sequence[AbstractEffect], old: WireState, new: WireState, transforming: Bool[Array, ""]
) -> WireState:
    """`new`, which an estimator has put to another fraction than `old`, its curves laid so that nothing jumps."""

    def laid(part: WireState, fraction: Scalar) -> WireState:
        at = new.temperature, new.stress, dataclasses.replace(new, xi_M=part.xi_M, xi_A=part.xi_A)
        h, k = kinetics.martensite_left(law, effects, *at), kinetics.austenite_left(law, effects, *at)
        kept = law.renewal.corrected(part, transforming, h, k, fraction)
        return dataclasses.replace(
            new,
            martensite_fraction=fraction,
            xi_M=kept.xi_M,
            xi_A=kept.xi_A,
            heating_missed=kept.heating_missed,
            cooling_missed=kept.cooling_missed,
        )

    if second(effects) is None:
        return laid(old, new.martensite_fraction)
    own, other = (laid(part, now.martensite_fraction) for part, now in zip(_parts(old), _parts(new), strict=True))
    return _joined(new, own, other)
