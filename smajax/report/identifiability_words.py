"""What the runs determine, in words: before a fit, of each estimate, and of combinations of them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from smajax.core.names import listed
from smajax.core.progress import Event, Message, WarningMessage
from smajax.core.wording import and_listed
from smajax.fit.directions import KELVINS, Direction, weak
from smajax.fit.identifiability import Checks, CorrelatedGroup, Identifiability
from smajax.fit.uncertainty import Remark, RemarkKind
from smajax.model.effects.library import LIBRARY

UNUSED_PRIORS = (
    "[priors] changes nothing here: they are of candidate effects and of the presets' values, which `smajax close-loop` fits (`--presets fitted` "
    "the latter here too); a prior of an unknown stands in its own section, as prior = { mean = ..., sigma = ... }"
)


def remark_text(remark: Remark) -> str:
    """Of a large correlated group the first other member is named, by which it can be found."""
    if remark.kind is RemarkKind.COMBINATION:
        return f"only a combination of it with {', '.join(remark.others)} is identifiable"
    if remark.kind is RemarkKind.CORRELATED:
        many = len(remark.others) > 2
        others = [remark.others[0], f"{len(remark.others) - 1} others"] if many else remark.others
        return f"correlated with {and_listed(others)}"
    return remark.kind.value


def check_sentences(warnings: Sequence[str], checks: Checks) -> tuple[str, ...]:
    """What was found before a fit. warnings: of the experiment file."""
    unused = (UNUSED_PRIORS,) if checks.unused_priors else ()
    return (*warnings, *unused, *_determined(checks))


def check_events(checks: Checks) -> Iterator[Event]:
    """The same without the file's warnings, as events of progress."""
    if checks.unused_priors:
        yield WarningMessage(f"check: {UNUSED_PRIORS}")
    for line in _determined(checks):
        yield Message(f"check: {line}")


def _determined(checks: Checks) -> Iterator[str]:
    yield from identifiability_sentences(checks.identifiable)
    if checks.freed_later:
        yield (
            f"That is with {listed(checks.freed_later)} at the presets' values. The file does not give them, so the search fits them as well: what these runs "
            "then determine of each is said beside its value."
        )
    if checks.held_presets:
        yield (
            f"The file does not give {listed(checks.held_presets)}: held at the values of the presets, or at the base that [priors.presets] has. "
            "`identify --presets fitted` fits them too, within what data sheets leave open, as close-loop does."
        )
    if checks.hidden_by_one_force:
        titles = and_listed([LIBRARY[name].candidate.title for name in checks.hidden_by_one_force])
        yield (
            f"In all fit runs the load pulls with the same force, so what depends on the stress cannot show: {titles} are not looked for. "
            "Runs under another load would show them."
        )
    for name in checks.said_by_parameters:
        effect = LIBRARY[name].candidate
        yield f"{effect.title[0].upper()}{effect.title[1:]}: not named in the end, because the search fits {and_listed(effect.same_as)}, which {'says' if len(effect.same_as) == 1 else 'say'} the same."


def identifiability_sentences(found: Identifiability) -> list[str]:
    """How many unknowns are identifiable, after those on which nothing depends, and before what is to be said of single ones."""
    if not found.unknowns:
        return ["Nothing is declared unknown: the base model is taken as it is."]
    looked, groups = found.correlated is not None, [_group(one) for one in found.correlated or ()]
    first = [
        f"{name}: nothing in these runs depends on it; fix it or measure something else."
        for name in found.without_effect
    ]
    if found.without_effect:
        first.append(
            f"That holds {found.taken_at}: a wire that never transforms there shows no parameter of its transformation. Where that "
            "is unexpected, check the bench's sizes, the drive and the initial guess first."
        )
    sentences = [
        f"{name}: the noise alone leaves more than a quarter of its range undetermined." for name in found.undetermined
    ]
    if groups and found.rank < len(found.unknowns):
        sentences += [f"{group}: fix one of them or measure runs that separate them." for group in groups]
    elif looked and not (first or sentences or groups) and 1 < len(found.unknowns) == found.rank:
        sentences.append("No two of them are strongly correlated.")
    return [*first, _rank_sentence(found, groups if looked else None), *sentences]


def _group(one: CorrelatedGroup) -> str:
    """`a and b are correlated (up to 0.995)`."""
    # Cut and not rounded: 0.9996 is not yet 1.
    most = np.floor(1e3 * one.most + 1e-6) / 1e3
    return f"{and_listed(one.names)} are correlated (up to {most:.3f})"


def _rank_sentence(found: Identifiability, correlated: Sequence[str] | None) -> str:
    """How many of the unknowns are identifiable. correlated: what is said of each group of them; None: not looked at."""
    rank, unknowns = found.rank, len(found.unknowns)
    how = f"(Jacobian of {found.samples} samples, rank {rank})"
    if rank == unknowns and correlated:
        one, of_each = ("one of them", "") if len(correlated) == 1 else ("one", "Of each group ")
        do = f"{of_each}fix {one} or measure runs that separate them."
        return (
            f"The {unknowns} unknowns are identifiable from these runs {how}, but not each by itself: {and_listed(correlated)}. "
            f"{do[0].upper()}{do[1:]}"
        )
    if rank == unknowns:
        which = f"All {unknowns} unknowns are" if unknowns > 1 else "The one unknown is"
        later = (
            "; how far their estimates are correlated, and whether a bound holds one, is known at the fit"
            if correlated is None and unknowns > 1
            else ""
        )
        return f"{which} identifiable from these runs {how}{later}."
    if rank == 0:
        return f"No unknown is identifiable from these runs {how}."
    return (
        f"Only {rank} combination{' is' if rank == 1 else 's are'} identifiable of the {unknowns} unknowns from these runs "
        f"{how}: standard errors of the others mean nothing. "
        f"Fix {unknowns - rank} of them."
    )


def weak_combinations(combinations: Sequence[Direction]) -> list[str]:
    """Sentences about the combinations that are poorly determined; none when all are well determined."""
    return [direction_sentence(one) for one in weak(combinations)]


def direction_sentence(one: Direction) -> str:
    """For an engineer."""
    named = one.named
    if one.unbound:
        if len(named) == 1:
            return f"Nothing in these runs depends on {next(iter(named))}."
        return f"These runs determine only a combination of {and_listed(list(named))}: none of them is identifiable by itself."
    if len(named) == 1:
        name = next(iter(named))
        whole = "" if name in one.temperatures else " of its value"
        return f"{name} is uncertain: its standard error is {_size(one, name, 1.0)}{whole}."
    changes = and_listed([f"{name} by {_size(one, name, share, '+')}" for name, share in named.items()])
    return f"{and_listed(list(named))} are correlated: a change of {changes} at the same time is one standard error."


def _size(one: Direction, name: str, share: float, sign: str = "") -> str:
    """One standard error of `name`, in per cent of its value or in kelvins."""
    unit, whole = ("K", KELVINS) if name in one.temperatures else ("%", 100.0)
    return f"{float(f'{whole * one.relative_error * share:.2g}'):{sign}g} {unit}"
