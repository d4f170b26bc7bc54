"""Which compiled program a set of effects is fitted in: one that it shares with few others.

A program that carries the effects of many sets is compiled once, but every run of it computes all of them. Dead-weight bench of
the demo, two cores, seconds to compile and milliseconds a run with one direction of the derivative:

| effects carried | compile | a run |
|---|---|---|
| none | 1.5 | 0.26 |
| 2 | 2.2 | 0.7 |
| about 20 | 17 | 2.4 |
| about 22, a friction that sticks among them | 24 | 8.6 |

So sets share a program while it carries few effects, and those whose load may stick and jump have one for themselves.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from smajax.model.effects.library import LIBRARY

Effects = tuple[str, ...]

MOST_SHARED = 4  # effects beside those of the smallest set that a shared program carries


def grouped(sets: Iterable[Effects], compiled: Sequence[Effects]) -> list[tuple[frozenset[str], list[Effects]]]:
    """(effects carried, the sets fitted there), each of `sets` once, in their order; programs `compiled` before are used again."""
    groups: list[tuple[frozenset[str], list[Effects]]] = []
    known = [frozenset(one) for one in compiled]
    for effects in dict.fromkeys(sets):
        needed = frozenset(effects)
        fitting = [one for one in known if needed <= one and _cheap(needed, one)]
        if fitting:
            _add(groups, min(fitting, key=len), effects)
            continue
        for place, (program, its_sets) in enumerate(groups):
            union = program | needed
            if program not in known and all(_cheap(frozenset(one), union) for one in (*its_sets, effects)):
                groups[place] = (union, [*its_sets, effects])
                break
        else:
            groups.append((needed, [effects]))
    return groups


def _add(groups: list[tuple[frozenset[str], list[Effects]]], program: frozenset[str], effects: Effects) -> None:
    for one, its_sets in groups:
        if one == program:
            its_sets.append(effects)
            return
    groups.append((program, [effects]))


def _cheap(needed: frozenset[str], program: frozenset[str]) -> bool:
    """Whether a set may be fitted in a program that carries so many more effects."""
    more = program - needed
    return len(more) <= MOST_SHARED and not any(LIBRARY[effect].candidate.stick_slip for effect in more)
