"""An identification in words."""

from __future__ import annotations

from dataclasses import dataclass

from smajax.fit.identify_result import Identified
from smajax.report.identifiability_words import check_sentences, remark_text, weak_combinations
from smajax.report.identify_words import answer, conclusions, ended_sentence


@dataclass(frozen=True)
class IdentificationNarrative:
    """The sentences of one identification."""

    answer: str  # the headline
    conclusions: tuple[str, ...]
    ended: str  # why the fit ended; one of the conclusions
    weak: tuple[str, ...]  # combinations that are poorly determined
    check: tuple[str, ...]  # of the file, and what the runs determine at the initial guess
    remarks: dict[str, str]  # by parameter; "" of one that is well determined


def of_identified(result: Identified) -> IdentificationNarrative:
    return IdentificationNarrative(
        answer=answer(result),
        conclusions=tuple(conclusions(result)),
        ended=ended_sentence(result.ended),
        weak=tuple(weak_combinations(result.directions)),
        check=check_sentences(result.warnings, result.checks),
        remarks={one.name: remark_text(one.note) for one in result.estimates},
    )
