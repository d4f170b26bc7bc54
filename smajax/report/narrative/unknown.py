"""Unknown terms in words: an equation is named only where the runs distinguish it from the others."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import cast

from smajax.attribution.explained_share import EXPLAINED, explained_share
from smajax.attribution.findings import Findings, UnknownTerm
from smajax.core.display_units import label
from smajax.core.wording import per_cent
from smajax.report.narrative.values import error_text, log_odds_text


def comparison_sentence(findings: Findings, term: UnknownTerm) -> str:
    """How a term compares with none."""
    text = f"{'likelier' if term.log_odds > 0.0 else 'less likely'} than none by {log_odds_text(term.log_odds)}"
    if term.left_out_after is not None:
        text += (
            f"; error on runs left out {error_text(findings, term.left_out_before)} -> "
            f"{error_text(findings, term.left_out_after)}{_share_text(findings, term)}"
        )
    before, after = term.held_out_before, term.held_out_after
    if before is not None and after is not None and after >= before:
        text += f"; but on the held-out runs {error_text(findings, before)} -> {error_text(findings, after)}"
    return text


def _share_text(findings: Findings, term: UnknownTerm) -> str:
    """`, which takes away 43% of the squared error beyond the noise (50% are asked for)`: what decides, and no root of it; of a term that predicts better."""
    if term.left_out_after is None:
        return ""
    share = explained_share(term.left_out_after, term.left_out_before, findings.noise_sigma)
    if not share > 0.0:
        return ""
    # Rounded down: what falls short of the half is not said to be one.
    shown = per_cent(math.floor(100.0 * min(share, 1.0)) / 100.0)
    asked = "" if term.named else f" ({EXPLAINED:.0%} are asked for)"
    return f", which takes away {shown} of the squared error beyond the noise{asked}"


def unknown_sentences(findings: Findings) -> tuple[str, ...]:
    """Sentences for the summary; none where no term was sought."""
    if not findings.unknown:
        return ()
    best = findings.unknown[0]
    if not best.named:
        return (_none_named(findings, best),)
    brought = (
        f"error on runs left out {error_text(findings, best.left_out_before)} before, "
        f"{error_text(findings, cast(float, best.left_out_after))} with it{_share_text(findings, best)}"
    )
    if best.held_out_before is not None and best.held_out_after is not None:
        held_out = (error_text(findings, one) for one in (best.held_out_before, best.held_out_after))
        brought += f"; on those held out {' and '.join(held_out)}"
    others = [term for term in findings.unknown if term.name in best.indistinguishable]
    elsewhere = list(dict.fromkeys(term.equation for term in others if term.equation != best.equation))
    if elsewhere:
        equations = " or ".join(f"the {label(one)} equation" for one in (best.equation, *elsewhere))
        return (
            f"What is missing is not in the library, and these runs do not determine whether it is in {equations}: "
            f"of smooth unknown functions put into one equation in turn, {_or_listed([best, *others])} do about equally well. "
            f"Likeliest is the first ({brought}).",
        )
    text = (
        f"What is missing is not in the library; it is in the {label(best.equation)} equation, as an unknown function put "
        f"there shows: {best.title}"
    )
    if others:
        text += f", or {_or_listed(others)}, which these runs do not distinguish from it"
    text += f" ({brought})."
    if not best.formulas:
        return (text,)
    return (text, f"The simplest formula for it: f = {best.formulas[0].text} ({units(best)}).")


def _none_named(findings: Findings, best: UnknownTerm) -> str:
    tried = (
        "Nor do these runs determine in which equation it is missing: of the smooth unknown functions of one state that were "
        "put into each in turn"
    )
    why = comparison_sentence(findings, best)
    if best.held_out_before is not None:
        return f"{tried} {best.title} is likeliest, and is not validated on the held-out runs: {why}."
    if best.log_odds > 0.0:
        if best.left_out_after is None:
            but = "one run, of which none can be left out, confirms no function"
        elif best.left_out_after < best.left_out_before:
            but = "it explains less than half of what is missing in runs left out"
        else:
            but = "it predicts runs left out no better"
        return f"{tried} {best.title} is likeliest, but {but}: {why}."
    return f"{tried} none is likelier than no function at all. The nearest of those that were fitted is {best.title}: {why}."


def _or_listed(terms: Sequence[UnknownTerm]) -> str:
    return " or ".join(term.title for term in terms)


def units(term: UnknownTerm) -> str:
    """`f in W/m, T - T_inf in K`."""
    named = ((name, unit) for name, unit in (("f", term.unit), (term.symbol, term.state_unit)))
    plain = "-", "1"
    return ", ".join(f"{name} a plain number" if unit in plain else f"{name} in {unit}" for name, unit in named)
