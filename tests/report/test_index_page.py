"""One page for the reports of a folder: the numbers are those of the records, and what cannot be read is named."""

from __future__ import annotations

import dataclasses
import json
import math
from pathlib import Path
from typing import Any

import pytest

from smajax.attribution.findings import Verdict
from smajax.report.index_page import INDEX, MARK, read_reports, write_index
from smajax.report.json_file import findings_to_json
from tests.helpers.in_browser import HOSTILE, faults
from tests.helpers.made_findings import made_findings
from tests.helpers.small_bench import refused, smajax


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """Three reports, one of them deeper, and a fourth in a hidden folder."""
    findings = made_findings()
    changed: dict[str, dict[str, Any]] = {
        "first": {"title": HOSTILE},
        "deep/se cond": {"title": "Second", "verdict": Verdict.ADEQUATE, "effects": ()},
        "third": {"title": "Third", "runs": tuple(run for run in findings.runs if run.role == "fit")},
        ".hidden/fourth": {"title": "Fourth"},
    }
    for name, values in changed.items():
        (tmp_path / name).mkdir(parents=True)
        record = findings_to_json(dataclasses.replace(findings, **values))
        (tmp_path / name / "report.json").write_text(json.dumps(record), encoding="utf-8")
        (tmp_path / name / "report.html").write_text("<!doctype html>", encoding="utf-8")
    return tmp_path


def test_the_lines_have_the_numbers_of_the_records(folder: Path) -> None:
    findings = made_findings()
    rows, messages = read_reports(folder)
    assert messages == []
    assert [row.folder for row in rows] == ["deep/se cond", "first", "third"]
    by_name = {row.folder: row for row in rows}
    first, third = by_name["first"], by_name["third"]
    assert first.verdict == findings.verdict.value
    assert first.effects == tuple(one.name for one in findings.effects if one.added)
    assert by_name["deep/se cond"].effects == ()
    fits = [run for run in findings.runs if run.role == "fit"]
    squares = sum(len(run.time) * run.rmse_after**2 for run in fits)
    assert first.fit_after == pytest.approx(math.sqrt(squares / sum(len(run.time) for run in fits)))
    (held_out,) = (run for run in findings.runs if run.role == "held-out")
    assert (first.held_out_before, first.held_out_after) == pytest.approx((held_out.rmse_before, held_out.rmse_after))
    assert (third.held_out_before, third.held_out_after) == (None, None)
    assert third.noises == pytest.approx(third.fit_after / findings.noise_sigma)  # type: ignore[operator]
    assert first.noises == pytest.approx(first.held_out_after / findings.noise_sigma)  # type: ignore[operator]


def test_the_page_is_sound_in_a_browser_and_leads_to_each_report(folder: Path, browser: Any) -> None:
    page, _, _ = write_index(folder)
    assert faults(browser, page) == []
    shown = browser.new_page()
    try:
        shown.goto(page.as_uri())
        links = shown.eval_on_selector_all("td a", "all => all.map(one => one.href)")
        assert sorted(links) == sorted(
            (folder / name / "report.html").as_uri() for name in ("first", "third", "deep/se cond")
        )
        shown.click("th:has-text('verdict')")
        assert shown.eval_on_selector("tbody tr td:nth-child(2)", "cell => cell.textContent") == "adequate"
    finally:
        shown.close()


def test_a_damaged_record_is_named_and_the_others_are_compared(folder: Path) -> None:
    (folder / "third" / "report.json").write_text('{"title": "half of a rec', encoding="utf-8")
    (folder / "fifth").mkdir()
    (folder / "fifth" / "report.json").write_text('{"title": "of another program"}', encoding="utf-8")
    ended = smajax("reports", folder)
    assert ended.code == 0
    assert "third/report.json: is no record of close-loop (JSONDecodeError" in ended.out
    assert "fifth/report.json: is no record of close-loop (KeyError" in ended.out
    page = (folder / INDEX).read_text(encoding="utf-8")
    assert "<h1>2 reports</h1>" in page
    assert "half of a rec" not in page


def test_a_page_of_the_users_and_a_folder_without_reports_are_refused(folder: Path, tmp_path: Path) -> None:
    (folder / INDEX).write_text("mine", encoding="utf-8")
    assert "was not written by `smajax reports`" in refused("reports", folder)
    assert (folder / INDEX).read_text(encoding="utf-8") == "mine"
    empty = tmp_path / "empty"
    empty.mkdir()
    assert "no report.json in" in refused("reports", empty)
    assert list(empty.iterdir()) == []


def test_the_page_is_written_over_by_the_same_command(folder: Path) -> None:
    assert smajax("reports", folder).code == 0
    assert MARK in (folder / INDEX).read_text(encoding="utf-8")
    ended = smajax("reports", folder, "--json")
    assert ended.code == 0
    rows = json.loads(ended.out)
    assert {row["folder"] for row in rows} == {"first", "third", "deep/se cond"}
