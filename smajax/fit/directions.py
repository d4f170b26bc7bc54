"""Which combinations of parameters the runs cannot tell, in words: the weak singular vectors of the Jacobian."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from smajax.fit.sensitivity import Sensitivity
from smajax.words import and_listed

NAMED = 0.3  # a parameter with a smaller share of a direction's largest is not named
WEAK = 0.05  # a direction whose standard error is more than this share of the values is worth a sentence
UNBOUND = 1e6  # relative: nothing in the runs depends on it


@dataclass(frozen=True)
class Direction:
    """A combination of relative changes, the largest of them 1, and the standard error of going along it."""

    shares: dict[str, float]
    relative_error: float

    def sentence(self) -> str:
        """For an engineer."""
        named = {name: share for name, share in self.shares.items() if abs(share) >= NAMED}
        if self.relative_error >= UNBOUND:
            if len(named) == 1:
                return f"Nothing in these runs depends on {next(iter(named))}."
            return f"The runs do not see {and_listed(list(named))} move together: no one of them is known by itself."
        size = 100.0 * self.relative_error
        if len(named) == 1:
            return f"{next(iter(named))} is known to {size:.2g} % only."
        moves = and_listed([f"{name} by {size * share:+.2g} %" for name, share in named.items()])
        return f"{and_listed(list(named))} move together: {moves}, all at once, is one standard error."


def directions(
    at: Sensitivity, names: Sequence[str], values: Mapping[str, float], inflation: float
) -> tuple[Direction, ...]:
    """All directions of `names`, weakest first. `inflation` is the variance of an independent sample over the noise's."""
    scale = np.asarray([abs(values[name]) or 1.0 for name in names])
    # A prior's row is a sample whose noise is one, and not the residual's.
    whole = np.concatenate([at.columns(names), np.sqrt(inflation) * at.prior_columns(names)])
    _, singular, rows = np.linalg.svd(whole * scale, full_matrices=False)
    found = []
    for value, row in zip(singular[::-1], rows[::-1], strict=True):
        largest = row[np.argmax(np.abs(row))]
        error = float(np.sqrt(inflation) / value * abs(largest)) if value > 0.0 else np.inf
        shares = dict(zip(names, (row / largest).tolist(), strict=True))
        found.append(Direction(shares, min(error, UNBOUND)))
    return tuple(found)


def weak_ones(found: Sequence[Direction]) -> list[str]:
    """Sentences about the combinations that are poorly known; none when all are well known."""
    return [one.sentence() for one in found if one.relative_error > WEAK]
