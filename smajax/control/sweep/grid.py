"""Which closed loops a sweep runs: ratios of one or two parameters x set points x ratios of the main gain, a row each."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from smajax.control.mismatch import MISMATCHES
from smajax.core.names import close_matches

LEAST, MOST = 0.5, 2.0  # ratios of a perturbed parameter to its assumed value


def loop_rows(
    mismatches: Mapping[str, np.ndarray | float], target: np.ndarray | float, gain: np.ndarray | float = 1.0
) -> np.ndarray:
    """One row a closed loop, (L, mismatches + 2): every ratio (1 by default), set point (rad), ratio of the main gain.

    Raises ValueError for the name of a mismatch that does not exist.
    """
    unknown = [name for name in mismatches if name not in MISMATCHES]
    if unknown:
        raise ValueError(f"no mismatch `{', '.join(unknown)}`; there are {', '.join(sorted(MISMATCHES))}.")
    columns = [mismatches.get(name, 1.0) for name in MISMATCHES]
    return np.stack([np.ravel(column) for column in np.broadcast_arrays(*columns, target, gain)], axis=1)


def check_mismatches(first: str, second: str) -> None:
    """Raise ValueError for an unknown mismatch, or twice the same; `second` is "" for a sweep over the first alone."""
    for name in (first, second) if second else (first,):
        if name not in MISMATCHES:
            raise ValueError(f"no mismatch `{name}`{close_matches(name, MISMATCHES, 'there are')}.")
    if first == second:
        raise ValueError(f"`{first}` twice, expected one mismatch or two different ones of {', '.join(MISMATCHES)}.")


def sweep_ratios(points: int) -> np.ndarray:
    """`points` ratios from 0.5 to 2, evenly by logarithm; an odd number includes 1."""
    return np.exp(np.linspace(np.log(LEAST), np.log(MOST), points))


@dataclass(frozen=True)
class Grid:
    """The product of one or two mismatches (plant over assumed value), set points (rad) and ratios of the main gain.

    Raises ValueError for an unknown mismatch, or twice the same.
    """

    first: str
    second: str  # "": the first alone
    ratios: np.ndarray  # (A,), for both
    targets: np.ndarray  # (S,), rad
    gains: np.ndarray  # (G,), times the preset's main gain

    def __post_init__(self) -> None:
        check_mismatches(self.first, self.second)

    @property
    def mismatches(self) -> tuple[str, ...]:
        return (self.first, self.second) if self.second else (self.first,)

    @property
    def shape(self) -> tuple[int, int, int, int]:
        """(A, A, S, G); (A, 1, S, G) of one mismatch alone."""
        return len(self.ratios), len(self._second), len(self.targets), len(self.gains)

    @property
    def _second(self) -> np.ndarray:
        return self.ratios if self.second else np.ones(1)

    @property
    def size(self) -> int:
        """The number of closed loops."""
        return int(np.prod(self.shape))

    def axes(self) -> tuple[np.ndarray, ...]:
        """Both ratios, set point and ratio of the main gain of every closed loop, each of the grid's shape."""
        return np.meshgrid(self.ratios, self._second, self.targets, self.gains, indexing="ij")

    def rows(self) -> np.ndarray:
        """`loop_rows` of the whole grid."""
        *ratios, target, gain = self.axes()
        return loop_rows(dict(zip(self.mismatches, ratios, strict=False)), target, gain)
