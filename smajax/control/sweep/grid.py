"""Which closed loops a sweep runs: ratios of one or two parameters x set points x ratios of the main gain, a row each."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from smajax.control.mismatch import MISMATCHES
from smajax.control.plants import PlantSet
from smajax.core.names import close_matches

PLANT = "plant"  # the axis of a batch of plants
OF_ARM = PlantSet()
LEAST, MOST = 0.5, 2.0  # ratios of a perturbed parameter to its assumed value


def loop_rows(
    mismatches: Mapping[str, np.ndarray | float],
    target: np.ndarray | float,
    gain: np.ndarray | float = 1.0,
    plants: PlantSet = OF_ARM,
) -> np.ndarray:
    """One row a closed loop, (L, columns + 2): every ratio (1 by default), set point (rad, m), ratio of the main gain.

    Of a batch of plants the columns are values of parameters.

    Raises ValueError for the name of a mismatch that does not exist.
    """
    unknown = [name for name in mismatches if name not in plants.columns]
    if unknown:
        raise ValueError(f"no mismatch `{', '.join(unknown)}`; there are {', '.join(sorted(plants.columns))}.")
    columns = [mismatches.get(name, nominal) for name, nominal in zip(plants.columns, plants.nominal, strict=True)]
    return np.stack([np.ravel(column) for column in np.broadcast_arrays(*columns, target, gain)], axis=1)


def check_mismatches(names: Sequence[str], known: Sequence[str] = tuple(MISMATCHES)) -> None:
    """Raise ValueError for an unknown mismatch, twice the same, and none."""
    for name in names:
        if name not in known:
            raise ValueError(f"no mismatch `{name}`{close_matches(name, known, 'there are')}.")
    twice = [name for number, name in enumerate(names) if name in names[:number]]
    if twice or not names:
        got = f"`{twice[0]}` twice" if twice else "no mismatch"
        raise ValueError(f"{got}, expected one mismatch or different ones of {', '.join(known)}.")


def check_ratios(least: float, most: float) -> None:
    """Raise ValueError for a range of plant over model that does not go from below 1 to above 1."""
    if not 0.0 < least < 1.0 < most < math.inf:
        raise ValueError(
            f"ratios of plant over model go from below 1 to above 1, such as 0.9 to 1.1; not {least:g} to {most:g}."
        )


def ratios_at(sides: np.ndarray, least: float = LEAST, most: float = MOST) -> np.ndarray:
    """Ratios from `least` at -1 to `most` at 1, evenly by logarithm to either side of 0, where the ratio is 1."""
    return np.exp(np.abs(sides) * np.log(np.where(sides < 0.0, least, most)))


def sweep_ratios(points: int, least: float = LEAST, most: float = MOST) -> np.ndarray:
    """`points` ratios from `least` to `most`, as `ratios_at`; an odd number includes 1."""
    return ratios_at(np.linspace(-1.0, 1.0, points), least, most)


@dataclass(frozen=True)
class Grid:
    """The product of one or two mismatches (plant over assumed value), set points (rad, m) and ratios of the main gain.

    Of a batch of plants, its plants in the place of the mismatches: `PLANT` is the first, its numbers are the ratios. Raises ValueError for an unknown mismatch, or twice the same.
    """

    first: str
    second: str  # "": the first alone
    ratios: np.ndarray  # (A,), for both
    targets: np.ndarray  # (S,), rad or m
    gains: np.ndarray  # (G,), times the preset's main gain
    plants: PlantSet = OF_ARM

    def __post_init__(self) -> None:
        if self.plants.batch is None:
            check_mismatches(self.mismatches, self.plants.columns)

    @property
    def numbered(self) -> bool:
        """Whether the first axis counts plants of a batch."""
        return self.plants.batch is not None

    @property
    def axis_names(self) -> tuple[str, ...]:
        """Of the first axes in tables: `damping_ratio`, or `plant`."""
        return (PLANT,) if self.numbered else tuple(f"{name}_ratio" for name in self.mismatches)

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

    def plant_values(self) -> dict[str, np.ndarray]:
        """Of every closed loop on a batch, each of the grid's shape: column -> its plant's value, SI; nothing where there is no batch."""
        if self.plants.batch is None:
            return {}
        which = self.axes()[0].astype(int) - 1
        return {name: self.plants.batch[which, k] for k, name in enumerate(self.plants.columns)}

    def rows(self) -> np.ndarray:
        """`loop_rows` of the whole grid."""
        *ratios, target, gain = self.axes()
        if self.numbered:
            return loop_rows(self.plant_values(), target, gain, self.plants)
        return loop_rows(dict(zip(self.mismatches, ratios, strict=False)), target, gain, self.plants)
