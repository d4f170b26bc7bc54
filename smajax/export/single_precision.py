"""What a build with single-precision inputs and outputs computes in: single precision where that was measured to be enough, else double.

A single-precision number is kept to 6e-8. A derivative takes the difference of two readings, an estimator that of two angles or a fraction beside the end of its
arccos, and a command follows that by more than 1e-5. No order of operations mends it, for the state itself has no more digits. So state, parameters and
arithmetic stay double there, in software where a processor has none.
"""

from __future__ import annotations

import json
import textwrap
from dataclasses import asdict, dataclass
from functools import cache
from pathlib import Path
from typing import Any

DOUBLE, SINGLE = "double", "float"
ENOUGH = 1e-5  # difference of a command, as a share of the largest
RECORD = Path(__file__).with_name("single_precision.json")  # written by studies.exported_code.run
SLOWER = "26 to 46"  # studies.exported_code.cortex_m4
WIDTH = 118


@dataclass(frozen=True)
class Measured:
    """Commands of single-precision arithmetic against double precision at the same readings, over closed loops of the package.

    period: s, of a call. within: share of the loops that stay within `ENOUGH`; largest: difference of any of them. Both of the largest command.
    """

    loops: int
    period: float
    within: float
    largest: float

    @property
    def enough(self) -> bool:
        """Whether all loops stay within `ENOUGH`."""
        return self.within == 1.0

    def words(self) -> str:
        """Without an end: `within 1e-05 of the largest in 97.8 % of 10,000 closed loops with a period of 10 ms, and at most 3e-03 off`."""
        share = "all" if self.enough else f"{100.0 * self.within:.4g} %"
        loops = f"{self.loops:,} closed loops with a period of {1e3 * self.period:g} ms"
        return f"within {ENOUGH:.0e} of the largest in {share} of {loops}, and at most {self.largest:.0e} off"


@dataclass(frozen=True)
class SingleBuild:
    """arithmetic: `DOUBLE` or `SINGLE`, of a build with single inputs and outputs. measured: of single arithmetic; None: nobody has."""

    arithmetic: str = DOUBLE
    measured: Measured | None = None

    def accuracy(self) -> str:
        """What single arithmetic makes of the commands, a sentence."""
        if self.measured is None:
            return "How far results of single-precision arithmetic are off was not measured."
        return f"With single-precision arithmetic commands were {self.measured.words()}."

    def header(self, macro: str) -> list[str]:
        """For a header, in lines. macro: what changes the arithmetic of this build."""
        if self.arithmetic == SINGLE:
            text = f"With -DSMAJAX_SINGLE=1 all of it is single precision (-D{macro}=0: only inputs and outputs)."
        else:
            text = (
                "With -DSMAJAX_SINGLE=1 inputs and outputs are single precision; state, parameters and arithmetic stay double, which a processor that has "
                f"single precision alone does in software: a Cortex-M4F by {SLOWER} times as many instructions. -D{macro}=1 makes them single too."
            )
        return textwrap.wrap(f"Double precision. {text} {self.accuracy()}", WIDTH)

    def record(self) -> dict[str, Any]:
        """For JSON."""
        return {"arithmetic": self.arithmetic, "measured": None if self.measured is None else asdict(self.measured)}


UNKNOWN = SingleBuild()


@cache
def measured() -> dict[tuple[str, str], Measured]:
    """By the names of controller and estimator ("" without one)."""
    rows = json.loads(RECORD.read_text("utf-8"))["rows"]
    return {(row.pop("controller"), row.pop("estimator")): Measured(**row) for row in rows}


def single_build(controller: str, estimator: str, period: float, arithmetic: str | None = None) -> SingleBuild:
    """Of a controller behind an estimator ("" for none), called every `period` s. arithmetic: None for what was measured to be enough.

    Single precision is enough where it was over all measured loops, if the period is no shorter than theirs: a rate is a difference over a period.
    """
    found = measured().get((controller, estimator))
    if arithmetic is None:
        arithmetic = SINGLE if found is not None and found.enough and period >= found.period else DOUBLE
    return SingleBuild(arithmetic, found)
