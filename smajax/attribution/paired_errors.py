r"""Whether one model predicts runs better than another, beyond chance: how much of the change of the prediction would better be taken back.

Residuals $r$ of the new model and $r_0$ of the old one differ by the change of the prediction, $c = r - r_0$. Of
$r = \lambda c + e$ the share $\lambda$ is 0 where the new model is right and 1 where the old one is; beyond one half the old
one is nearer (a test of forecast encompassing; Harvey, Leybourne & Newbold 1998). Its standard error is that of the
scores $e c$: neighbouring samples go together, so that $n$ of them count as $n / \tau$, $\tau$ their correlation time; of
several runs it is no smaller than what the runs' sums scatter by. Student's t, of so many independent samples or runs, says what
chance may make. One run speaks for itself alone: how much runs differ from one another it cannot say.

Where the residual is a drift that the change makes or takes away, the difference of the squares drifts too and has no correlation
time; what is left, $e$, does not.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal

import numpy as np
import scipy  # its parts are imported when they are first used

from smajax.attribution.config import AttributionConfig
from smajax.attribution.findings import RunFinding
from smajax.core.whiteness import correlation_time

Comparison = Literal["better", "worse", "alike"]
LEAST_FREEDOM = 2.0  # degrees of freedom of two runs: with one, Student's t asks for 14 standard errors


def compared(
    new: Sequence[np.ndarray],
    old: Sequence[np.ndarray],
    config: AttributionConfig,
    owners: Sequence[int] | None = None,
) -> Comparison:
    """How `new` predicts beside `old`; both are residuals of each run (n,), of the same samples.

    `owners`: of which run each is, where several are of one, as its outputs are; these go together.

    "alike" where the difference may be chance (`held_out_errors` standard errors of a normal distribution), or the root mean squares differ by
    no more than `held_out_tolerance`. A model without a number is worse than one with.
    """
    if not (new and old):
        return "alike"
    finite, finite_before = (all(bool(np.isfinite(one).all()) for one in runs) for runs in (new, old))
    if not (finite and finite_before):
        return "alike" if finite == finite_before else ("better" if finite else "worse")
    changes = [mine - theirs for mine, theirs in zip(new, old, strict=True)]
    total = _squares(changes)
    more, less = (np.sqrt(_squares(runs)) for runs in (new, old))
    if total == 0.0 or abs(more - less) <= config.held_out_tolerance * min(more, less):
        return "alike"
    share = sum(float(mine @ change) for mine, change in zip(new, changes, strict=True)) / total
    scores = [(mine - share * change) * change for mine, change in zip(new, changes, strict=True)]
    if abs(share - 0.5) <= _by_chance(scores, config.held_out_errors, owners) / total:
        return "alike"
    return "worse" if share > 0.5 else "better"


def runs_compared(
    new: Sequence[RunFinding], old: Sequence[RunFinding], which: Literal["before", "after"], config: AttributionConfig
) -> Comparison:
    """How the extended model of `new` predicts these runs beside the model `which` of `old`, the same runs."""
    mine, theirs = [run.residuals("after") for run in new], [run.residuals(which) for run in old]
    owners = [number for number, series in enumerate(mine) for _ in series]
    return compared([one for run in mine for one in run], [one for run in theirs for one in run], config, owners)


def pooled_rms(runs: Sequence[np.ndarray]) -> float:
    """Root mean square of the residuals of runs (n,), of all samples alike."""
    return float(np.sqrt(np.mean(np.concatenate(list(runs)) ** 2)))


def _by_chance(scores: Sequence[np.ndarray], errors: float, owners: Sequence[int] | None) -> float:
    """What the sum of the scores (n,) of runs may be off by: so many standard errors, were it normal."""
    by_run: dict[int, list[np.ndarray]] = {}
    for run, score in zip(range(len(scores)) if owners is None else owners, scores, strict=True):
        by_run.setdefault(run, []).append(score)
    quantile, time = scipy.stats.norm.cdf(errors), correlation_time(scores)
    # Of one run the outputs go together as far as can be: their sizes add up, and they are no further samples.
    count = sum(max(map(len, outputs)) for outputs in by_run.values())
    sizes = np.asarray([sum(float(np.linalg.norm(one)) for one in outputs) for outputs in by_run.values()])
    sums = np.asarray([sum(float(one.sum()) for one in outputs) for outputs in by_run.values()])
    within = np.sqrt(float(sizes @ sizes) * time) * scipy.stats.t.ppf(quantile, max(count / time - 1.0, 1.0))
    if len(sums) == 1:
        return float(within)
    between = np.sqrt(len(sums) / (len(sums) - 1) * float(sums @ sums))
    return float(max(within, between * scipy.stats.t.ppf(quantile, max(len(sums) - 1.0, LEAST_FREEDOM))))


def _squares(runs: Sequence[np.ndarray]) -> float:
    return sum(float(one @ one) for one in runs)
