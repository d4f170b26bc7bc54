"""Which compiled program a set of effects is fitted in: one that it shares with others, where that takes less time in all.

A program that carries the effects of many sets is compiled once, but every run of it computes all of them. Bias-spring bench, three runs
of 700 samples, two cores: seconds to compile, and milliseconds for all runs with four directions of the derivative.

| effects carried | compile | runs |
|---|---|---|
| none | 0.45 | 0.36 |
| one of most | 0.5 | 0.35 to 0.44 |
| a friction that sticks | 0.55 | 0.48 |
| a shape of the transformation | 0.7 | 0.49 to 0.76 |
| all five shapes | 1.4 | 1.43 |
| 7, a shape among them | 1.0 | 1.1 |
| 12, a shape among them | 1.2 | 1.25 |

So sets share a program while it carries few effects that they do not have, the fewer the longer the runs.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Sequence
from dataclasses import dataclass

from smajax.attribution.exclusive_effects import of_groups
from smajax.fit.problem import Problem
from smajax.model.effects.library import LIBRARY

Effects = tuple[str, ...]

# Seconds: of fits of one set without effects, for each sample of all runs, and of compiling a program without effects.
FITTING, COMPILING = 5e-5, 0.45
# Of effects that a program carries: shares of the time of a run without effects, and seconds of compiling.
SHAPE, STICKING, OTHER = (0.75, 0.2), (0.35, 0.1), (0.1, 0.04)


@dataclass
class _Group:
    """Sets that share a program, and whether it is compiled already."""

    program: frozenset[str]
    sets: list[Effects]
    compiled: bool


def grouped(
    sets: Iterable[Effects], compiled: Sequence[Effects], samples: int
) -> list[tuple[frozenset[str], list[Effects]]]:
    """(effects carried, the sets fitted there), each of `sets` once, in their order; programs `compiled` before are used again. `samples` of all runs."""
    groups = [_Group(frozenset(one), [], True) for one in compiled]
    for effects in dict.fromkeys(sets):
        alone = _Group(frozenset(effects), [], False)
        best = min([*groups, alone], key=lambda group: (_more(group, effects, samples), len(group.program)))
        if best is alone:
            groups.append(best)
        best.program, best.sets = best.program | set(effects), [*best.sets, effects]
    return [(group.program, group.sets) for group in groups if group.sets]


def _more(group: _Group, effects: Effects, samples: int) -> float:
    """Seconds that it takes to fit a set of effects in a group's program, beyond those of fitting it in one of its own that is compiled."""
    together = group.program | set(effects)
    if group.compiled:
        return samples * FITTING * (_run(together) - _run(effects)) if together == group.program else float("inf")
    slower = len(group.sets) * (_run(together) - _run(group.program)) + _run(together) - _run(effects)
    before = _compile(group.program) if group.sets else 0.0
    return samples * FITTING * slower + _compile(together) - before


def _run(effects: Collection[str]) -> float:
    """Time of a run of a program that carries these, over that of one without effects."""
    return 1.0 + sum(_kind(effect)[0] for effect in effects)


def _compile(effects: Collection[str]) -> float:
    """Seconds to compile a program that carries these."""
    return COMPILING + sum(_kind(effect)[1] for effect in effects)


def _kind(effect: str) -> tuple[float, float]:
    if of_groups((effect,)):
        return SHAPE
    return STICKING if LIBRARY[effect].candidate.stick_slip else OTHER


def compiled_for(effects: Effects, compiled: Sequence[Effects], samples: int) -> Effects:
    """The program in which one set of effects is fitted, or its linear model taken: of those `compiled`, or its own where that takes less time. `samples` of all runs."""
    ((program, _),) = grouped([effects], compiled, samples)
    return next((one for one in compiled if frozenset(one) == program), effects)


def samples_of(problem: Problem) -> int:
    """Of all runs."""
    return problem.batch.runs * problem.measured.shape[-1]
