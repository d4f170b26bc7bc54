"""How much of what is missing an unknown function, or an error of a record, explains: what decides whether it is named."""

from __future__ import annotations

import math

EXPLAINED = 0.5  # of what is missing: what explains less of it is not named, for the rest may be elsewhere


def explained_share(with_it: float, without: float, noise: float) -> float:
    r"""Share $(e_0^2 - e^2) / (e_0^2 - \sigma^2)$ of the squared error beyond the noise that is taken away; nan where there is none beyond it.

    with_it, without: root mean square errors, $e$ and $e_0$, of a function those on runs left out; noise: $\sigma$; all in one unit. Below zero where it makes the error larger.
    """
    missing = without**2 - noise**2
    return (without**2 - with_it**2) / missing if missing > 0.0 else math.nan
