"""Candidates of a search: where they are drawn, and what each of them does at several set points."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import jax
import numpy as np

Box = Mapping[str, tuple[float, float]]


def logarithms(box: Box) -> tuple[np.ndarray, np.ndarray]:
    """(lower, upper) ends of positive ranges by name, by their logarithm."""
    low, high = np.log(np.array(list(box.values()))).T
    return low, high


def drawn(box: Box, count: int, seed: int) -> np.ndarray:
    """Points of positive ranges by name, evenly by their logarithm, shape (count, names)."""
    low, high = logarithms(box)
    return np.asarray(np.exp(low + (high - low) * np.random.default_rng(seed).random((count, len(box)))))


def each(function: Callable[[Any, Any], Any], rows: Any, targets: Any, at_once: int = 64) -> Any:
    """`function(row, target)` of every candidate and set point, so many candidates at once, within a compiled function."""
    return jax.lax.map(lambda row: jax.vmap(lambda target: function(row, target))(targets), rows, batch_size=at_once)
