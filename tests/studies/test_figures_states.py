"""The three states of a claim: holds, holds in part, fails; in the records, the tables, the terminal and the exit code."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from typer.testing import CliRunner

from smajax.cli.main import app
from smajax.core.progress import quiet
from studies.source.row import Result, Row, State, judgement
from studies.source.write import as_csv, as_markdown, as_page, as_text, draw, holding, lying_in

REASON = "0.3 mm at 5.6 V alone"


def _row(name: str, holds: bool, in_part: str) -> Row:
    return Row(
        name,
        "Fig. 1",
        "a wire",
        "it shortens",
        lambda fast: Result(holds, "0.3 mm", {"net_mm": 0.3}, lambda figure: None, "a note", in_part),
    )


def test_a_claim_with_a_reason_holds_in_part_and_one_whose_checks_fail_fails() -> None:
    assert [_row("M1", *made).work(True).state for made in ((True, ""), (True, REASON), (False, REASON))] == list(State)
    assert [judgement(*both) for both in ((True, True), (True, False), (False, True))] == list(State)


def test_record_tables_and_headline_have_the_three_states(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    rows = [_row("M1", True, ""), _row("M2", True, REASON), _row("M3", False, ""), _row("M4", True, REASON)]
    monkeypatch.setattr("studies.source.write.every_row", lambda: rows)
    drawn = draw(rows, tmp_path, True, quiet)
    records = [json.loads((tmp_path / f"{row.name}.json").read_text(encoding="utf-8")) for row in rows]
    assert [one["state"] for one in records] == ["holds", "holds in part", "fails", "holds in part"]
    assert [one["holds"] for one in records] == [True, False, False, False]
    assert [one["in_part"] for one in records] == ["", REASON, "", REASON]
    assert lying_in(tmp_path) == drawn
    assert holding(drawn) == "1 of 4 hold, 2 hold in part, 1 fail."
    for text in (as_markdown(drawn), as_page(drawn, tmp_path), as_text(drawn)):
        assert holding(drawn) in text
        assert text.count(REASON) == 2
    assert "| holds in part |" in as_markdown(drawn)
    assert as_page(drawn, tmp_path).count('class="in_part"') == 2
    assert as_csv(drawn, tmp_path).splitlines()[2] == "M2,holds in part,net_mm,0.3"


def test_a_record_with_two_states_is_not_taken(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    row = _row("M1", True, "")
    monkeypatch.setattr("studies.source.write.every_row", lambda: [row])
    draw([row], tmp_path, True, quiet)
    record = tmp_path / "M1.json"
    old = json.loads(record.read_text(encoding="utf-8"))
    del old["state"]
    record.write_text(json.dumps(old | {"holds": True}))
    assert lying_in(tmp_path) == []


def test_a_claim_that_holds_in_part_is_exit_code_3(tmp_path: Path) -> None:
    ended = CliRunner().invoke(app, ["figures", "M9", "C2", "--fast", "--json", "--out", str(tmp_path / "out")])
    told = json.loads(ended.stdout)
    assert ended.exit_code == 3
    assert (told["M9"]["holds"], told["M9"]["state"], told["M9"]["in_part"]) == (True, "holds", "")
    assert (told["C2"]["holds"], told["C2"]["state"]) == (False, "holds in part")
    assert "40 s" in told["C2"]["in_part"]
