r"""Whether one model predicts runs better than another, beyond chance: their squared errors sample by sample.

$d_i = r_i^2 - r_{0,i}^2$ of the residuals $r$ and $r_0$ of both at the same sample; what is common to both, the noise and what neither has,
falls out of most of it. Neighbouring samples are off together, so that the mean of $n$ of them has the standard error of $n / \tau$
independent ones, $\tau$ the correlation time of $d$ (Diebold & Mariano 1995).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal

import numpy as np

from smajax.attribution.config import AttributionConfig
from smajax.core.whiteness import correlation_time

Comparison = Literal["better", "worse", "alike"]


def compared(new: Sequence[np.ndarray], old: Sequence[np.ndarray], config: AttributionConfig) -> Comparison:
    """How `new` predicts beside `old`; both are residuals of each run (n,), of the same samples.

    "alike" where the difference is `held_out_errors` standard errors or less, or the root mean squares differ by no more than
    `held_out_tolerance`. A factor of `held_out_factor` counts whatever the standard error: of runs that drift apart no
    correlation time can be told.
    """
    squares = [mine**2 - theirs**2 for mine, theirs in zip(new, old, strict=True)]
    every = np.concatenate([np.zeros(0), *squares])
    if not every.any():
        return "alike"
    mean = float(every.mean())
    ratio = float(np.sqrt(sum(map(_sum_of_squares, new)) / sum(map(_sum_of_squares, old))))
    difference = max(ratio, 1.0 / ratio)
    error = float(every.std()) * np.sqrt(correlation_time([one - mean for one in squares]) / every.size)
    told = abs(mean) > config.held_out_errors * error or difference > config.held_out_factor
    if not told or difference <= 1.0 + config.held_out_tolerance:
        return "alike"
    return "worse" if mean > 0.0 else "better"


def _sum_of_squares(residual: np.ndarray) -> float:
    return float(np.sum(residual**2))
