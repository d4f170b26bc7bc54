"""The final model as findings: parameters with their errors, effects with their evidence."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from smajax.attribution.declared_priors import NONE_DECLARED
from smajax.attribution.findings import CoefficientFinding, EffectFinding, ParameterFinding
from smajax.attribution.fit_programs import Effects
from smajax.attribution.job import Job
from smajax.attribution.joint_parameters import JointParameters
from smajax.attribution.leave_one_run_out import jackknife_error
from smajax.attribution.model_fits import Evidence, Model, Search
from smajax.attribution.nuisance_grid import scores_at
from smajax.attribution.prior_finding import PriorFinding
from smajax.core.names_of_runs import parameter_of
from smajax.core.parameters import parameter_values, parameters
from smajax.data.experiment.record import DeclaredPriors
from smajax.fit.base_model import base_model
from smajax.fit.experiment_problem import free_by_name
from smajax.fit.preset_priors import fitted_priors, preset_priors
from smajax.fit.sensitivity import Sensitivity, sensitivity
from smajax.fit.uncertainty import Uncertainty, uncertainty
from smajax.model.effects.library import LIBRARY
from smajax.model.effects.prior_width import CoefficientPrior

LEAST_RUNS = 3  # two can be left out in one way only
NORMAL_95 = 1.96


@dataclass(frozen=True)
class ParametersFound:
    parameters: tuple[ParameterFinding, ...]
    uncertainty: Uncertainty


def parameters_found(job: Job, setting: Search, model: Model, start: np.ndarray, error: float) -> ParametersFound:
    """Every free parameter of `model`, values of presets among them, with its standard error and remark.

    `error`: what an independent sample may be off by, SI, against which the priors of the presets count.
    """
    presets = setting.presets
    known_before = {**setting.of_unknowns, **presets}
    names = [*setting.free(model.effects), *presets]
    index = job.problem.names.index
    own, slots = setting.restricted(model.effects)
    priors = setting.prior_records(presets=True, effects=model.effects, width_factors=model.width_factors)
    of_effects = {name: CoefficientPrior(one.mean, one.sigma, one.logarithmic) for name, one in priors.items()}
    known_before = {**of_effects, **known_before}
    told = own.with_mean_slopes()
    problem = told.with_system(told.system, priors=priors).with_noise(error)
    at: Sensitivity = sensitivity(problem, model.values[slots], names)
    values = {name: float(model.values[index(name)]) for name in names}
    known = uncertainty(at, names, values, job.bounds)
    table = parameters(job.problem.system)
    units = {name: entry.unit for name, entry in table.items()}
    units |= {name: one.unit for name, one in free_by_name(job.experiment, job.fit_runs).items()}
    return ParametersFound(
        tuple(
            ParameterFinding(
                name,
                units[name],
                values[name],
                known.standard_error[name],
                *job.bounds[name],
                float(start[index(name)]),
                known.remarks[name],
                *_beside_prior(known_before.get(name), values[name]),
                prior_of_unknown=name in setting.of_unknowns,
            )
            for name in names
        ),
        known,
    )


def _beside_prior(prior: CoefficientPrior | None, value: float) -> tuple[float | None, float | None]:
    return (None, None) if prior is None else (prior.base, prior.deviation(value))


def effects_found(
    job: Job,
    setting: Search,
    final: Model,
    after: ParametersFound,
    looked_for: Sequence[str] | None = None,
    compiled: Sequence[Effects] = (),
    scored: bool = True,
) -> tuple[EffectFinding, ...]:
    """Every candidate with its evidence: added ones first, the strongest of them at the head, then the likeliest.

    `looked_for`: by the search; None: all. `compiled`: as of `traces_at`. `scored`: with the score of each that was not added.
    """
    left = [name for name in job.candidates if name not in final.effects] if scored else []
    last = {score.effects[0]: score for score in scores_at(setting, final, left, looked_for, compiled)} if left else {}
    fitted = {parameter.name: parameter for parameter in after.parameters}
    joint = setting.joint(final.effects)
    findings = []
    for name in job.candidates:
        effect, seen = LIBRARY[name], setting.evidence.get(name, Evidence())
        coefficients = {
            full.split(".", 1)[1]: CoefficientFinding(
                fitted[full].value,
                fitted[full].standard_error,
                fitted[full].unit,
                over_runs(final, job.problem.names.index(full), fitted[full].standard_error),
                joint.priors[full].deviation(fitted[full].value),
            )
            for full in setting.coefficients(name)
            if full in fitted
        }
        evidence = {
            "posterior_probability": seen.probability,
            "alone_rmse_fit": seen.alone_rmse,
            "score_p_value_at_the_end": last[name].p_value if name in last else float("nan"),
            "score_gain_at_the_end": last[name].gain if name in last else float("nan"),
        }
        findings.append(
            EffectFinding(
                name,
                effect.candidate.title,
                effect.candidate.equation,
                effect.candidate.formula,
                name in final.effects,
                coefficients,
                evidence,
            )
        )

    def strength(one: EffectFinding) -> tuple[bool, float, float]:
        alone = one.evidence["alone_rmse_fit"] if one.added else np.nan
        likely = float(np.nan_to_num(one.evidence["posterior_probability"]))
        return not one.added, float(np.nan_to_num(alone, nan=np.inf)), -likely

    return tuple(sorted(findings, key=strength))


def over_runs(model: Model, place: int, error: float | None) -> tuple[float, float] | None:
    """95 % of a parameter by the jackknife over runs, where it is wide enough to mean something.

    None for fewer than `LEAST_RUNS` parts. Where it is narrower than the standard error either way, the prior or a bound holds
    the value there, and not the runs.
    """
    found = model.left_out_values
    if error is None or found is None or len(found) < LEAST_RUNS:
        return None
    half = NORMAL_95 * float(jackknife_error(found[:, [place]])[0])
    return None if half < error else (float(model.values[place]) - half, float(model.values[place]) + half)


def priors_found(job: Job, setting: Search) -> tuple[PriorFinding, ...]:
    """The priors that the experiment file gives, of effects that are candidates, of the presets and of unknowns, as they were used."""
    declared, table = setting.declared, parameters(job.problem.system)
    named = {*declared.odds, *(name.split(".", 1)[0] for name in declared.coefficients)}
    effects = [name for name in setting.candidates if name in named]

    def joint(priors: DeclaredPriors) -> JointParameters:
        return JointParameters.of(
            setting.problem, (), setting.bounds, effects, setting.extent, job.presets, declared=priors
        )

    ours, library = joint(declared), joint(NONE_DECLARED)
    findings = [
        PriorFinding(name, odds=declared.odds[name], library_odds=float(np.exp(library.log_odds[name])))
        for name in effects
        if name in declared.odds
    ]
    model = base_model(replace(job.experiment, priors=NONE_DECLARED))
    held_or_free = preset_priors(parameters(model), parameter_values(model), frozenset())
    if job.experiment.model_file is not None:
        held_or_free |= fitted_priors(job.experiment.model_file, frozenset())
    before = {**library.priors, **{name: held_or_free.get(name) for name in declared.presets}}
    for name in (*declared.coefficients, *declared.presets):
        if name not in ours.priors:
            continue
        used, own = ours.priors[name], before[name]
        stands = () if own is None else (own.base, own.sigma, own.logarithmic)
        findings.append(
            PriorFinding(name, table[name].unit, None, used.base, used.sigma, used.logarithmic, None, *stands)
        )
    # A value of each run's own has one prior.
    of_unknowns = {parameter_of(name): one for name, one in setting.of_unknowns.items()}
    findings += [
        PriorFinding(name, table[name].unit, None, one.base, one.sigma, one.logarithmic, of_unknown=True)
        for name, one in of_unknowns.items()
        if name in table
    ]
    return tuple(findings)
