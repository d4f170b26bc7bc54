"""Jacobian of the misfit by the parameters: the one behind the check, the screening and the standard errors."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from smajax.fit.outputs_of_runs import predicted_and_derivatives
from smajax.fit.problem import Problem


@dataclass(frozen=True)
class Sensitivity:
    """At one point: the misfit (series, N) and its derivative by each of `names` (series, N, A), both over the noise.

    priors: the derivative of the priors' residuals (K, A); None without priors. predicted: sensor outputs there
    (series, N), SI, without offsets.
    """

    names: tuple[str, ...]
    misfit: np.ndarray
    jacobian: np.ndarray
    mask: np.ndarray  # (series, N)
    priors: np.ndarray | None = None
    predicted: np.ndarray | None = None

    def columns(self, names: Sequence[str]) -> np.ndarray:
        """Jacobian columns of `names` on the measured samples, shape (samples, len(names))."""
        return self.jacobian[..., self._index(names)][self.mask > 0]

    def prior_columns(self, names: Sequence[str]) -> np.ndarray:
        """Of `names`, the rows of the priors of one of them, shape (rows, len(names))."""
        if self.priors is None:
            return np.zeros((0, len(names)))
        picked = self.priors[:, self._index(names)]
        return picked[np.any(picked != 0.0, axis=1)]

    def of_series(self, series: Sequence[int], samples: int) -> Sensitivity:
        """The same of some series only, their first `samples`."""
        rows = np.asarray(series, dtype=int)
        misfit, jacobian, mask = (part[rows, :samples] for part in (self.misfit, self.jacobian, self.mask))
        predicted = None if self.predicted is None else self.predicted[rows, :samples]
        return Sensitivity(self.names, misfit, jacobian, mask, self.priors, predicted)

    def _index(self, names: Sequence[str]) -> list[int]:
        return [self.names.index(name) for name in names]

    def residual(self) -> np.ndarray:
        """Misfit on the measured samples, shape (samples,), in units of the noise."""
        return self.misfit[self.mask > 0]


def sensitivity(problem: Problem, values: np.ndarray, names: Sequence[str]) -> Sensitivity:
    """Misfit and Jacobian at `values` (P,), by `names`. One forward-mode pass over all runs."""
    tangents = np.eye(len(values))[[problem.names.index(name) for name in names]]
    (predicted,), (derivatives,) = predicted_and_derivatives(problem, np.asarray(values)[None], tangents[None])
    noise = np.asarray(problem.noise)
    misfit = problem.centred(problem.measured - predicted) / noise
    jacobian = np.moveaxis(-problem.centred(derivatives) / noise, 0, -1)
    priors = problem.priors.slopes(np.asarray(values)) @ tangents.T
    mask = np.asarray(problem.batch.mask)
    return Sensitivity(tuple(names), misfit, jacobian, mask, priors if len(priors) else None, predicted)
