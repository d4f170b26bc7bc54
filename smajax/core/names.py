"""Messages about unknown names: close matches, and the list of all names or the command that lists them."""

from __future__ import annotations

import re
from collections.abc import Iterable
from difflib import SequenceMatcher

# Above the first, two spellings differ by a slip; below the second, they have letters in common and no more.
SLIP = 0.85
ALIKE = 0.65
MOST = 3  # names that are suggested together
# A shorter word is inside too many names by chance.
SHORTEST_WORD = 3


def _core(name: str) -> str:
    """The name without its unit in brackets, its case and its punctuation, which say nothing about likeness."""
    bare = re.sub(r"\[[^]]*\]|\([^)]*\)", "", name)
    return re.sub(r"[\W_]+", "_", bare if bare.strip() else name).strip("_").lower()


def _likeness(name: str, candidate: str) -> tuple[int, float, float]:
    """How near the candidate is, greater is nearer; the first number is 0 when it is not worth suggesting."""
    one, other = _core(name), _core(candidate)
    ratio = SequenceMatcher(None, one, other).ratio()
    whole = SequenceMatcher(None, name.lower(), candidate.lower()).ratio()
    inside, around = (len(part) >= SHORTEST_WORD and part in full for part, full in ((one, other), (other, one)))
    if one == other:
        rank = 4
    elif ratio >= SLIP:
        rank = 3
    elif inside:
        rank = 2
    else:
        rank = 1 if around or ratio >= ALIKE else 0
    return rank, ratio, whole


def nearest(name: str, known: Iterable[str]) -> str:
    """A sentence part that suggests the known name closest to `name`; empty when none is close.

    A name that contains the word goes before one that only shares letters with it: "friction" is "coulomb_friction"
    and not "radiation".
    """
    names = [str(one) for one in known]
    best = max(names, key=lambda one: _likeness(name, one), default="")
    return f"; did you mean {best!r}?" if best and _likeness(name, best)[0] > 0 else ""


def close_matches(name: str, known: Iterable[str], lead: str, suggested: Iterable[str] | None = None) -> str:
    """`; did you mean 'x'? There are: x, y` with the lead "there are"; `; there are: x, y` when no name is close.

    suggested: the names that may be suggested, when these are not all that are known.
    """
    names = [str(one) for one in known]
    guess = nearest(name, names if suggested is None else suggested)
    return f"{guess} {lead[:1].upper()}{lead[1:]}: {listed(names)}" if guess else f"; {lead}: {listed(names)}"


def of_many(name: str, known: Iterable[str], lists: str) -> str:
    """`; did you mean 'x', 'y' or 'z'? LISTS` for a name of which there are too many to list; `; LISTS` when none is close.

    Up to `MOST` names, all as near as the nearest in kind; the model's own before those of effects. lists: what lists all.
    """
    ranked = [(_likeness(name, one), one) for one in own_first(map(str, known))]
    best = max((likeness[0] for likeness, _ in ranked), default=0)
    near = sorted((one for one in ranked if 0 < one[0][0] == best), key=lambda one: one[0], reverse=True)
    *others, last = [repr(one) for _, one in near[:MOST]] or [""]
    if not last:
        return f"; {lists}"
    return f"; did you mean {', '.join(others)}{' or ' if others else ''}{last}? {lists[:1].upper()}{lists[1:]}"


def own_first(names: Iterable[str]) -> list[str]:
    """By the alphabet, what belongs to an effect (`latent_heat.enthalpy`) after the model's own."""
    return sorted(names, key=lambda name: ("." in name, name))


def listed(names: Iterable[str]) -> str:
    """The names in one line, all of them: it may be the only list that its reader has."""
    return ", ".join(str(name) for name in names) or "none"
