"""Effects of the model that are less likely than not, and what may be in their place."""

from __future__ import annotations

from collections.abc import Iterator

from smajax.attribution.findings import EffectFinding, Findings
from smajax.core.wording import and_listed

EVEN = 0.5  # as likely as not
LEAST, MOST = 0.05, 3  # probability of an effect that is said beside them, and how many are


def uncertain_effects(findings: Findings) -> list[EffectFinding]:
    """Those of the model: several sets of effects share the probability, and most of it is in sets without them."""
    return [effect for effect in findings.added if effect.probability < EVEN]


def of_uncertain_effects(findings: Findings) -> Iterator[str]:
    """That such effects are named for want of a better, and are not found."""
    unsure = uncertain_effects(findings)
    if not unsure:
        return
    rest = [one for one in findings.effects if not one.added and one.probability >= LEAST]
    others = sorted(rest, key=lambda one: -one.probability)[:MOST]
    is_, its = ("is", "its") if len(unsure) == 1 else ("are", "their")
    instead = f": in {its} place {and_listed(list(map(_with_probability, others)))} may be there" if others else ""
    yield f"Mind: {and_listed(list(map(_with_probability, unsure)))} {is_} less likely than not{instead}."


def _with_probability(effect: EffectFinding) -> str:
    return f"{effect.title} (posterior probability {effect.probability:.2f})"
