"""What a model file has of a parameter that each fit run had a value of its own of: their mean, and what they scatter by as its error."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from smajax.core.names_of_runs import is_of_run, parameter_of
from smajax.data.experiment.record import RUN_STARTS


class OfRuns(NamedTuple):
    """By parameter: the mean over the runs, and the variance between them of those with more than one run.

    Another run has another value: what they scatter by is the error of the mean as a prediction of it.
    """

    means: dict[str, float]
    scatter: dict[str, float]

    @classmethod
    def among(cls, fitted: Mapping[str, float]) -> OfRuns:
        """Of fitted values, those of single runs called `name[run]`."""
        values: dict[str, list[float]] = {}
        for name, value in fitted.items():
            if is_of_run(name):
                own = parameter_of(name)
                values.setdefault(RUN_STARTS.get(own, own), []).append(value)
        means = {name: float(np.mean(many)) for name, many in values.items() if name}
        return cls(means, {name: float(np.var(values[name], ddof=1)) for name in means if len(values[name]) > 1})

    def beside(self, names: Sequence[str], covariance: np.ndarray) -> tuple[tuple[str, ...], np.ndarray]:
        """(names, covariance) of the shared ones among `names` with their `covariance` (K, K), and of these, independent of them."""
        keep = [k for k, name in enumerate(names) if not is_of_run(name)]
        whole = np.zeros((len(keep) + len(self.scatter),) * 2)
        whole[: len(keep), : len(keep)] = covariance[np.ix_(keep, keep)]
        own = range(len(keep), len(whole))
        whole[own, own] = list(self.scatter.values())
        return (*(names[k] for k in keep), *self.scatter), whole
