"""Every measured run held out in turn: the kept table, and one of its lines made again."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from studies.held_out_in_turn import run as study

KEPT = study.load(json.loads(study.KEPT.read_text(encoding="utf-8")))


@pytest.mark.parametrize("wire", study.WIRES)
def test_each_run_is_held_out_once_and_all_others_are_fitted(wire: str) -> None:
    text = (study.HERE.parent / wire / "experiment.toml").read_text(encoding="utf-8")
    names = study.run_names(text)
    assert len(names) == text.count("[[runs]]") >= 4
    for name in names:
        changed = study.with_held_out(text, name)
        roles = {one["name"]: one["role"] for one in study.RUN.finditer(changed)}
        assert roles == {other: "held-out" if other == name else "fit" for other in names}
    assert [one.run for one in KEPT if one.wire == wire] == names


def test_a_run_that_there_is_not_is_refused() -> None:
    text = '[[runs]]\nname = "one"\nrole = "fit"\n'
    with pytest.raises(ValueError, match="no run 'two'; expected one of one"):
        study.with_held_out(text, "two")


def test_the_page_tells_what_is_kept() -> None:
    assert study.page(KEPT) == study.PAGE.read_text(encoding="utf-8")


def test_what_is_added_is_nearer_on_every_run_that_was_held_out() -> None:
    """No extended model is worse than the base model, and the bands hold about as many samples as they say."""
    assert all(one.extended <= 1.02 * one.base and one.average <= 1.02 * one.base for one in KEPT)
    assert all(one.extended < one.base for one in KEPT if one.added)
    assert 0.85 < study.in_band(KEPT) <= 0.97


@pytest.mark.slow  # half a minute; the kept study is tested always
def test_a_line_of_the_table_is_made_again(measured_data: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SMAJAX_DATA", str(measured_data.resolve()))
    before = next(one for one in KEPT if (one.wire, one.run) == ("flexinol_isobaric", "100 MPa"))
    now = study.turn(before.wire, before.run)
    assert now.added == before.added
    assert now.extended == pytest.approx(before.extended, rel=0.1)
    assert now.in_band == pytest.approx(before.in_band, abs=0.03)
