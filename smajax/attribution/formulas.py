"""Simple formulas for a function that was learnt: the best sums of one or two terms of a small dictionary.

A formula g = theta . phi is held against the coefficients c of the learnt spline and their covariance C,

    chi^2 = (c - B theta)^T C^-1 (c - B theta),       BIC = chi^2 + k ln n

with B the dictionary's terms as splines, k the numbers that a formula has, and n the samples that count as independent
(Schwarz 1978). So a formula is free, within `FREE`, where the runs do not tell the function, and bound where they do.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np

from smajax.attribution.findings import Formula
from smajax.attribution.unknown.spline import design

OFFERED = 3  # formulas shown; each is of another kind
# By how much a formula may differ from the function for nothing, in shares of its size: at most so where the model's
# parameters could take the difference over (the covariance is that of small changes), at least so anywhere.
FREE, EXACT = 0.3, 1e-6
FINE = 201  # points at which a term is turned into a spline
PLACES = np.linspace(0.15, 0.85, 15)  # of a step, in shares of the range
STEEP = 0.05  # half width of a step, in shares of the range
GROWTHS = (0.1, 0.2, 0.4)  # of an exponential, in shares of the range


@dataclass(frozen=True)
class _Word:
    """One term of the dictionary; `inner`: how many numbers it has beside its factor."""

    kind: str
    text: str
    of: Callable[[np.ndarray], np.ndarray]  # of x
    inner: int = 0


def _step(place: float, half: float, x: np.ndarray) -> np.ndarray:
    return 0.5 * (1.0 + np.tanh((x - place) / half))


def _growth(low: float, size: float, x: np.ndarray) -> np.ndarray:
    return np.exp((x - low) / size)


def _from(symbol: str, place: float) -> str:
    return f"{symbol} {'-' if place >= 0.0 else '+'} {abs(place):.3g}"


def _dictionary(low: float, width: float, symbol: str) -> list[_Word]:
    whole = f"({symbol})" if " " in symbol else symbol
    words = [
        _Word("constant", "", np.ones_like),
        _Word("line", whole, lambda x: x),
        _Word("square", f"{whole}^2", lambda x: x**2),
        _Word("cube", f"{whole}^3", lambda x: x**3),
    ]
    if low < -0.1 * width and low + width > 0.1 * width:
        words.append(_Word("size", f"|{symbol}|", np.abs))
    if low >= -0.1 * width:
        words.append(_Word("root", f"sqrt({symbol})", lambda x: np.sqrt(np.maximum(x, 0.0))))
    for share in GROWTHS:
        for sign in (1.0, -1.0):
            size = sign * share * width
            text = f"exp(({_from(symbol, low)})/{size:.3g})"
            words.append(_Word("exponential", text, partial(_growth, low, size), 1))
    for share in PLACES:
        place, half = low + share * width, STEEP * width
        text = f"(1 + tanh(({_from(symbol, place)})/{half:.3g}))/2"
        words.append(_Word("step", text, partial(_step, place, half), 1))
    return words


def formulas(
    low: float, width: float, coefficients: np.ndarray, covariance: np.ndarray, samples: float, symbol: str
) -> tuple[Formula, ...]:
    """The best formulas for the spline with these `coefficients` (K,) over low..low + width, in SI, best first.

    None for a function that is zero, or over no width.
    """
    if not (width > 0.0 and np.any(coefficients) and np.isfinite(coefficients).all() and np.isfinite(covariance).all()):
        return ()
    share = np.linspace(0.0, 1.0, FINE)
    basis = design(share)
    x = low + width * share
    words = _dictionary(low, width, symbol)
    splines = np.stack([np.linalg.lstsq(basis, word.of(x), rcond=None)[0] for word in words], axis=1)
    size = max(float(np.sqrt(np.mean(coefficients**2))), 1e-300)
    values, directions = np.linalg.eigh(covariance)
    root = directions.T / np.clip(np.sqrt(np.maximum(values, 0.0)), EXACT * size, FREE * size)[:, None]
    target, columns = root @ coefficients, root @ splines
    found = []
    for count in (1, 2):
        for chosen in itertools.combinations(range(len(words)), count):
            if sum(words[k].inner for k in chosen) > 1:
                continue
            matrix = columns[:, chosen]
            length = np.linalg.norm(matrix, axis=0)
            if not (np.isfinite(length).all() and length.all()):
                continue
            factors, _, rank, _ = np.linalg.lstsq(matrix / length, target, rcond=1e-10)
            if rank < count:
                continue
            missed = float(np.sum((target - matrix @ (factors / length)) ** 2))
            numbers = count + sum(words[k].inner for k in chosen)
            bic = missed + numbers * float(np.log(max(samples, 2.0)))
            found.append((bic, missed, numbers, [(factors[j] / length[j], words[k]) for j, k in enumerate(chosen)]))
    found.sort(key=lambda one: one[0])
    offered: list[Formula] = []
    kinds = set()
    for bic, missed, numbers, parts in found:
        # Of each kind the best: a step moved by a little is no other formula.
        kind = tuple(word.kind for _, word in parts)
        if len(offered) == OFFERED or kind in kinds:
            continue
        kinds.add(kind)
        curve = sum(factor * word.of(x) for factor, word in parts)
        offered.append(Formula(_written(parts), missed, numbers, bic, np.asarray(curve)))
    return tuple(offered)


def _written(parts: list[tuple[float, _Word]]) -> str:
    """`0.12 + 3.1e-5 T^2`."""
    text = ""
    for factor, word in parts:
        size = f"{abs(factor):.3g}" + (f" {word.text}" if word.text else "")
        sign = "-" if factor < 0.0 else "+"
        text += f" {sign} {size}" if text else (f"-{size}" if factor < 0.0 else size)
    return text
