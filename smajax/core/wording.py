"""Sentence parts that several stages write."""

from __future__ import annotations

import math
from collections.abc import Sequence, Sized


def counted(number: int, what: str) -> str:
    """`1 closed loop`, `1,066 closed loops`."""
    return f"{number:,} {what}{'' if number == 1 else 's'}"


def times_noise(ratio: float, whose: str = "the noise") -> str:
    """`as large as the noise`, `1.1 times the noise`, `12.5 times the noise`, `1,250 times the noise`."""
    count = f"{ratio:.2g}" if ratio < 10.0 else f"{ratio:,.{1 if ratio < 100.0 else 0}f}"
    return f"as large as {whose}" if count == "1" else f"{count} times {whose}"


def per_cent(share: float) -> str:
    """`94%`; "100%" only of all and "0%" only of none: 599 of 600 are 99.8%."""
    for places in range(4):
        text = f"{share:.{places}%}"
        if (share == 1.0 or float(text[:-1]) != 100.0) and (share == 0.0 or float(text[:-1]) != 0.0):
            return text
    return ">99.999%" if share > 0.5 else "<0.001%"


def of_those_moving(whole: float, moving: float | None) -> str:
    """` (85% of those at which the output moves)` beside the share of all samples; "" where none does, or both are the same."""
    if moving is None or math.isnan(moving) or per_cent(moving) == per_cent(whole):
        return ""
    return f" ({per_cent(moving)} of those at which the output moves)"


def and_listed(names: Sequence[str]) -> str:
    """`a, b and c`, with semicolons where a name holds a comma itself; `nothing` for no names."""
    if len(names) < 2:
        return names[0] if names else "nothing"
    between = "; " if any("," in name for name in names) else ", "
    return f"{between.join(names[:-1])} and {names[-1]}"


def verdict_text(verdict: str, coefficients_at_bounds: Sized, unknowns_at_bounds: Sized = (), doubt: str = "") -> str:
    """`explained`; `explained, at a bound` where coefficients of what was added, or unknowns of the experiment, end at a bound.

    `doubt`: what other runs than those of the fit leave of it (`report.json`), as in `explained, not confirmed`.
    """
    at_bound = "at a bound" if coefficients_at_bounds or unknowns_at_bounds else ""
    return ", ".join(one for one in (verdict, at_bound, doubt) if one)


def aligned(rows: Sequence[Sequence[str]], right: bool = False) -> list[str]:
    """Lines of a table for a terminal, columns of one width."""
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    side = str.rjust if right else str.ljust
    return ["  ".join(map(side, row, widths)) for row in rows]
