"""Combinations of parameters that the runs determine poorly, in words: the weak singular vectors of the Jacobian."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from smajax.core.wording import and_listed
from smajax.fit.sensitivity import Sensitivity

NAMED = 0.3  # a parameter with a smaller share of a direction's largest is not named
WEAK = 0.05  # a direction whose standard error is more than this share of the values is worth a sentence
KELVINS = 20.0  # K: what counts as the size of a temperature, about a transformation's width; its degrees have no zero
UNBOUND = 1e6  # relative: nothing in the runs depends on it


@dataclass(frozen=True)
class Direction:
    """A combination of relative changes, the largest of them 1, and the standard error of going along it.

    temperatures: names whose changes are relative to `KELVINS`, and are said in kelvins.
    """

    shares: dict[str, float]
    relative_error: float
    temperatures: frozenset[str] = frozenset()

    def sentence(self) -> str:
        """For an engineer."""
        named = {name: share for name, share in self.shares.items() if abs(share) >= NAMED}
        if self.relative_error >= UNBOUND:
            if len(named) == 1:
                return f"Nothing in these runs depends on {next(iter(named))}."
            return f"These runs determine only a combination of {and_listed(list(named))}: none of them is identifiable by itself."
        if len(named) == 1:
            name = next(iter(named))
            return f"{name} is known to {self._size(name, 1.0)} only."
        changes = and_listed([f"{name} by {self._size(name, share, '+')}" for name, share in named.items()])
        return (
            f"{and_listed(list(named))} are correlated: a change of {changes} at the same time is one standard error."
        )

    def _size(self, name: str, share: float, sign: str = "") -> str:
        """One standard error of `name`, in per cent of its value or in kelvins."""
        unit, whole = ("K", KELVINS) if name in self.temperatures else ("%", 100.0)
        return f"{whole * self.relative_error * share:{sign}.2g} {unit}"


def directions(
    at: Sensitivity,
    names: Sequence[str],
    values: Mapping[str, float],
    inflation: float,
    temperatures: Collection[str] = (),
) -> tuple[Direction, ...]:
    """All directions of `names`, weakest first. `inflation` is the variance of an independent sample over the noise's.

    temperatures: those of `names` in degrees Celsius, of whose values a share means nothing.
    """
    scale = np.asarray([KELVINS if name in temperatures else abs(values[name]) or 1.0 for name in names])
    # A prior's row is a sample whose noise is one, unlike the residual's.
    whole = np.concatenate([at.columns(names), np.sqrt(inflation) * at.prior_columns(names)])
    _, singular, rows = np.linalg.svd(whole * scale, full_matrices=False)
    combinations = []
    for value, row in zip(singular[::-1], rows[::-1], strict=True):
        largest = row[np.argmax(np.abs(row))]
        error = float(np.sqrt(inflation) / value * abs(largest)) if value > 0.0 else np.inf
        shares = dict(zip(names, (row / largest).tolist(), strict=True))
        combinations.append(Direction(shares, min(error, UNBOUND), frozenset(temperatures) & shares.keys()))
    return tuple(combinations)


def weak_combinations(combinations: Sequence[Direction]) -> list[str]:
    """Sentences about the combinations that are poorly determined; none when all are well determined."""
    return [direction.sentence() for direction in combinations if direction.relative_error > WEAK]
