"""Fits of sets of effects whose evidence is compared, program by program."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Mapping, Sequence
from types import MappingProxyType
from typing import NamedTuple

import numpy as np

from smajax.attribution.joint_parameters import JointParameters
from smajax.attribution.laplace_evidence import FittedModel
from smajax.attribution.model_cache import cached_model
from smajax.core.progress import part_of
from smajax.fit.levenberg_marquardt import FitSettings, levenberg_marquardt
from smajax.fit.priors import Priors
from smajax.fit.problem import FitTask, Problem

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
WIDENED = 1.2  # times the widths of a fit's priors, from which on what ends farther off is fitted again with wider ones
MOST_WIDENED = 6  # times


class BegunFit(NamedTuple):
    """Of a set of effects."""

    effects: tuple[str, ...]
    values: np.ndarray  # (P,)
    width_factors: Mapping[str, float] = MappingProxyType({})  # of its effects' priors, in the place of the joint fit's


class EndedFit(NamedTuple):
    """Of a set of effects, in the program that carries some."""

    effects: tuple[str, ...]
    program: tuple[str, ...]
    values: np.ndarray  # (P,)
    cost: float


def fits_by_program(
    joint: JointParameters,
    groups: Sequence[tuple[tuple[str, ...], Sequence[BegunFit]]],
    error: float,
    settings: FitSettings,
) -> Iterator[EndedFit]:
    """Fits of sets of effects, by program: `groups` of (effects that it carries, the fits).

    Those of one program go side by side; the least cost so far ends what is far behind it in the next.
    """
    progress, least = settings.progress, settings.least_cost
    for place, (program, begun) in enumerate(groups):
        problem, index = joint.restricted(program)
        problem = problem.with_noise(error)
        tasks = [_task(joint, problem, index, one) for one in begun]
        own = dataclasses.replace(settings, progress=part_of(progress, place, len(groups)), least_cost=least)
        fits = levenberg_marquardt(problem, tasks, own)
        least = min([least, *(fit.cost for fit in fits)])
        for one, fit in zip(begun, fits, strict=True):
            values = np.array(one.values)
            values[index] = fit.values
            yield EndedFit(one.effects, program, values, fit.cost)


def _task(joint: JointParameters, problem: Problem, index: np.ndarray, begun: BegunFit) -> FitTask:
    task = problem.task(joint.free(begun.effects), joint.bounds, begun.values[index])
    if not begun.width_factors:
        return task
    own = dataclasses.replace(joint, width_factors={**joint.width_factors, **begun.width_factors})
    return task._replace(priors=Priors.of(problem.names, own.prior_records(begun.effects)))


def models_by_program(
    joint: JointParameters,
    groups: Sequence[tuple[tuple[str, ...], Sequence[BegunFit]]],
    error: float,
    settings: FitSettings,
    most_widened: int = MOST_WIDENED,
) -> Iterator[FittedModel]:
    """The models that fits of sets of effects end at, as `fits_by_program`; of several fits of one set that of the least cost.

    An effect that ends farther off than its priors are wide is fitted again with the widths that are likeliest there (`width_factor`), until they
    are wide enough, `most_widened` times at most; each time the model comes as well. Where much is left a sample says little, and priors of the usual
    width would hold an effect that is far larger than usual next to nothing, so that others took its place.
    """
    for number in range(1 + most_widened):
        least: dict[tuple[str, ...], EndedFit] = {}
        for fit in fits_by_program(joint, groups, error, settings):
            if np.isfinite(fit.cost) and (fit.effects not in least or fit.cost < least[fit.effects].cost):
                least[fit.effects] = fit
        used = {one.effects: {**joint.width_factors, **one.width_factors} for _, begun in groups for one in begun}
        wider: dict[tuple[str, ...], list[BegunFit]] = {}
        for effects, fit in least.items():
            # Coefficients of other effects count for nothing in this model.
            model = cached_model(joint, effects, joint.without(fit.values, effects), fit.program, settings.cache)
            yield model
            if any(model.width_factors[one] > WIDENED * used[effects].get(one, 1.0) for one in effects):
                wider.setdefault(fit.program, []).append(BegunFit(effects, model.values, model.width_factors))
        if not wider or number == most_widened:
            return
        groups = list(wider.items())
        settings = dataclasses.replace(
            settings, least_cost=min([settings.least_cost, *(one.cost for one in least.values())])
        )


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
