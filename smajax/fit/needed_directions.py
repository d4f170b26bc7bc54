"""Directions of derivatives along which one run of a problem changes, put together into the runs of its compiled program.

A run of the program computes several directions. Values of other runs' own change nothing of a run, and of a run that a fit leaves out
nobody needs a derivative: what nobody needs is zero and takes no time. Outputs are of all runs: a fit goes nowhere where one has no numbers.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np


class NeededDirections(NamedTuple):
    """Of M points with S directions each; K runs of the program, each at a point and along some of its directions."""

    points: np.ndarray  # (K, P)
    tangents: np.ndarray  # (K, directions of a run, P)
    order: np.ndarray  # (M, S): of each point's directions, those that are needed first
    taken: np.ndarray  # (M, groups): which of the groups of directions in that order are run

    @classmethod
    def of(cls, points: np.ndarray, tangents: np.ndarray, asked: np.ndarray, each: int) -> NeededDirections:
        """Of what one run depends on, at points (M, P) along tangents (M, S, P); `asked` (M,): at which its derivatives are asked for; `each`: directions of a run."""
        count, directions, size = tangents.shape
        needed = tangents.any(axis=2) & asked[:, None]
        order = np.argsort(~needed, axis=1, kind="stable")
        groups = -(-directions // each)
        filled = np.zeros((count, groups * each, size))
        filled[:, :directions] = np.take_along_axis(tangents * needed[..., None], order[..., None], axis=1)
        # The outputs alone take a run as well.
        runs = np.maximum(-(-needed.sum(axis=1) // each), 1)
        taken = np.arange(groups) < runs[:, None]
        return cls(points[np.nonzero(taken)[0]], filled.reshape(count, groups, each, size)[taken], order, taken)

    def predicted(self, outputs: np.ndarray) -> np.ndarray:
        """Outputs at each point, (M, ...), from those of each run, (K, ...)."""
        runs = self.taken.sum(axis=1)
        found: np.ndarray = outputs[np.cumsum(runs) - runs]
        return found

    def derivatives(self, along: np.ndarray) -> np.ndarray:
        """Derivatives along each direction, (M, S, ...), zero along those that nobody needs, from those of each run, (K, directions of a run, ...)."""
        count, directions = self.order.shape
        each, shape = along.shape[1], along.shape[2:]
        sorted_ones = along
        if not self.taken.all():  # as a rule all are, and need no second copy
            sorted_ones = np.zeros((*self.taken.shape, each, *shape))
            sorted_ones[self.taken] = along
        sorted_ones = sorted_ones.reshape(count, -1, *shape)[:, :directions]
        if (self.order == np.arange(directions)).all():
            return sorted_ones
        found = np.empty_like(sorted_ones)
        found[np.arange(count)[:, None], self.order] = sorted_ones
        return found
