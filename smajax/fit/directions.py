"""Combinations of parameters that the runs determine poorly: the weak singular vectors of the Jacobian."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from smajax.core.old_words import worded
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

    @property
    def named(self) -> dict[str, float]:
        """The shares that are large enough to be named."""
        return {name: share for name, share in self.shares.items() if abs(share) >= NAMED}

    @property
    def unbound(self) -> bool:
        """Whether nothing in the runs depends on it."""
        return self.relative_error >= UNBOUND

    def sentence(self) -> str:
        """In words; DeprecationWarning."""
        return str(
            worded(
                "direction.sentence()",
                "identifiability_words.direction_sentence(direction)",
                "direction_sentence",
                self,
            )
        )


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


def weak(combinations: Sequence[Direction]) -> tuple[Direction, ...]:
    """Those that are poorly determined."""
    return tuple(one for one in combinations if one.relative_error > WEAK)
