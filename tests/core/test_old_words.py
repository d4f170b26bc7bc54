"""Sentences that results held themselves are there for one minor version, and are the report's."""

from __future__ import annotations

import pytest

from smajax.control.tune.settings import TuneSettings
from smajax.fit.directions import Direction
from smajax.fit.uncertainty import Remark, RemarkKind
from smajax.report.identifiability_words import direction_sentence, remark_text
from smajax.report.tune_words import goal_sentence, held_out_sentence, plants_sentence
from tests.helpers.made_findings import made_findings


@pytest.mark.parametrize("kind", list(RemarkKind))
def test_a_remark_has_its_text_with_a_warning(kind: RemarkKind) -> None:
    remark = Remark(kind, ("a", "b", "c"))
    with pytest.warns(
        DeprecationWarning, match=r"identifiability_words.remark_text\(remark\) now; it goes in version 0.3"
    ):
        assert remark.text == remark_text(remark)


def test_a_direction_has_its_sentence_with_a_warning() -> None:
    weak = Direction({"a": 1.0, "b": -0.5}, 0.1)
    with pytest.warns(DeprecationWarning, match="direction_sentence"):
        assert weak.sentence() == direction_sentence(weak)


def test_settings_of_a_tuning_have_their_sentences_with_a_warning() -> None:
    settings = TuneSettings("pid", (20.0,), {"damping": 0.2})
    with pytest.warns(DeprecationWarning, match=r"smajax.report.narrate\(settings\).plants now"):
        assert settings.plants_sentence() == plants_sentence(settings)
    with pytest.warns(DeprecationWarning, match="held_out_sentence is"):
        assert settings.held_out_sentence() == held_out_sentence(settings)
    with pytest.warns(DeprecationWarning, match="goal_sentence is"):
        assert settings.goal_sentence() == goal_sentence(settings)


def test_findings_have_their_checks_as_sentences_with_a_warning() -> None:
    findings = made_findings()
    with pytest.warns(DeprecationWarning, match=r"narrate\(findings\).check now"):
        assert findings.check[: len(findings.warnings)] == findings.warnings
