r"""Prediction by the average of the likely models, with a band in which nine of ten measured samples are expected, on average over runs like the fit's.

Every run is predicted by each model whose posterior probability is at least `LEAST_PROBABILITY`, and the predictions are
averaged with these probabilities (Hoeting et al. 1999). The half-width of the band is

$$\sqrt{z^2 (\mathrm{var}_\theta + \mathrm{var}_M) + q^2},$$

the variance by the parameters' posterior, $J \Sigma J^T$ of each model, that between the models, and what all of them miss: $q$
is the share `BAND` of the absolute errors on runs left out (Lei et al. 2018; Barber et al. 2021), which has the noise, the
discrepancy, and how well the bench repeats itself.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from smajax.attribution.findings import AveragedModel, AveragedRun, DroppedModel, RunFinding
from smajax.attribution.fitted_sets import JointSearch
from smajax.attribution.laplace_evidence import FittedModel
from smajax.attribution.likely_models_check import checked
from smajax.attribution.model_fits import Model, Search
from smajax.attribution.values_per_run import on_runs, with_other_runs
from smajax.fit.packed_runs import RunBatch
from smajax.fit.prediction_band import BAND, averaged_band, in_band, reading_of

LEAST_PROBABILITY = 0.02
MOST_MODELS = 6


@dataclass(frozen=True)
class Averaged:
    """The models that were averaged, and every run by their average."""

    models: tuple[AveragedModel, ...] = ()
    runs: tuple[AveragedRun, ...] = ()  # of every series: the outputs of the first run, and so on
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
    setting: Search,
    search: JointSearch,
    final: Model,
    batch: RunBatch,
    base: Model | None = None,
    samples: Mapping[str, int] | None = None,
) -> Averaged:
    """Every run of `batch`, held-out ones included, by the average of the likely models.

    `samples` of each run on the clock, by its name; None: as many as are measured, of runs without values of their own.

    With the `base` model those that carry weight are checked as the final model was (`likely_models_check`).
    """
    models = likely_models(search, final)
    dropped: tuple[DroppedModel, ...] = ()
    if base is not None:
        models, dropped = checked(setting, search, base, final, models)
    own = search.joint.ordered(final.effects)
    effects = [effect for model, _ in models for effect in model.effects]
    each = [(final if model.effects == own else model).values for model, _ in models]
    problem, points = on_runs(setting, effects, each, batch, list(samples or ()))
    readings, variances = [], []
    for (model, _), values in zip(models, points, strict=True):
        error = search.error(model)
        posterior = model.names, model.scales, model.covariance(error**2)
        found = reading_of(problem, values, *with_other_runs(setting, problem, values, posterior, error))
        readings.append(found.reading)
        variances.append(found.variance)
    weights = np.asarray([weight for _, weight in models])
    missed = np.tile(prediction_errors(setting, final), batch.runs)[:, None]
    mean, half = averaged_band(np.stack(readings), np.stack(variances), weights, missed)
    mask = np.asarray(batch.mask) > 0
    noise = (float(setting.problem.noise_sigma) / problem.scale_of_series[:, 0]).tolist()
    counts = mask.sum(axis=1) if samples is None else np.asarray(list(samples.values()))[problem.owner]
    return Averaged(
        tuple(AveragedModel(model.effects, weight) for model, weight in models),
        tuple(_run(*one) for one in zip(problem.measured, mean, half, mask, counts.tolist(), noise, strict=True)),
        dropped,
    )


def with_averages(runs: Sequence[RunFinding], found: Sequence[AveragedRun]) -> tuple[RunFinding, ...]:
    """`runs` with what the average says of each of their outputs."""
    each = iter(found)
    return tuple(
        dataclasses.replace(
            run, average=next(each), others=tuple(dataclasses.replace(one, average=next(each)) for one in run.others)
        )
        for run in runs
    )


def prediction_errors(setting: Search, final: Model) -> list[float]:
    """The absolute error that the share `BAND` of the samples of runs left out stays below, of each output, SI."""
    problem = setting.problem
    mask, outputs = np.asarray(problem.batch.mask) > 0, len(problem.batch.outputs)
    missed = np.abs(final.left_out) / problem.scale_of_series
    return [float(np.quantile(missed[k::outputs][mask[k::outputs]], BAND)) for k in range(outputs)]


def _run(  # a series of the problem, field by field
    measured: np.ndarray, reading: np.ndarray, half: np.ndarray, present: np.ndarray, samples: int, noise: float
) -> AveragedRun:
    error = (measured - reading)[present]
    share = in_band(np.where(present, measured, np.nan), reading, half, noise)
    return AveragedRun(
        reading[:samples],
        half[:samples],
        float(np.sqrt(np.mean(error**2))) if error.size else float("nan"),
        share.whole,
        error.size,
        share.moving,
        share.samples_moving,
    )
