"""Findings in words: what the numbers allow, and nothing beyond.

In: `smajax.attribution.findings.Findings`, or what `identify` gives, or `TuneSettings`: numbers and enums. Out: a `Narrative`, sentences for the page, the record and the
terminal; `narrated` does the same for the checks before a fit and the rounds of a search while it runs. Nothing here computes a result: thresholds
are those of `findings.config`, and each module writes one part. `verdict` has the summary and `caveats` what is to be
minded; `limits` what the runs do not determine; `priors` those of the experiment file; `residual`, `rounds` and `unknown` the parts of the same name;
`identification` what `identify` gives, `tuning` what a tuning was asked for.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, overload

from smajax.attribution.findings import Findings, Round
from smajax.attribution.record_error import FoundRecordErrors, NotConfirmed
from smajax.core.progress import Event, Message, Progress, Result
from smajax.fit.identifiability import Checks
from smajax.fit.identify_result import Identified
from smajax.model.effects.library import LIBRARY
from smajax.report.effect_words import meaning
from smajax.report.identifiability_words import check_events, check_sentences
from smajax.report.narrative.identification import IdentificationNarrative, of_identified
from smajax.report.narrative.limits import cannot_know
from smajax.report.narrative.priors import of_priors
from smajax.report.narrative.record_errors import what_is_searched
from smajax.report.narrative.residual import residual_sentences, unexplained
from smajax.report.narrative.rounds import chosen_text, reason_text
from smajax.report.narrative.unknown import comparison_sentence
from smajax.report.narrative.values import error_text
from smajax.report.narrative.verdict import summary

if TYPE_CHECKING:
    from smajax.control.tune.settings import TuneSettings
    from smajax.report.narrative.tuning import TuningNarrative

LISTED = 3  # sets of effects in the line of a round; the page has all


@dataclass(frozen=True)
class Narrative:
    """The sentences of one report, each part in the order of the findings that it is about."""

    summary: tuple[str, ...]  # the answer, the verdict first
    unexplained: tuple[str, ...]
    cannot_know: tuple[str, ...]  # what these runs do not determine
    check: tuple[str, ...]
    residual_before: tuple[str, ...]
    residual_after: tuple[str, ...]
    rounds: tuple[str, ...]  # why each ended so
    dropped: tuple[str, ...]  # why each likely model is not averaged with
    unknown: tuple[str, ...]  # how each term compares with none; "" but for the best
    effects: dict[str, str]  # what each candidate would mean, by its name


@overload
def narrate(findings: Findings) -> Narrative: ...


@overload
def narrate(findings: Identified) -> IdentificationNarrative: ...


@overload
def narrate(findings: TuneSettings) -> TuningNarrative: ...


def narrate(findings: Findings | Identified | TuneSettings) -> Narrative | IdentificationNarrative | TuningNarrative:
    """The whole report in sentences: of `close_loop`'s findings, of what `identify` gives, or of the settings of a tuning."""
    if isinstance(findings, Identified):
        return of_identified(findings)
    if not isinstance(findings, Findings):
        from smajax.report.narrative.tuning import of_settings  # here: a search for effects needs no controllers

        return of_settings(findings)
    return Narrative(
        summary=summary(findings),
        unexplained=unexplained(findings),
        cannot_know=cannot_know(findings),
        check=(*check_sentences(findings.warnings, findings.checks), *of_priors(findings)),
        residual_before=residual_sentences(findings.residual_before),
        residual_after=residual_sentences(findings.residual_after),
        rounds=tuple(
            reason_text(entry.reason, findings.output_unit, findings.output_name) for entry in findings.rounds
        ),
        dropped=tuple(reason_text(one.reason, findings.output_unit, findings.output_name) for one in findings.dropped),
        unknown=tuple(comparison_sentence(findings, term) for term in findings.unknown),
        effects={
            effect.name: meaning(
                effect.name, {name: (one.value, one.standard_error) for name, one in effect.coefficients.items()}
            )
            for effect in findings.effects
            if effect.name in LIBRARY
        },
    )


def narrated(progress: Progress, unit: str = "-", quantity: str = "") -> Progress:
    """`progress` that gets the checks before a fit and each round of a search in words; `unit` (SI) and `quantity` of the output that a search explains."""

    def in_words(event: Event) -> None:
        if isinstance(event, Result) and isinstance(event.record, Round):
            done = event.record
            text = chosen_text(done) or "nothing added"
            progress(Message(f"round {done.number}: {text}; {reason_text(done.reason, unit, quantity, LISTED)}"))
        elif isinstance(event, Result) and isinstance(event.record, Checks):
            for one in check_events(event.record):
                progress(one)
        elif isinstance(event, Result) and isinstance(event.record, FoundRecordErrors | NotConfirmed):
            progress(Message(what_is_searched(event.record)))
        else:
            progress(event)

    return in_words


__all__ = ["IdentificationNarrative", "Narrative", "error_text", "narrate", "narrated"]
