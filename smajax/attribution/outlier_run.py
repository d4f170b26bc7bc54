"""An outlier run: a fit run that does not agree with the others: without it a model leaves nothing but noise in them.

It may not belong there (another wire, another day, the readings of another run, an input that was not as logged), or it
alone shows what the model lacks; the runs cannot say which. Values of presets are free in these fits, within their priors
against the noise: the fit to all runs has them where the wrong run drew them. Asked only where more than noise is left when
the search has ended, so an effect of the library that accounts for all runs goes before.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from smajax.attribution.model_fits import Model, Search, Start
from smajax.attribution.record_error import OutlierRun
from smajax.fit.levenberg_marquardt import Fit
from smajax.fit.outputs_of_runs import misfits

LEAVING_OUT = "leaving out each run for good"
SETTLED = 0.02  # of what one sample adds to the cost
FIRST = 1e-3  # relative decrease at which the first fits end: they only tell which come near noise or halve an error, and those go on


def outlier_runs(setting: Search, model: Model, names: Sequence[str]) -> tuple[OutlierRun, ...]:
    """The fit runs without any one of which `model`, fitted anew, leaves noise in all the others; most influential first.

    Where there is none, the one run without which the error on the others falls by `influential_ratio`, if any. `names` of the fit runs, in their order. Fits begin at the
    fit to all runs, which a wrong run may have drawn into a local minimum of its own, and at the experiment's start values.
    """
    problem, config = setting.problem, setting.config
    runs = problem.batch.runs
    if runs < config.outlier_least_runs:
        return ()
    mask = np.asarray(problem.batch.mask)
    own, index = setting.restricted(model.effects)
    (whole,) = misfits(own, [model.values[index]])
    worst = np.argsort(-(own.by_run(whole) ** 2).sum(axis=1), kind="stable")[: config.outlier_most_runs]
    everyone = np.arange(runs)
    places = [setting.inside(model)]
    if not model.effects:
        places.append(problem.start_values())
    starts = [Start(model.effects, place, (everyone != run).astype(float)) for run in worst for place in places]
    stage = LEAVING_OUT
    settled = SETTLED * float((whole**2).sum() / mask.sum()) / float(problem.noise_sigma) ** 2
    factors = model.width_factors
    fits, found = setting.fit(starts, stage, enough=FIRST, settled=settled, presets=True, width_factors=factors)
    near = [k for k, start in enumerate(starts) if _near(setting, found[k], start, whole)]
    if near:
        aimed = [_aimed(setting, starts[k], fits[k], whole) for k in near]
        again, misfit = setting.fit(aimed, stage, settled=settled, hops=True, presets=True, width_factors=factors)
        for k, fit, one in zip(near, again, misfit, strict=True):
            fits[k], found[k] = fit, one
    outliers = []
    for first, run in zip(range(0, len(starts), len(places)), worst, strict=True):
        best = min(range(first, first + len(places)), key=lambda k: fits[k].cost)
        left, others = found[best], own.owner != run
        outliers.append(
            OutlierRun(
                names[run],
                model.effects,
                setting.all_noise(left[others], mask[others]),
                _rms(whole[others], mask[others]),
                _rms(left[others], mask[others]),
                _rms(left[~others], mask[~others]),
            )
        )
    outliers.sort(key=lambda one: one.others_without / one.others_with)
    noise = tuple(one for one in outliers if one.residual_is_noise)
    influential = (
        runs >= config.influential_least_runs
        and outliers[0].others_without * config.influential_ratio < outliers[0].others_with
    )
    return noise or (outliers[0],) * influential


def _aimed(setting: Search, start: Start, ended: Fit, whole: np.ndarray) -> Start:
    """Once more from where a fit has ended; one that comes neither to noise nor to an influential run's fall of the error says nothing."""
    config, noise = setting.config, float(setting.problem.noise_sigma)
    _, mask, fallen = _others(setting, start, whole)
    # Of a noise that was estimated a larger residual may still be noise, where neighbouring samples are alike.
    white = config.white_noise_ratio * noise * (1.0 if setting.noise_given else config.outlier_reach)
    return replace(start, values=ended.values, goal=float(mask.sum()) * (max(white, fallen) / noise) ** 2)


def _near(setting: Search, left: np.ndarray, start: Start, whole: np.ndarray) -> bool:
    """Whether a fit is within `outlier_reach` of noise in the runs that it has, or of an influential run's fall of their error."""
    config = setting.config
    others, mask, fallen = _others(setting, start, whole)
    error = _rms(left[others], mask) / config.outlier_reach
    return error < max(fallen, config.white_noise_ratio * float(setting.problem.noise_sigma))


def _others(setting: Search, start: Start, whole: np.ndarray) -> tuple[np.ndarray, np.ndarray, float]:
    """Of a fit without a run: (which series it has, their mask, the error on them without an influential run, SI; 0 of too few runs to call one so)."""
    config = setting.config
    assert start.weights is not None
    others = start.weights[setting.problem.owner] > 0.0
    mask = np.asarray(setting.problem.batch.mask)[others]
    enough = len(start.weights) >= config.influential_least_runs
    return others, mask, _rms(whole[others], mask) / config.influential_ratio if enough else 0.0


def _rms(misfit: np.ndarray, mask: np.ndarray) -> float:
    return float(np.sqrt((misfit**2).sum() / mask.sum()))
