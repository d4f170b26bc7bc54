"""What the unknown terms say, in sentences: an equation is named only where left-out runs tell it from the others."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from smajax.attribution.findings import UnknownTerm
from smajax.core.display_units import label
from smajax.report.unknown_pictures import units


def told_of(terms: Sequence[UnknownTerm], shown: Callable[[float], str]) -> tuple[str, ...]:
    """Sentences for the summary, `shown` writing an error; none where no term was sought."""
    if not terms:
        return ()
    best = terms[0]
    if not best.named and best.held_out_before is not None:
        return (
            "Nor do these runs say in which equation it is missing: of the smooth unknown functions of one state that were put "
            f"into each in turn {best.title} foretells runs left out best, and the held-out runs do not bear it out: {best.why}.",
        )
    if not best.named:
        return (
            "Nor do these runs say in which equation it is missing: of the smooth unknown functions of one state that were "
            f"put into each in turn none is better beyond chance. The nearest is {best.title}: {best.why}.",
        )
    brought = f"error on runs left out {shown(best.left_out_before)} before, {shown(best.left_out_after)} with it"
    if best.held_out_before is not None and best.held_out_after is not None:
        brought += f"; on those held out {shown(best.held_out_before)} and {shown(best.held_out_after)}"
    others = [term for term in terms if term.name in best.alike]
    elsewhere = list(dict.fromkeys(term.equation for term in others if term.equation != best.equation))
    if elsewhere:
        equations = " or ".join(f"the {label(one)} equation" for one in (best.equation, *elsewhere))
        return (
            f"What is missing is not in the library, and runs left out do not tell whether it lives in {equations}: "
            f"of smooth unknown functions put into one equation in turn, {_or_listed([best, *others])} do alike. Best is the first ({brought}).",
        )
    told = f"What is missing is not in the library; it lives in the {label(best.equation)} equation, as an unknown function put there shows: {best.title}"
    if others:
        told += f", or {_or_listed(others)}, which runs left out do not tell from it"
    told += f" ({brought})."
    if not best.formulas:
        return (told,)
    formula = best.formulas[0]
    return (told, f"The simplest formula for it: f = {formula.text} ({units(best)}).")


def _or_listed(terms: Sequence[UnknownTerm]) -> str:
    return " or ".join(term.title for term in terms)
