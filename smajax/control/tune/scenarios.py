"""On what gains are tuned, and on what they are checked: set points x plants, a row each (`sweep.grid.loop_rows`)."""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from smajax.control.plants import PlantSet
from smajax.control.position_unit import DEGREES, PositionUnit
from smajax.control.sweep.grid import OF_ARM, loop_rows
from smajax.core.names import close_matches
from smajax.core.sobol import sobol_points

CORNERS = 3  # mismatches of which every corner is taken
DRAWN = 16  # plants drawn where there are more
UNSEEN = 2**20  # of a seed: plants of the check are those of no tuning
BESIDE = 5.0  # degrees
BESIDE_SHARE = 0.1  # of a set point in another unit
HELD_OUT = 4  # of a batch of plants, every so manieth is held out
BEYOND = 0.2  # how wrong each other parameter is in the check


@dataclass(frozen=True)
class Scenarios:
    """Closed loops of one candidate."""

    rows: (
        np.ndarray
    )  # (M, columns + 1): ratios or values in the order of `PlantSet.columns`, then the set point, rad or m
    nominal: np.ndarray  # (M,) bool: the plant is what the controller believes

    @property
    def size(self) -> int:
        return len(self.rows)

    @property
    def targets(self) -> np.ndarray:
        """Set points, rad or m."""
        return self.rows[:, -1]


def _crossed(several: np.ndarray, targets: Sequence[float], plants: PlantSet) -> Scenarios:
    """Every plant (P, columns) at every set point (in the unit shown)."""
    where = plants.unit.to_own(targets)
    values = np.repeat(several, len(where), axis=0)
    named = dict(zip(plants.columns, values.T, strict=True))
    rows = loop_rows(named, np.tile(where, len(several)), plants=plants)[:, :-1]
    return Scenarios(rows, np.all(rows[:, :-1] == plants.nominal, axis=1))


def _changed(changes: Sequence[Mapping[str, float]], plants: PlantSet) -> np.ndarray:
    return np.asarray([[change.get(name, 1.0) for name in plants.columns] for change in changes])


def check_variation(variation: Mapping[str, float], plants: PlantSet = OF_ARM) -> None:
    """ValueError for a mismatch there is not, or one that is no share between 0 and 1."""
    for name, share in variation.items():
        if plants.batch is not None:
            raise ValueError("a batch of plants takes the place of a variation: give one of them.")
        if name not in plants.columns:
            raise ValueError(f"no variation `{name}`{close_matches(name, plants.columns, 'there are')}.")
        if not 0.0 < share < 1.0:
            percent = f"; {share:g} per cent is {name}={share:g}%" if 1.0 < share < 100.0 else ""
            raise ValueError(
                f"a variation is a share between 0 and 1 (20% or 0.2: from -20% to +20% of what the controller believes), not "
                f"{name}={share:g}{percent}."
            )


def _batch(plants: PlantSet, held_out: bool) -> np.ndarray:
    """The plants of a batch that are tuned on, or every fourth, which is held out; (plants, columns)."""
    assert plants.batch is not None
    last = np.arange(len(plants.batch)) % HELD_OUT == HELD_OUT - 1
    return plants.batch[last if held_out else ~last]


def tuned_on(
    targets: Sequence[float], variation: Mapping[str, float], seed: int, plants: PlantSet = OF_ARM
) -> Scenarios:
    """The plant as believed and the corners of the variation (from four mismatches on, plants drawn in it) at `targets`.

    Of a batch of plants: the plant as believed and three of every four. Targets in degrees, or millimetres of a length.
    Raises ValueError as `check_variation` does.
    """
    check_variation(variation, plants)
    if plants.batch is not None:
        return _crossed(np.concatenate([plants.nominal[None], _batch(plants, False)]), targets, plants)
    changes: list[dict[str, float]] = [{}]
    if 0 < len(variation) <= CORNERS:
        sides = [(1.0 - share, 1.0 + share) for share in variation.values()]
        changes += [dict(zip(variation, corner, strict=True)) for corner in itertools.product(*sides)]
    elif variation:
        changes += _drawn(variation, DRAWN, seed)
    return _crossed(_changed(changes, plants), targets, plants)


def _drawn(variation: Mapping[str, float], count: int, seed: int) -> list[dict[str, float]]:
    shares = sobol_points(count, len(variation), seed)
    return [
        {name: 1.0 + (2.0 * one - 1.0) * share for one, (name, share) in zip(row, variation.items(), strict=True)}
        for row in shares
    ]


def beside(target: float, unit: PositionUnit = DEGREES) -> float:
    """How far beside the only set point gains are checked, in its unit."""
    return BESIDE if unit.is_angle else BESIDE_SHARE * abs(target)


def between(targets: Sequence[float], unit: PositionUnit = DEGREES) -> list[float]:
    """The set points midway between those tuned; one beside the only one, towards the middle of the way."""
    ordered = sorted(targets)
    away = beside(ordered[0], unit)
    alone = [ordered[0] - away if ordered[0] > 0.0 else ordered[0] + away]
    return [0.5 * (low + high) for low, high in itertools.pairwise(ordered)] or alone


def held_out(
    targets: Sequence[float], variation: Mapping[str, float], count: int, seed: int, plants: PlantSet = OF_ARM
) -> dict[str, Scenarios]:
    """What tuning never saw, by name: `inside`, set points that were not tuned, on plants drawn within the variation; and `beyond`.

    Beyond: at the set points tuned, each mismatch that was not varied wrong by 20 % alone. Of a batch of plants `inside` has the
    plants that were held out, or where there are fewer than four all of them, and there is no `beyond`.
    """
    where = between(targets, plants.unit)
    if plants.batch is not None:
        unseen = _batch(plants, True)[:count]
        return {"inside": _crossed(unseen if len(unseen) else plants.batch, where, plants)}
    others = [name for name in plants.columns if name not in variation]
    inside = _drawn(variation, count, seed + UNSEEN) if variation else [{}]
    result = {"inside": _crossed(_changed(inside, plants), where, plants)}
    if others:
        beyond = [{name: ratio} for name in others for ratio in (1.0 - BEYOND, 1.0 + BEYOND)]
        result["beyond"] = _crossed(_changed(beyond, plants), targets, plants)
    return result
