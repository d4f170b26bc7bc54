"""What runs determine is said with the numbers it has, and no more."""

from __future__ import annotations

import dataclasses

import pytest

from smajax.fit.identifiability import CorrelatedGroup, Identifiability
from smajax.fit.uncertainty import Remark, RemarkKind
from smajax.report.identifiability_words import identifiability_sentences, remark_text


def test_two_correlated_pairs_are_named_in_the_sentence_that_counts_what_is_identifiable() -> None:
    pairs = CorrelatedGroup(("a", "b"), 0.995), CorrelatedGroup(("d", "e"), 0.9996)
    assert identifiability_sentences(Identifiability(tuple("abcde"), 4000, 5, correlated=pairs)) == [
        "The 5 unknowns are identifiable from these runs (Jacobian of 4000 samples, rank 5), but not each by itself: "
        "a and b are correlated (up to 0.995) and d and e are correlated (up to 0.999). Of each group fix one or measure runs that separate them."
    ]


def test_six_correlated_parameters_are_one_line() -> None:
    group = CorrelatedGroup(tuple("abcdef"), 0.99)
    assert identifiability_sentences(Identifiability(tuple("abcdef"), 4000, 6, correlated=(group,))) == [
        "The 6 unknowns are identifiable from these runs (Jacobian of 4000 samples, rank 6), but not each by itself: "
        "a, b, c, d, e and f are correlated (up to 0.990). Fix one of them or measure runs that separate them."
    ]


def test_remarks_are_short() -> None:
    assert remark_text(Remark()) == ""
    assert remark_text(Remark(RemarkKind.UPPER_BOUND)) == "at its upper bound"
    assert remark_text(Remark(RemarkKind.CORRELATED, ("b",))) == "correlated with b"
    assert remark_text(Remark(RemarkKind.CORRELATED, tuple("bcdef"))) == "correlated with b and 4 others"
    assert (
        remark_text(Remark(RemarkKind.COMBINATION, ("b", "c"))) == "only a combination of it with b, c is identifiable"
    )


def test_correlations_beside_a_combination_without_effect_have_a_line_of_their_own() -> None:
    """Where the count says already that something has to be fixed, it is not repeated there."""
    pair = CorrelatedGroup(("a", "b"), 0.995)
    lines = identifiability_sentences(Identifiability(tuple("abc"), 4000, 2, ("c",), correlated=(pair,)))
    assert lines[0] == "c: nothing in these runs depends on it; fix it or measure something else."
    assert lines[1].startswith("That holds at the initial guess: ")
    # What to fix comes after what may be the cause.
    assert lines[2].startswith("Only 2 combinations are identifiable")
    assert lines[-1] == "a and b are correlated (up to 0.995): fix one of them or measure runs that separate them."


@pytest.mark.parametrize(
    ("names", "rank", "sentence"),
    [
        ("a", 0, "No unknown is identifiable from these runs (Jacobian of 500 samples, rank 0)."),
        ("a", 1, "The one unknown is identifiable from these runs (Jacobian of 500 samples, rank 1)."),
        ("ab", 2, "All 2 unknowns are identifiable from these runs (Jacobian of 500 samples, rank 2)."),
        (
            "abc",
            2,
            "Only 2 combinations are identifiable of the 3 unknowns from these runs (Jacobian of 500 samples, rank 2)",
        ),
    ],
)
def test_the_number_of_identifiable_unknowns_is_reported_first(names: str, rank: int, sentence: str) -> None:
    line = identifiability_sentences(Identifiability(tuple(names), 500, rank, correlated=()))[0]
    assert line.startswith(sentence)


def test_that_no_two_are_correlated_is_said_where_it_was_looked_at() -> None:
    found = Identifiability(("a", "b"), 500, 2, correlated=())
    assert identifiability_sentences(found)[1:] == ["No two of them are strongly correlated."]
    assert identifiability_sentences(dataclasses.replace(found, correlated=None))[1:] == []
    open_range = dataclasses.replace(found, undetermined=("b",))
    assert identifiability_sentences(open_range)[1:] == [
        "b: the noise alone leaves more than a quarter of its range undetermined."
    ]
