"""Two populations: a share of the wire follows other branch conditions than the law's and has amplitudes of its own.

Temperature and stress are the same in both, xi is the mean. Everything here is `kinetics` itself where no effect asks
for a second population.
"""

from __future__ import annotations

import dataclasses

import jax.numpy as jnp
from jaxtyping import Array, Bool

from smajax.model.types import Scalar, WireState
from smajax.model.wire import kinetics
from smajax.model.wire.conditions import AbstractConditions
from smajax.model.wire.kinetics import Branch
from smajax.model.wire.kinetics_terms import KineticsTerms
from smajax.model.wire.wire import Kinetics

# Entries of `WireState.history`; the amplitudes of the law's own population are where they always are.
OWN = "fraction_of_own"
OTHER = "other_"
OF_OTHER = ("martensite_fraction", "xi_M", "xi_A", "heating_missed", "cooling_missed")


def second(terms: KineticsTerms) -> tuple[AbstractConditions, Scalar] | None:
    """(conditions of the second population, its share); None where there is one. The first effect that has any counts."""
    return terms.populations[0].second_conditions() if terms.populations else None


def with_second_population(terms: KineticsTerms, state: WireState) -> WireState:
    """`state`, at rest, with a second population like the first."""
    if second(terms) is None:
        return state
    other = {OTHER + name: getattr(state, name) for name in OF_OTHER}
    return dataclasses.replace(state, history={**state.history, OWN: state.martensite_fraction, **other})


def _parts(state: WireState) -> tuple[WireState, WireState]:
    """The two parts as wires."""
    own = dataclasses.replace(state, martensite_fraction=state.history[OWN])
    return own, dataclasses.replace(state, **{name: state.history[OTHER + name] for name in OF_OTHER})


def _joined(whole: WireState, own: WireState, other: WireState) -> WireState:
    amplitudes = {name: getattr(own, name) for name in OF_OTHER if name != "martensite_fraction"}
    entries = {OTHER + name: getattr(other, name) for name in OF_OTHER}
    history = {**whole.history, OWN: own.martensite_fraction, **entries}
    return dataclasses.replace(whole, **amplitudes, history=history)


def open_branches(law: Kinetics, terms: KineticsTerms, old: WireState) -> Branch:
    """`kinetics.open_branches`, of each part where there are two."""
    if second(terms) is None:
        return kinetics.open_branches(law, terms, old)
    own, other = (kinetics.open_branches(law, terms, part) for part in _parts(old))
    return Branch(own.heating | other.heating, own.cooling | other.cooling, (own, other))


def choose_branch(
    law: Kinetics,
    terms: KineticsTerms,
    old: WireState,
    open_at_start: Branch,
    temperature: Scalar,
    stress: Scalar,
) -> Branch:
    """The branch of a step to (`temperature`, `stress`), tried with the fraction frozen; that of each part within it."""

    def of(law: Kinetics, old: WireState, opened: Branch) -> Branch:
        at = temperature, stress
        return kinetics.choose_branch(law, terms, old, opened, *at, *kinetics.curves(law, terms, old, *at))

    second_part = second(terms)
    if second_part is None or open_at_start.parts is None:
        return of(law, old, open_at_start)
    conditions, share = second_part
    other_law = dataclasses.replace(law, conditions=conditions)
    (own_old, other_old), (own_open, other_open) = _parts(old), open_at_start.parts
    own, other = of(law, own_old, own_open), of(other_law, other_old, other_open)
    # A part of no size does not move the whole: the base model's solver is then the base model's.
    counts = share > 0.0
    return Branch(own.heating | (counts & other.heating), own.cooling | (counts & other.cooling), (own, other))


def curve_on(
    law: Kinetics,
    terms: KineticsTerms,
    old: WireState,
    branch: Branch,
    temperature: Scalar,
    stress: Scalar,
) -> Scalar:
    """xi at the end of a step on `branch` to (`temperature`, `stress`)."""
    if branch.parts is None:
        return kinetics.curve_on(law, terms, old, branch, temperature, stress)
    own, other = _fractions(law, terms, old, branch, temperature, stress)
    return _mean(terms, own, other)


def _mean(terms: KineticsTerms, own: Scalar, other: Scalar) -> Scalar:
    second_part = second(terms)
    assert second_part is not None
    return (1.0 - second_part[1]) * own + second_part[1] * other


def _fractions(
    law: Kinetics,
    terms: KineticsTerms,
    old: WireState,
    branch: Branch,
    temperature: Scalar,
    stress: Scalar,
) -> tuple[Scalar, Scalar]:
    assert branch.parts is not None
    of = [
        kinetics.curve_on(law, terms, *one, temperature, stress) for one in zip(_parts(old), branch.parts, strict=True)
    ]
    return of[0], of[1]


def _within(xi: Scalar) -> Scalar:
    # Rounding only; not `clip`, which halves the derivative at the ends themselves.
    return jnp.where(xi > 1.0, 1.0, jnp.where(xi < 0.0, 0.0, xi))


def _settled(old: WireState, branch: Branch, xi: Scalar) -> Scalar:
    return jnp.where(branch.heating | branch.cooling, _within(xi), old.martensite_fraction)


def settled(
    law: Kinetics,
    terms: KineticsTerms,
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
    fractions = _fractions(law, terms, old, branch, temperature, stress)
    off = xi - _mean(terms, *fractions)
    own, other = (
        _settled(part, of, fraction + off)
        for part, of, fraction in zip(_parts(old), branch.parts, fractions, strict=True)
    )
    return _mean(terms, own, other), (own, other)


def with_amplitudes(
    law: Kinetics,
    terms: KineticsTerms,
    old: WireState,
    branch: Branch,
    new: WireState,
    fractions: tuple[Scalar, Scalar] | None,
) -> WireState:
    """`kinetics.with_amplitudes` of `new`, each population by itself at its own of the `fractions` of `settled`."""
    if fractions is None or branch.parts is None:
        return kinetics.with_amplitudes(law, terms, old, branch, new)
    own, other = (
        kinetics.with_amplitudes(law, terms, part, of, dataclasses.replace(new, martensite_fraction=fraction))
        for part, of, fraction in zip(_parts(old), branch.parts, fractions, strict=True)
    )
    return _joined(dataclasses.replace(own, martensite_fraction=new.martensite_fraction), own, other)


def moved(terms: KineticsTerms, old: WireState, new: WireState) -> WireState:
    """`new`, which has another fraction than `old` and its parts, with both parts moved as far."""
    if second(terms) is None:
        return new
    by = new.martensite_fraction - old.martensite_fraction
    fractions = {name: _within(old.history[name] + by) for name in (OWN, OTHER + "martensite_fraction")}
    return dataclasses.replace(new, history={**new.history, **fractions})


def corrected(
    law: Kinetics, terms: KineticsTerms, old: WireState, new: WireState, transforming: Bool[Array, ""]
) -> WireState:
    """`new`, which an estimator has put to another fraction than `old`, its curves laid through it so that nothing jumps."""

    def laid(part: WireState, fraction: Scalar) -> WireState:
        at = new.temperature, new.stress, dataclasses.replace(new, xi_M=part.xi_M, xi_A=part.xi_A)
        h, k = kinetics.martensite_left(law, terms, *at), kinetics.austenite_left(law, terms, *at)
        amplitudes = law.renewal.corrected(part, transforming, h, k, fraction)
        return dataclasses.replace(
            new,
            martensite_fraction=fraction,
            xi_M=amplitudes.xi_M,
            xi_A=amplitudes.xi_A,
            heating_missed=amplitudes.heating_missed,
            cooling_missed=amplitudes.cooling_missed,
        )

    if second(terms) is None:
        return laid(old, new.martensite_fraction)
    own, other = (laid(part, now.martensite_fraction) for part, now in zip(_parts(old), _parts(new), strict=True))
    return _joined(new, own, other)
