"""What a name of the traced program stands for while it is translated."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from math import prod
from typing import Any

import numpy as np

from smajax.engine.text import Lane

SMALL = 64  # numbers an array may have to be held in registers, one name each


class Held(np.ndarray):
    """A small array of `Lane`s (object dtype), whatever its shape: a number is one of shape ()."""


@dataclass(frozen=True)
class Stored:
    """A large array in memory, row-major; each run's own (lanes side by side), or one for all."""

    address: str  # of its first number
    shape: tuple[int, ...]
    dtype: str
    own: bool

    @property
    def size(self) -> int:
        return prod(self.shape)


@dataclass(frozen=True)
class Filled:
    """A large array of one and the same number."""

    lane: Lane
    shape: tuple[int, ...]


# Known before the program runs; or one of the above.
Value = np.ndarray | Held | Stored | Filled


@cache
def name_of(dtype: Any) -> str:
    """`str(dtype)`, for which NumPy takes ten times as long, and a translation asks once an operation."""
    return str(dtype)


def held(lanes: Any, shape: tuple[int, ...] = ()) -> Held:
    """An array of `Lane`s: numpy must not look into them."""
    if not isinstance(lanes, list) or len(lanes) == 1:
        result = Held(shape, dtype=object)
        result[(0,) * len(shape)] = lanes[0] if isinstance(lanes, list) else lanes
        return result
    flat = np.empty(len(lanes), dtype=object)
    for number, lane in enumerate(lanes):
        flat[number] = lane
    return flat.reshape(shape).view(Held)


def is_known(value: Value) -> bool:
    kind = type(value)
    return kind is np.ndarray or (kind is not Held and isinstance(value, np.ndarray))


def size_of(value: Value) -> int:
    return value.size if isinstance(value, np.ndarray | Stored) else prod(value.shape)
