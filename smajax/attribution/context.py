"""What the stages of one attribution share, and the models that they pass on."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from smajax.attribution.asked_ahead import AskedAhead
from smajax.attribution.findings import Findings
from smajax.attribution.fitted_sets import JointSearch
from smajax.attribution.job import Job
from smajax.attribution.model_fits import Model, Search
from smajax.attribution.record_error import NO_RECORDS, CorrectedRecords, OutlierRun
from smajax.attribution.unknown.search import Lacking
from smajax.fit.identifiability import Checks
from smajax.fit.levenberg_marquardt import Fit

Interim = Callable[[Findings], object]  # gets what is known of an attribution that goes on


@dataclass(frozen=True)
class Context:
    """What every stage of one attribution shares; `setting` collects the rounds and the evidence."""

    job: Job
    setting: Search
    start: np.ndarray  # (P,), start values of the parameters of base model and library
    base: Fit  # the base model
    seed: int
    checks: Checks
    interim: Interim | None
    records: CorrectedRecords = NO_RECORDS  # of single runs, in `job`


@dataclass(frozen=True)
class Outcome:
    """The models so far, and what the stages since the search have found out."""

    search: JointSearch
    base: Model
    final: Model
    lacking: Lacking | None = None  # unknown terms, where they have been asked for
    superseded: tuple[str, ...] = ()
    outliers: tuple[OutlierRun, ...] = ()
    asked: tuple[tuple[object, Model, AskedAhead[Any]], ...] = ()  # by `begin_ahead`: a question, of which model

    @property
    def one_outlier(self) -> bool:
        """Whether without one run all the others are explained."""
        return any(run.residual_is_noise for run in self.outliers)
