"""Which of two parameters is the lower one: transformation temperatures, and the stops of a load."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import NamedTuple

import equinox as eqx
import jax
import numpy as np

from smajax.core.parameters import parameters, value_at

# (lower, higher, what that says): the names of parameters.
RANGES = (
    ("austenite_start", "austenite_finish", "on heating the wire starts to transform at A_s and has finished at A_f"),
    ("martensite_finish", "martensite_start", "on cooling the wire starts to transform at M_s and has finished at M_f"),
)
ORDER = (*RANGES, ("lower_stop", "upper_stop", "the load moves between its two end stops"))


class Pair(NamedTuple):
    """Two parameters of known values, of which the first has to be below the second."""

    lower: str
    higher: str
    why: str
    low: np.ndarray  # values of the lower, of any shape
    high: np.ndarray  # of the higher, of the same shape

    @property
    def wrong(self) -> np.ndarray:
        """Where they are not in order, of the same shape."""
        return np.asarray(self.low >= self.high)


def pairs(model: eqx.Module, values: Mapping[str, np.ndarray] | None = None) -> Iterator[Pair]:
    """The pairs of `ORDER` that `model` has and whose values are known.

    values: those that stand in for the model's own, by name, of one shape.
    """
    table = parameters(model)
    put = values or {}
    for lower, higher, why in ORDER:
        if lower not in table or higher not in table:
            continue
        low, high = (put[name] if name in put else value_at(model, table[name].path) for name in (lower, higher))
        if isinstance(low, jax.core.Tracer) or isinstance(high, jax.core.Tracer):
            continue
        yield Pair(lower, higher, why, *np.broadcast_arrays(np.asarray(low), np.asarray(high)))


def disorder(model: eqx.Module) -> tuple[str, str, str] | None:
    """(lower, higher, what is wrong) of the first pair in the wrong order; None where all is well or not known yet."""
    for one in pairs(model):
        if one.wrong.any():
            unit = parameters(model)[one.lower].unit
            low, high = one.low[one.wrong].ravel()[0], one.high[one.wrong].ravel()[0]
            at = f"`{one.lower}` = {low:g} {unit} is not below `{one.higher}` = {high:g} {unit}"
            return one.lower, one.higher, f"{at}; {one.why}: exchange or correct the two"
    return None


def check_order(model: eqx.Module) -> None:
    """ValueError where a transformation would finish before it starts, or a load ends before it begins."""
    pair = disorder(model)
    if pair is not None:
        raise ValueError(f"{pair[2]}.")
