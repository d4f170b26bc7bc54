"""What a batch varies: named values on named dimensions, as a product grid, zipped lists or samples of a box."""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy  # its parts are imported when they are first used

from smajax.core.sobol import sobol_points

METHODS = ("sobol", "latin-hypercube", "random")


@dataclass(frozen=True)
class Dimension:
    """One dimension of a batch: values of the same length that go together."""

    name: str
    values: Mapping[str, np.ndarray]  # each of shape (size,)

    @property
    def size(self) -> int:
        return len(next(iter(self.values.values())))


@dataclass(frozen=True)
class Axes:
    """Dimensions whose product is the batch: `axes * more` crosses two of them. Runs count with the last fastest."""

    dimensions: tuple[Dimension, ...]

    def __post_init__(self) -> None:
        dims = [one.name for one in self.dimensions]
        names = self.names
        for kind, several in (("dimension", dims), ("value", names)):
            twice = sorted({name for name in several if several.count(name) > 1})
            if twice:
                raise ValueError(f"every {kind} of a batch has a name of its own, but {twice} is there more than once.")

    def __mul__(self, other: Axes) -> Axes:
        return Axes((*self.dimensions, *other.dimensions))

    @property
    def names(self) -> list[str]:
        """Every value that varies."""
        return [name for one in self.dimensions for name in one.values]

    @property
    def shape(self) -> tuple[int, ...]:
        return tuple(one.size for one in self.dimensions)

    @property
    def size(self) -> int:
        """How many runs."""
        return int(np.prod(self.shape, dtype=np.int64))

    def runs(self, start: int, stop: int) -> dict[str, np.ndarray]:
        """The values of runs `start` to `stop` - 1, each of shape (stop - start,): never all of them at once."""
        places = np.unravel_index(np.arange(start, stop), self.shape) if self.dimensions else ()
        return {
            name: values[place]
            for one, place in zip(self.dimensions, places, strict=True)
            for name, values in one.values.items()
        }

    def members(self, start: int, stop: int) -> dict[str, np.ndarray]:
        """The old name of `runs`."""
        warnings.warn("Axes.members is Axes.runs now; it is removed in version 0.3", DeprecationWarning, stacklevel=2)
        return self.runs(start, stop)


def _series(name: str, values: object) -> np.ndarray:
    try:
        series = np.asarray(values, dtype=float)
    except (TypeError, ValueError):
        raise ValueError(f"the values of `{name}` must be numbers in SI, without units, not {values!r}.") from None
    if series.ndim != 1 or series.size == 0:
        raise ValueError(f"the values of `{name}` must be a list of numbers, but their shape is {series.shape}.")
    if not np.isfinite(series).all():
        raise ValueError(f"value {int(np.argmin(np.isfinite(series)))} of `{name}` is not a finite number.")
    return series


def grid(values: Mapping[str, object] | None = None, **more: object) -> Axes:
    """Every value of each with every value of the others: a dimension each, named as the value.

    Names with a dot (`latent_heat.enthalpy`) go into `values`.
    """
    every = {**(values or {}), **more}
    return Axes(tuple(Dimension(name, {name: _series(name, series)}) for name, series in every.items()))


def zipped(values: Mapping[str, object] | None = None, *, dimension: str = "sample", **more: object) -> Axes:
    """First with first, second with second: one dimension. Raises ValueError for lists of different lengths."""
    every = {name: _series(name, series) for name, series in {**(values or {}), **more}.items()}
    lengths = {name: len(series) for name, series in every.items()}
    if len(set(lengths.values())) != 1:
        raise ValueError(f"zipped lists must be of one length, but there are {lengths}. Use `grid` for their product.")
    return Axes((Dimension(dimension, every),))


def sampled(
    count: int,
    bounds: Mapping[str, tuple[float, float]] | None = None,
    *,
    method: str = "sobol",
    seed: int = 0,
    dimension: str = "sample",
    **more: tuple[float, float],
) -> Axes:
    """`count` points of a box (name -> its two bounds), all on one dimension. The same seed gives the same points.

    Raises ValueError for a `count` that is no whole number, bounds that do not rise, and a way of sampling that there is not.
    """
    box = {**(bounds or {}), **more}
    wrong = {name: pair for name, pair in box.items() if not (np.isfinite(pair).all() and pair[0] < pair[1])}
    if wrong or not box:
        raise ValueError(f"bounds are two finite numbers that rise, not {wrong or box}.")
    given: Any = count  # of whoever does not check types
    if isinstance(given, bool) or not isinstance(given, int | np.integer) or given < 1:
        raise ValueError(f"`count` is how many samples, a whole number of 1 or more, not {count!r}.")
    low, high = (np.asarray([pair[side] for pair in box.values()], dtype=float) for side in (0, 1))
    if method == "sobol":
        shares = sobol_points(count, len(box), seed)
    elif method == "latin-hypercube":
        shares = scipy.stats.qmc.LatinHypercube(len(box), rng=seed).random(count)
    elif method == "random":
        shares = np.random.default_rng(seed).random((count, len(box)))
    else:
        raise ValueError(f"no way of sampling `{method}`; there are {', '.join(METHODS)}.")
    points = low + shares * (high - low)
    return Axes((Dimension(dimension, {name: points[:, k] for k, name in enumerate(box)}),))
