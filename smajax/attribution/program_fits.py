"""Fits of sets of effects whose evidence is compared, program by program."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from smajax.attribution.joint_parameters import JointParameters
from smajax.core.progress import part_of
from smajax.fit.levenberg_marquardt import FitSettings, levenberg_marquardt

STEPS = 30  # of a fit whose evidence is compared
SETTLED_COST = 0.02  # a hundredth in log evidence, by which a step of such a fit may still lower the cost
ALLOWED_EXCESS = (
    (4, 400.0),
    (8, 200.0),
    (14, 100.0),
)  # after so many steps fits end whose cost is so far above the least
# Far behind by what is still to come: 15 nats, which no smaller number of parameters makes up for.
PROMISED_EXCESS = (4, 30.0)
ONE_OF_EACH = 4  # steps, after which of the fits of one set from two places the better one alone goes on


class EndedFit(NamedTuple):
    """Of a set of effects, in the program that carries some."""

    effects: tuple[str, ...]
    program: tuple[str, ...]
    values: np.ndarray  # (P,)
    cost: float


def fits_by_program(
    joint: JointParameters,
    groups: Sequence[tuple[tuple[str, ...], Sequence[tuple[tuple[str, ...], np.ndarray]]]],
    error: float,
    settings: FitSettings,
) -> Iterator[EndedFit]:
    """Fits of sets of effects, by program: `groups` of (effects that it carries, (set, values (P,) that its fit begins with) each).

    Those of one program go side by side; the least cost so far ends what is far behind it in the next.
    """
    progress, least = settings.progress, settings.least_cost
    for place, (program, begun) in enumerate(groups):
        problem, index = joint.restricted(program)
        problem = problem.with_noise(error)
        tasks = [problem.task(joint.free(effects), joint.bounds, values[index]) for effects, values in begun]
        own = dataclasses.replace(settings, progress=part_of(progress, place, len(groups)), least_cost=least)
        fits = levenberg_marquardt(problem, tasks, own)
        least = min([least, *(fit.cost for fit in fits)])
        for (effects, start), fit in zip(begun, fits, strict=True):
            values = np.array(start)
            values[index] = fit.values
            yield EndedFit(effects, program, values, fit.cost)


def comparison_settings(settings: FitSettings, stage: str) -> FitSettings:
    """Of fits whose evidence is compared: those that fall far behind end early."""
    return dataclasses.replace(
        settings,
        max_steps=STEPS,
        absolute_tolerance=SETTLED_COST,
        allowed_excess=ALLOWED_EXCESS,
        promised_excess=PROMISED_EXCESS,
        one_of_each=ONE_OF_EACH,
        stage=stage,
    )
