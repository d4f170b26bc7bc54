"""Priors that the experiment file gives in the place of the library's."""

from __future__ import annotations

import math
from collections.abc import Iterator

from smajax.attribution.findings import Findings
from smajax.attribution.prior_finding import PriorFinding
from smajax.core.display_units import digits, display


def of_priors(findings: Findings) -> Iterator[str]:
    """One sentence each, beside what the library has."""
    for one in findings.priors:
        if one.odds is not None and one.library_odds is not None:
            yield f"The prior odds of {one.name} are {one.odds:.3g} by the experiment file, and {one.library_odds:.3g} by the library."
        # What says the same is as `smajax new-experiment` drafts it.
        if one.base is not None and one.width is not None and not _as_the_library(one):
            library = "held without it"
            if one.library_base is not None and one.library_width is not None:
                own = _spread(one.library_base, one.library_width, one.library_logarithmic, one.unit, one.name)
                library = f"{own} by the library"
            ours = _spread(one.base, one.width, one.logarithmic, one.unit, one.name)
            without = f"; without it {one.name} has its bounds alone" if one.of_unknown else f", and {library}"
            yield f"The prior of {one.name} is {ours} by the experiment file{without}."


def _as_the_library(one: PriorFinding) -> bool:
    """Whether it says the same, to the digits of a file."""
    pairs = ((one.base, one.library_base), (one.width, one.library_width))
    alike = all(ours is not None and own is not None and math.isclose(ours, own, rel_tol=1e-3) for ours, own in pairs)
    return alike and one.logarithmic == one.library_logarithmic


def _spread(base: float, width: float, logarithmic: bool, unit: str, name: str) -> str:
    seen = display(unit, name)
    middle = seen.with_unit(base, 3)
    if logarithmic:
        return f"{middle}, times or over {math.exp(width):.3g},"
    its = "K" if unit == "degC" else seen.unit  # of a difference
    return f"{middle} \u00b1 {digits(seen.of(width), 3)} {its}".strip()
