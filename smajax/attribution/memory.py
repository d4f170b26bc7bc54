"""Solved batches kept on disk by their content, so that an interrupted search goes on where it stopped."""

from __future__ import annotations

import hashlib
import os
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import jax
import numpy as np

from smajax.fit.problem import Lane, Problem
from smajax.fit.progress import Progress, quiet
from smajax.fit.solve import Solution, solve
from smajax.source_mark import source_mark


class Memory:
    """`fit.solve.solve` that looks in `folder` first. A key covers data, model, lanes, settings and code."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.reused = 0

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
        digest = hashlib.sha256(
            repr((source_mark(), jax.__version__, problem.names, sorted(settings.items()))).encode()
        )
        digest.update(repr((problem.batch.dt, problem.offset, problem.batch.override_names)).encode())
        for leaf in jax.tree.leaves((problem.system, problem.batch, problem.noise_sigma, list(lanes))):
            digest.update(np.asarray(leaf).tobytes())
        path = self.folder / f"{digest.hexdigest()[:32]}.npz"
        if path.exists():
            with np.load(path, allow_pickle=False) as kept:
                self.reused += 1
                progress(what, 1.0)
                return [
                    Solution(values, float(cost), bool(converged), int(legs))
                    for values, cost, converged, legs in zip(
                        kept["values"], kept["cost"], kept["converged"], kept["legs"], strict=True
                    )
                ]
        solutions = solve(problem, lanes, progress=progress, what=what, **settings)
        self.folder.mkdir(parents=True, exist_ok=True)
        partial = path.with_suffix(".partial.npz")
        np.savez(
            partial,
            values=np.stack([solution.values for solution in solutions]),
            cost=[solution.cost for solution in solutions],
            converged=[solution.converged for solution in solutions],
            legs=[solution.legs for solution in solutions],
        )
        os.replace(partial, path)
        return solutions
