"""What these runs do not determine, whatever the fit says."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from smajax.attribution.findings import Findings
from smajax.core.wording import and_listed
from smajax.fit.uncertainty import RemarkKind
from smajax.report.identifiability_words import remark_text
from smajax.report.narrative.values import assumed_text, error_text


def cannot_know(findings: Findings) -> tuple[str, ...]:
    """One sentence or two for each thing."""
    return (
        *_confounders(findings),
        *_correlated(findings),
        *_remarks(findings),
        *_weak_test(findings),
        *_integration(findings),
        *_assumed(findings),
    )


def separated(findings: Findings) -> str:
    """What to do about parameters of which the runs determine one combination."""
    return (
        "Measure one of them by itself and give it under [model.parameters] in the place of [unknown], or add a fit run that "
        "separates them (another load, a slower or a hotter one): "
        f"`smajax identify {findings.source} --design` ranks such runs."
    )


def _confounders(findings: Findings) -> Iterator[str]:
    titles = {effect.name: effect.title for effect in findings.effects}
    for one in findings.confounders:
        if one.weight > findings.config.confounder_mentioned:
            separating = (
                f" A run with {one.separating_run} would separate them by {one.separation:.1f} times the noise."
                if one.separating_run
                else ""
            )
            yield (
                f"Whether it is {titles[one.effect]} or {titles[one.confounder]}: their traces in these runs overlap by {one.overlap:.2f}, "
                f"and the runs give the second a weight of {one.weight:.2f}.{separating}"
            )


def _correlated(findings: Findings) -> Iterator[str]:
    for cluster in findings.correlated:
        yield (
            f"{and_listed(list(cluster))} are correlated in these runs: what one has too much another makes up for, so each is known "
            f"less well than alone. {separated(findings)}"
        )


def _remarks(findings: Findings) -> Iterator[str]:
    known = {name for cluster in findings.correlated for name in cluster}
    blended: dict[frozenset[str], None] = {}  # parameters of which the runs determine combinations, each group once
    for one in findings.after:
        if one.remark.kind is RemarkKind.COMBINATION:
            blended[frozenset({one.name, *one.remark.others})] = None
        elif one.remark and one.name not in known:
            end = ": known less well than alone." if one.remark.kind is RemarkKind.CORRELATED else "."
            unmeasured = "; its value is not measured by these runs."
            yield f"{one.name}: {remark_text(one.remark)}{unmeasured if one.standard_error is None else end}"
    order = {one.name: place for place, one in enumerate(findings.after)}
    for group in _connected(blended):
        names = sorted(group, key=lambda name: (order.get(name, len(order)), name))
        yield (
            f"Of {and_listed(names)} these runs determine combinations alone, and the value of none of them. {separated(findings)} Where the equations have their "
            "product alone (density and specific heat) no run separates them."
        )
    open_ones = frozenset[str]().union(*blended)
    degrees = [one.name for one in findings.after if one.unit == "degC" and one.name in open_ones]
    if degrees and "convection_coefficient" in open_ones:
        yield (
            f"{and_listed(degrees)} {'is' if len(degrees) == 1 else 'are'} open together with the convection because the scale of the wire's temperature over the air's is: with convection, specific "
            "heat and stress slopes changed alike the output is the same, under every load and however slow the run. A measured temperature of the "
            "wire, runs in air of another temperature, or one of these values known tells it."
        )


def _connected(groups: Iterable[frozenset[str]]) -> list[frozenset[str]]:
    """Groups that have a name in common as one."""
    found: list[frozenset[str]] = []
    for group in groups:
        joined = [one for one in found if one & group]
        found = [*(one for one in found if one not in joined), group.union(*joined)]
    return found


def _weak_test(findings: Findings) -> Iterator[str]:
    if findings.fit_runs == 2:
        yield "With two fit runs the left-out test is weak: give at least three of different kinds."
    elif findings.fit_runs == 1:
        yield "With one fit run no run can be left out to test an effect: give at least three of different kinds."
    if findings.offset:
        yield "The zero of the output: each run has its own offset, fitted to that run, also for held-out runs."


def _integration(findings: Findings) -> Iterator[str]:
    error = findings.integration_error
    if error > 0.0:
        large = not findings.integration.small
        yield (
            f"Anything below {error_text(findings, error)}: so much of the output is the integration's ({findings.integration.description})"
            + (
                ", which is not small beside the noise: where a load sticks and jumps no step settles when."
                if large
                else "."
            )
        )


def _assumed(findings: Findings) -> Iterator[str]:
    declared = sorted(name for name in findings.declared if "." not in name)
    if declared:
        yield f"Anything that shifts what was declared as known: {', '.join(declared)}."
    texts = {one.name: assumed_text(one) for one in findings.assumed if one.name not in declared}
    if texts:
        yield (
            f"Nor what the presets {findings.wire} and {findings.load} give: {', '.join(texts[name] for name in sorted(texts))}. A fitted value is "
            "right as far as these are; a heat capacity, a loss or a latent heat scales with density and resistivity."
        )
