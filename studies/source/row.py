"""One figure of the source: what it claims, how it is made here, and what came out."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from enum import StrEnum

from matplotlib.figure import Figure


class State(StrEnum):
    """Whether the claim of a figure holds."""

    HOLDS = "holds"
    IN_PART = "holds in part"
    FAILS = "fails"


def judgement(checked: bool, as_worded: bool) -> State:
    """`checked` is what the row asks for, `as_worded` the part of the source's words that goes beyond it."""
    if not checked:
        return State.FAILS
    return State.HOLDS if as_worded else State.IN_PART


@dataclass(frozen=True)
class Result:
    """What a row measured. `numbers` are the checked quantities, unit in the name; `found` puts them in a sentence.

    `holds` is of all that the row checks. `in_part` says in one sentence, with numbers, which words of the claim are not
    reached, or which value was chosen so that this one figure holds; it is empty where the claim holds as the source words it.
    """

    holds: bool
    found: str
    numbers: dict[str, float]
    draw: Callable[[Figure], None]
    caveat: str = ""  # what else was chosen here or differs, with numbers, and why
    in_part: str = ""

    @classmethod
    def of(
        cls,
        state: State,
        *,
        in_part: str,
        found: str,
        numbers: dict[str, float],
        draw: Callable[[Figure], None],
        caveat: str = "",
    ) -> Result:
        """Of a row that is judged by three states; `in_part` is what it says where it holds in part."""
        reason = in_part if state is State.IN_PART else ""
        return cls(state is not State.FAILS, found, numbers, draw, caveat, reason)

    @property
    def state(self) -> State:
        """The third state is of a claim whose checks pass, though not as the source words it."""
        if not self.holds:
            return State.FAILS
        return State.IN_PART if self.in_part else State.HOLDS


@dataclass(frozen=True)
class Row:
    """`work(fast)` simulates and checks; `fast` takes coarser steps and fewer samples and still asserts the claim."""

    name: str
    where: str
    system: str
    claim: str
    work: Callable[[bool], Result]
