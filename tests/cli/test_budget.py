"""A loop that is ended before its end leaves a page with what was known, and `--budget` ends it."""

from __future__ import annotations

import dataclasses
import json
import sys
import time
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import pytest

import smajax as sma
from smajax.attribution import close_loop as stages
from smajax.attribution.config import AttributionConfig
from smajax.attribution.context import Interim
from smajax.attribution.findings import CoefficientFinding, Findings, Remaining, Verdict
from smajax.cli.budget import BUDGET, first_page, run_within, without
from smajax.cli.commands.close_loop import run_close_loop
from smajax.report.html import findings_to_html
from smajax.report.narrative import narrate
from smajax.report.write import write_report
from tests.helpers.made_findings import NAN, made_findings
from tests.helpers.small_bench import bench, smajax

pytestmark = pytest.mark.usefixtures("blank_pictures")


class EndedError(Exception):
    """Raised in the place of the end of a process."""


@pytest.mark.parametrize("rounds", [1, 2])
def test_a_loop_that_resumes_leaves_a_page_that_knows_more_until_it_knows_as_much(
    rounds: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    found, experiment, out = made_findings(), sma.load_experiment(bench(tmp_path)), tmp_path / "report"
    assert len(found.rounds) == 2

    def ended_after(known: int, title: str) -> bytes:
        def stopped(*_: object, interim: Interim, **__: object) -> None:
            interim(dataclasses.replace(found, title=title, rounds=found.rounds[:known]))
            raise EndedError

        monkeypatch.setattr("smajax.attribution.close_loop.close_loop", stopped)
        with pytest.raises(EndedError):
            run_close_loop(experiment, out, "", overwrite=False, show_hint=False)
        return (out / "report.json").read_bytes()

    before = ended_after(2, "before")
    assert (ended_after(rounds, "resumed") == before) == (rounds < 2)


def test_what_is_ended_before_long_shows_early_what_it_knows(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv(BUDGET, raising=False)
    assert first_page(60.0) == 60.0
    for value, page in (("120.0", 12.0), ("3600.0", 60.0), ("", 60.0), ("2min", 60.0)):
        monkeypatch.setenv(BUDGET, value)
        assert first_page(60.0) == pytest.approx(page)
        assert first_page(60.0) == 60.0  # what this process starts is not ended


def test_the_process_that_is_ended_knows_its_time(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    given: list[Any] = []

    def started(words: list[str], env: dict[str, str]) -> Any:
        given.append(env[BUDGET])
        return SimpleNamespace(wait=lambda timeout: 0)

    monkeypatch.setattr("smajax.cli.budget.subprocess.Popen", started)
    assert run_within(90.0, []) == 0

    def loop(*_: object, config: AttributionConfig, **__: object) -> None:
        given.append(config.first_page)
        raise EndedError

    monkeypatch.setattr("smajax.attribution.close_loop.close_loop", loop)
    monkeypatch.setenv(BUDGET, given[0])
    with pytest.raises(EndedError):
        run_close_loop(sma.load_experiment(bench(tmp_path)), tmp_path / "report", "", overwrite=False, show_hint=False)
    assert given == ["90.0", pytest.approx(9.0)]


@pytest.mark.parametrize("beside", [False, True])
def test_a_long_search_gives_what_it_has_found_so_far(beside: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    """After its first round already where it may, and then only when much more time has passed than that took, or takes beside the search."""
    given, now = [], [0.0]
    monkeypatch.setattr(stages, "known_so_far", lambda context, models, rest: models[1])
    monkeypatch.setattr(stages, "likeliest_so_far", lambda search, best: (search, best.effects, None))
    monkeypatch.setattr("smajax.attribution.close_loop.clock.monotonic", lambda: now[0])

    def shown(effects: Any) -> float:
        given.append((now[0], effects))
        now[0] += 0.0 if beside else 5.0
        return 5.0 if beside else 0.0

    context = SimpleNamespace(setting=SimpleNamespace(config=AttributionConfig()))
    after_round = stages._now_and_then(cast(Any, context), shown)
    for later, effects in ((50.0, ("a",)), (20.0, ()), (5.0, ("a", "b")), (20.0, ("a", "c")), (30.0, ("a", "c"))):
        now[0] += later
        after_round(cast(Any, None), cast(Any, SimpleNamespace(effects=effects)))
    second = 125.0 if beside else 130.0
    assert given == [(75.0, ("a", "b")), (second, ("a", "c"))]


def test_the_page_is_there_after_the_base_fit_and_says_what_is_to_come(tmp_path: Path) -> None:
    seen: list[Findings] = []

    def end(known: Findings) -> None:
        seen.append(known)
        write_report(known, tmp_path / "report")
        raise EndedError

    with pytest.raises(EndedError):
        sma.close_loop(sma.load_experiment(bench(tmp_path)), interim=end)
    (known,) = seen
    assert known.verdict is Verdict.NOT_FINISHED
    assert not known.added
    assert known.before[0].name == "convection_coefficient"
    assert known.before[0].standard_error is not None
    record = json.loads((tmp_path / "report" / "report.json").read_text(encoding="utf-8"))
    assert record["verdict"] == "not finished"
    assert record["remaining"] == known.remaining
    assert record["summary"][0].startswith("Not finished: the search for effects")
    page = (tmp_path / "report" / "report.html").read_text(encoding="utf-8")
    assert "Not finished" in page
    assert f"None of the {len(known.effects)} candidates has been fitted so far." in page
    assert "by posterior probability" not in page  # a table without a number
    assert "not finished: the search for effects" in sma.load_model(tmp_path / "report").warnings[0]
    assert sma.load_model(tmp_path / "report").values["convection_coefficient"] == known.before[0].value


@pytest.mark.parametrize(
    ("value", "error", "probability", "named"),
    [(2.4e4, 210.0, NAN, True), (150.0, 210.0, NAN, False), (2.4e4, 210.0, 0.3, False), (2.4e4, 210.0, 0.98, True)],
)
def test_an_unfinished_page_names_only_effects_that_its_own_numbers_tell_from_none(
    value: float, error: float, probability: float, named: bool
) -> None:
    whole = made_findings()
    effects = tuple(
        dataclasses.replace(
            one,
            coefficients={"enthalpy": CoefficientFinding(value, error, "J/kg")},
            evidence={**one.evidence, "posterior_probability": probability},
        )
        if one.added
        else one
        for one in whole.effects
    )
    known = dataclasses.replace(
        whole, effects=effects, verdict=Verdict.NOT_FINISHED, remaining=Remaining.REST_OF_THE_SEARCH
    )
    page, summary = findings_to_html(known), narrate(known).summary
    headline = page.split("<h1>")[1].split("</h1>")[0]
    assert ("latent heat" in headline) == named
    assert any("absorbs heat without getting warmer" in one for one in summary) == named
    assert (
        any("also has latent heat of transformation, which by the numbers so far may be zero" in one for one in summary)
        != named
    )
    assert ("not told from none so far" in page) != named
    # A finished page has its own words for what ends at zero.
    assert "not told from none" not in findings_to_html(dataclasses.replace(whole, effects=effects))


def test_a_time_that_is_over_before_the_base_fit_leaves_no_page_and_says_so(tmp_path: Path) -> None:
    words = ["close-loop", str(bench(tmp_path)), "--out", str(tmp_path / "report"), "--budget", "0.2s"]
    began = time.monotonic()
    ended = smajax(*words)
    assert time.monotonic() - began < 30.0
    assert ended.code == 3
    assert "before this run had a result to show: there is no page, and nothing was finished" in ended.said
    assert "resumes" not in ended.said
    assert not (tmp_path / "report" / "report.html").exists()


def test_a_time_that_is_over_says_that_fits_are_cached_only_where_they_are(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    report = tmp_path / "report"
    (report / "fits").mkdir(parents=True)
    (report / "fits" / f"{'0' * 32}.npz").write_bytes(b"")
    monkeypatch.setattr("smajax.cli.budget.run_within", lambda seconds, words: None)
    words = ["close-loop", "none.toml", "--out", str(report), "--budget", "1s"]
    ended = smajax(*words)
    assert ended.code == 3
    assert "there is no page, and the same command resumes from the finished fits." in ended.said
    assert "before the base model was fitted" not in ended.said  # one of these fits may be that
    (report / "report.json").write_text("{}", encoding="utf-8")
    assert f"the page in {report} is of an earlier run" in " ".join(smajax(*words).said.split())


def test_a_time_that_is_over_shows_what_an_earlier_run_of_the_same_experiment_knew(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    report = tmp_path / "report"
    report.mkdir()
    known = {"title": "My bench", "verdict": "not finished", "summary": ["A sag."], "remaining": "the checks"}
    (report / "report.json").write_text(json.dumps(known), encoding="utf-8")

    def claims(seconds: float, words: list[str]) -> None:
        (report / ".smajax.json").write_text("{}", encoding="utf-8")

    monkeypatch.setattr("smajax.cli.budget.run_within", claims)
    ended = smajax("close-loop", "mine.toml", "--out", str(report), "--budget", "1s")
    assert ended.code == 3
    assert "My bench" in ended.out
    assert "A sag." in ended.out
    assert "before this run knew more than the earlier one, of which that is; the same command resumes" in ended.said


def test_a_page_that_was_deleted_to_be_written_anew_is_none(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    report = tmp_path / "report"
    report.mkdir()
    (report / "report.json").write_text("{}", encoding="utf-8")

    def overwrites(seconds: float, words: list[str]) -> None:
        (report / "report.json").unlink()
        (report / ".smajax.json").write_text("{}", encoding="utf-8")

    monkeypatch.setattr("smajax.cli.budget.run_within", overwrites)
    ended = smajax("close-loop", "mine.toml", "--out", str(report), "--overwrite", "--budget", "1s")
    assert ended.code == 3
    assert "there is no page, and nothing was finished" in ended.said


def test_a_command_that_ends_in_time_is_as_without_a_budget() -> None:
    assert run_within(60.0, ["--version"]) == 0
    assert run_within(60.0, ["close-loop", "none.toml"]) == 2


def test_a_command_that_does_not_end_in_time_is_ended(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    endless = tmp_path / "endless"
    endless.write_text("#!/bin/sh\nexec sleep 60\n", encoding="utf-8")
    endless.chmod(0o755)
    monkeypatch.setattr(sys, "executable", str(endless))
    began = time.monotonic()
    assert run_within(0.2, ["close-loop"]) is None
    assert time.monotonic() - began < 10.0


@pytest.mark.parametrize("given", [["--budget", "2min"], ["--budget=2min"]])
def test_the_process_gets_all_other_words(given: list[str]) -> None:
    words = ["close-loop", "a.toml", "--out", "b"]
    assert without([*words[:2], *given, *words[2:]], "--budget") == words
