"""One figure of the source: what it claims, how it is made here, and what came out."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from matplotlib.figure import Figure


@dataclass(frozen=True)
class Result:
    """What a row measured. `numbers` are the checked quantities, unit in the name; `found` puts them in a sentence."""

    holds: bool
    found: str
    numbers: dict[str, float]
    draw: Callable[[Figure], None]
    caveat: str = ""  # what of the claim is not reached or holds only with a choice made here, with numbers, and why


@dataclass(frozen=True)
class Row:
    """`work(fast)` simulates and checks; `fast` takes coarser steps and fewer samples and still asserts the claim."""

    name: str
    where: str
    system: str
    claim: str
    work: Callable[[bool], Result]
