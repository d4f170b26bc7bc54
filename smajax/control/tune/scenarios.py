"""On what gains are tuned, and on what they are checked: set points x plants, a row each (`sweep.grid.loop_rows`)."""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import scipy  # its parts are imported when they are first used

from smajax.control.mismatch import MISMATCHES
from smajax.control.sweep.grid import loop_rows
from smajax.core.names import close_matches

CORNERS = 3  # mismatches of which every corner is taken
DRAWN = 16  # plants drawn where there are more
UNSEEN = 2**20  # of a seed: plants of the check are those of no tuning
BESIDE = 5.0  # degrees
BEYOND = 0.2  # how wrong each other parameter is in the check


@dataclass(frozen=True)
class Scenarios:
    """Closed loops of one candidate."""

    rows: np.ndarray  # (M, mismatches + 1): ratios in the order of `MISMATCHES`, then the set point, rad
    nominal: np.ndarray  # (M,) bool: the plant is what the controller believes

    @property
    def size(self) -> int:
        return len(self.rows)

    @property
    def targets(self) -> np.ndarray:
        """Set points, rad."""
        return self.rows[:, -1]


def _crossed(plants: np.ndarray, targets: Sequence[float]) -> Scenarios:
    """Every plant (P, mismatches) at every set point (rad)."""
    where = np.radians(np.asarray(targets, dtype=float))
    ratios = np.repeat(plants, len(where), axis=0)
    named = dict(zip(MISMATCHES, ratios.T, strict=True))
    rows = loop_rows(named, np.tile(where, len(plants)))[:, :-1]
    return Scenarios(rows, np.all(rows[:, :-1] == 1.0, axis=1))


def _plants(changes: Sequence[Mapping[str, float]]) -> np.ndarray:
    return np.asarray([[change.get(name, 1.0) for name in MISMATCHES] for change in changes])


def check_variation(variation: Mapping[str, float]) -> None:
    """ValueError for a mismatch there is not, or one that is no share between 0 and 1."""
    for name, share in variation.items():
        if name not in MISMATCHES:
            raise ValueError(f"no variation `{name}`{close_matches(name, MISMATCHES, 'there are')}.")
        if not 0.0 < share < 1.0:
            percent = f"; {share:g} per cent is {name}={share:g}%" if 1.0 < share < 100.0 else ""
            raise ValueError(
                f"a variation is a share between 0 and 1 (20% or 0.2: from -20% to +20% of what the controller believes), not "
                f"{name}={share:g}{percent}."
            )


def tuned_on(targets: Sequence[float], variation: Mapping[str, float], seed: int) -> Scenarios:
    """The plant as believed and the corners of the variation (from four mismatches on, plants drawn in it) at `targets` (deg).

    Raises ValueError as `check_variation` does.
    """
    check_variation(variation)
    changes: list[dict[str, float]] = [{}]
    if 0 < len(variation) <= CORNERS:
        sides = [(1.0 - share, 1.0 + share) for share in variation.values()]
        changes += [dict(zip(variation, corner, strict=True)) for corner in itertools.product(*sides)]
    elif variation:
        changes += _drawn(variation, DRAWN, seed)
    return _crossed(_plants(changes), targets)


def _drawn(variation: Mapping[str, float], count: int, seed: int) -> list[dict[str, float]]:
    shares = scipy.stats.qmc.Sobol(len(variation), rng=seed).random_base2(int(np.ceil(np.log2(count))))[:count]
    return [
        {name: 1.0 + (2.0 * one - 1.0) * share for one, (name, share) in zip(row, variation.items(), strict=True)}
        for row in shares
    ]


def between(targets: Sequence[float]) -> list[float]:
    """The set points midway between those tuned; one beside the only one, towards the middle of the way."""
    ordered = sorted(targets)
    beside = [ordered[0] - BESIDE if ordered[0] > 0.0 else ordered[0] + BESIDE]
    return [0.5 * (low + high) for low, high in itertools.pairwise(ordered)] or beside


def held_out(targets: Sequence[float], variation: Mapping[str, float], count: int, seed: int) -> dict[str, Scenarios]:
    """What tuning never saw, by name: `inside`, set points that were not tuned, on plants drawn within the variation; and `beyond`.

    Beyond: at the set points tuned, each mismatch that was not varied wrong by 20 % alone.
    """
    others = [name for name in MISMATCHES if name not in variation]
    inside = _drawn(variation, count, seed + UNSEEN) if variation else [{}]
    result = {"inside": _crossed(_plants(inside), between(targets))}
    if others:
        beyond = [{name: ratio} for name in others for ratio in (1.0 - BEYOND, 1.0 + BEYOND)]
        result["beyond"] = _crossed(_plants(beyond), targets)
    return result
