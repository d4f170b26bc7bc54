"""Solved batches kept on disk by their content, so that an interrupted search goes on where it stopped."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from smajax.fit.kept import Kept
from smajax.fit.problem import Lane, Problem
from smajax.fit.progress import Progress, quiet
from smajax.fit.solve import Solution, solve


class Memory:
    """`fit.solve.solve` that looks in `folder` first."""

    def __init__(self, folder: Path) -> None:
        self.kept = Kept(folder)

    @property
    def reused(self) -> int:
        return self.kept.reused

    def solve(
        self,
        problem: Problem,
        lanes: Sequence[Lane],
        *,
        progress: Progress = quiet,
        what: str = "fitting",
        **settings: Any,
    ) -> list[Solution]:
        """As `fit.solve.solve`."""
        key = self.kept.key((problem, list(lanes)), sorted(settings.items()))
        known = self.kept.load(key)
        if known is not None:
            progress(what, 1.0)
            return [
                Solution(values, float(cost), bool(converged), int(legs))
                for values, cost, converged, legs in zip(
                    known["values"], known["cost"], known["converged"], known["legs"], strict=True
                )
            ]
        solutions = solve(problem, lanes, progress=progress, what=what, **settings)
        record = {
            "values": np.stack([solution.values for solution in solutions]),
            "cost": [solution.cost for solution in solutions],
            "converged": [solution.converged for solution in solutions],
            "legs": [solution.legs for solution in solutions],
        }
        self.kept.save(key, record)
        return solutions
