"""The base model refitted and nothing else: what calibration alone reaches, and what every other peer starts from."""

from __future__ import annotations

import time as clock

import numpy as np

from smajax.fit.levenberg_marquardt import Fit, Status
from studies.attribution_benchmark.peers.answer import Answer
from studies.attribution_benchmark.peers.bench import Bench


def refitted(bench: Bench, case: str) -> Answer:
    """It names nothing, and does not say whether something is missing."""
    began = clock.monotonic()
    base = bench.base()
    fit_error, held_out_error = bench.errors([base.values])[0]
    return Answer(
        "plain",
        case,
        fit_error=fit_error,
        held_out_error=held_out_error,
        seconds=clock.monotonic() - began,
        values=dict(zip(bench.fits.problem.names, base.values.tolist(), strict=True)),
    )


def fit_of(bench: Bench, base: Answer) -> Fit:
    """The fit that `refitted` reports."""
    known = base.values or {}
    cost = base.fit_error**2 * float(np.asarray(bench.fits.problem.batch.mask).sum())
    return Fit(np.asarray([known[name] for name in bench.fits.problem.names]), cost, True, Status.CONVERGED, 0)
