r"""Prediction by the average of the likely models, with a band in which nine of ten measured samples are expected, on average over runs like the fit's.

Every run is predicted by each model whose posterior probability is at least `LEAST_PROBABILITY`, and the predictions are
averaged with these probabilities (Hoeting et al. 1999). The half-width of the band is

$$\sqrt{z^2 (\mathrm{var}_\theta + \mathrm{var}_M) + q^2},$$

the variance by the parameters' posterior, $J \Sigma J^T$ of each model, that between the models, and what all of them miss: $q$
is the share `BAND` of the absolute errors on runs left out (Lei et al. 2018; Barber et al. 2021), which has the noise, the
discrepancy, and how well the bench repeats itself.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from smajax.attribution.findings import AveragedModel, AveragedRun, DroppedModel
from smajax.attribution.joint_search import JointSearch
from smajax.attribution.laplace_evidence import FittedModel
from smajax.attribution.likely_models_check import checked
from smajax.attribution.model_fits import Model, Search
from smajax.fit.packed_runs import RunBatch
from smajax.fit.prediction_band import BAND, averaged_band, reading_of
from smajax.fit.problem import Problem

LEAST_PROBABILITY = 0.02
MOST_MODELS = 6


@dataclass(frozen=True)
class Averaged:
    """The models that were averaged, and every run by their average."""

    models: tuple[AveragedModel, ...] = ()
    runs: tuple[AveragedRun, ...] = ()
    dropped: tuple[DroppedModel, ...] = ()


def likely_models(search: JointSearch, final: Model) -> list[tuple[FittedModel, float]]:
    """(model, weight): those of the search with a probability that counts, where `final` is the likeliest; else `final` alone."""
    own = search.joint.ordered(final.effects)
    probability = search.probabilities(search.error_of(own))
    ranked = sorted(probability, key=lambda effects: -probability[effects])[:MOST_MODELS]
    # What held-out runs or an unknown term reject is not averaged with.
    chosen = [one for one in ranked if probability[one] >= LEAST_PROBABILITY or one == own]
    if own != search.winner or own not in chosen:
        chosen = [own]
    total = sum(probability[one] for one in chosen)
    return [(search.fitted[one], probability[one] / total) for one in chosen]


def averaged(
    setting: Search, search: JointSearch, final: Model, batch: RunBatch, base: Model | None = None
) -> Averaged:
    """Every run of `batch`, held-out ones included, by the average of the likely models. Of one output, as the search.

    With the `base` model those that carry weight are checked as the final model was (`likely_models_check`).
    """
    models = likely_models(search, final)
    dropped: tuple[DroppedModel, ...] = ()
    if base is not None:
        models, dropped = checked(setting, search, base, final, models)
    problem, index = setting.restricted([effect for model, _ in models for effect in model.effects])
    problem = Problem.build(problem.system, batch, problem.noise_sigma, problem.offset)
    own = search.joint.ordered(final.effects)
    readings, variances = [], []
    for model, _ in models:
        values = (final if model.effects == own else model).values[index]
        covariance = model.covariance(search.error(model) ** 2)
        found = reading_of(problem, values, model.names, model.scales, covariance)
        readings.append(found.reading)
        variances.append(found.variance)
    weights = np.asarray([weight for _, weight in models])
    mean, half = averaged_band(np.stack(readings), np.stack(variances), weights, prediction_error(setting, final))
    return Averaged(
        tuple(AveragedModel(model.effects, weight) for model, weight in models),
        tuple(_run(*one) for one in zip(problem.measured, mean, half, np.asarray(batch.mask) > 0, strict=True)),
        dropped,
    )


def prediction_error(setting: Search, final: Model) -> float:
    """The absolute error that the share `BAND` of the samples of runs left out stays below, SI."""
    mask = np.asarray(setting.problem.batch.mask) > 0
    return float(np.quantile(np.abs(final.left_out[mask]), BAND))


def _run(measured: np.ndarray, reading: np.ndarray, half: np.ndarray, present: np.ndarray) -> AveragedRun:
    error = (measured - reading)[present]
    return AveragedRun(
        reading[present],
        half[present],
        float(np.sqrt(np.mean(error**2))),
        float(np.mean(np.abs(error) <= half[present])),
    )
