"""The headline claims no more than the held-out runs bear out: on the page, in the terminal, in the record and in the list of reports."""

from __future__ import annotations

import dataclasses
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from smajax.attribution.findings import Findings, RunFinding, Verdict
from smajax.cli.commands.close_loop import print_findings
from smajax.report.html import findings_to_html
from smajax.report.index_page import cells, read_reports
from smajax.report.json_file import findings_to_json
from smajax.report.narrative import narrate
from smajax.report.narrative.verdict import headline
from tests.helpers.made_findings import made_findings


def _off(run: RunFinding, by: float) -> RunFinding:
    """The run with a wave of that size (m) beside what the final model predicts of it."""
    after = run.after + by * np.sin(np.arange(len(run.after)) / 7.0)
    return dataclasses.replace(run, after=after, rmse_after=float(np.sqrt(np.mean((run.measured - after) ** 2))))


def _unconfirmed(verdict: Verdict = Verdict.EXPLAINED) -> Findings:
    """`made_findings` whose final model is off on the held-out runs by as much as the base model."""
    findings = made_findings()
    runs = tuple(_off(one, 1.5 * one.rmse_before) if one.role == "held-out" else one for one in findings.runs)
    return dataclasses.replace(findings, runs=runs, verdict=verdict)


def _partly_confirmed() -> Findings:
    """The same where it is much better than the base model on them, and clearly worse than on the fit runs."""
    findings = made_findings()
    runs = tuple(_off(one, 0.3 * one.rmse_before) if one.role == "held-out" else one for one in findings.runs)
    return dataclasses.replace(findings, runs=runs)


def _of_one_run() -> Findings:
    findings = made_findings()
    return dataclasses.replace(findings, runs=tuple(one for one in findings.runs if one.role == "fit")[:1])


@pytest.mark.usefixtures("blank_pictures")
@pytest.mark.parametrize(
    ("findings", "doubt", "title"),
    [
        (_unconfirmed(), "not confirmed", "Explained on the fit runs, but not confirmed by held-out runs"),
        (_partly_confirmed(), "not on every held-out run", "Explained on the fit runs, but not on every held-out run"),
        (_of_one_run(), "not confirmed", "Explained on the one fit run, and no other run confirms it"),
        (made_findings(), "", "The missing physics is found"),
    ],
    ids=["unconfirmed", "partly", "one run", "confirmed"],
)
def test_page_terminal_record_and_list_say_the_same_of_what_is_not_confirmed(
    findings: Findings, doubt: str, title: str, tmp_path: Path, capsys: Any
) -> None:
    verdict = f"explained, {doubt}" if doubt else "explained"
    page = findings_to_html(findings)
    assert f'<header class="answer {"fair" if doubt else "good"}"' in page
    assert f"<h1>{title}: latent heat of transformation</h1>" in page
    assert f"<dd>{verdict}</dd>" in page
    record = findings_to_json(findings)
    assert record["verdict"] == "explained"
    assert record.get("held_out_runs", "") == doubt
    print_findings(findings, tmp_path / "report.html")
    assert f"Verdict: {verdict}" in capsys.readouterr().out.splitlines()
    (tmp_path / "report.json").write_text(json.dumps(record), encoding="utf-8")
    rows, _ = read_reports(tmp_path)
    assert [cells(row)[1] for row in rows] == [verdict]


def test_effects_without_which_one_run_alone_would_know_are_not_green() -> None:
    """A dead sensor beside a heated wire: effects that hold the model still leave noise, and nothing is predicted."""
    made = made_findings()
    fitted = tuple(run for run in made.runs if run.role == "fit")
    assert len(fitted) > 1
    sure = dataclasses.replace(made, runs=fitted)
    assert headline(sure) == ("The missing physics is found", "good")
    badly = dataclasses.replace(sure, explained_variance=0.2)
    assert headline(badly) == (
        "Explained on the fit runs, but without any one of them they are predicted badly",
        "fair",
    )
    assert findings_to_json(badly)["held_out_runs"] == "not on runs that were left out"
    first = narrate(badly).summary[0]
    assert "may lack: latent heat" in first
    assert "explain 20% of the motion" in first
    # Held-out runs that confirm it say more.
    assert headline(dataclasses.replace(made, explained_variance=0.2)) == ("The missing physics is found", "good")


def _adequate(off: bool) -> Findings:
    """A base model that leaves noise on the fit runs, and on the held-out ones or not."""
    findings = made_findings()
    runs = tuple(
        _off(one, 2.0 * findings.noise_sigma) if off and one.role == "held-out" else one for one in findings.runs
    )
    effects = tuple(dataclasses.replace(one, added=False) for one in findings.effects)
    return dataclasses.replace(findings, runs=runs, effects=effects, verdict=Verdict.ADEQUATE)


@pytest.mark.usefixtures("blank_pictures")
def test_a_model_that_is_adequate_on_the_fit_runs_alone_says_so_everywhere(tmp_path: Path, capsys: Any) -> None:
    """Nothing tells the reader sooner that the fit runs did not show what is missing."""
    assert headline(_adequate(off=False)) == ("The model is adequate", "good")
    findings = _adequate(off=True)
    assert headline(findings) == ("Adequate on the fit runs, but not on every held-out run", "fair")
    first = narrate(findings).summary[0]
    off = [run.name for run in findings.runs if run.role == "held-out"]
    assert all(name in first for name in off)
    assert "a fit run and hold another one out" in first
    assert findings_to_json(findings)["held_out_runs"] == "not on every held-out run"
    assert "<dd>adequate, not on every held-out run</dd>" in findings_to_html(findings)
    print_findings(findings, tmp_path / "report.html")
    assert "Verdict: adequate, not on every held-out run" in capsys.readouterr().out.splitlines()


def test_the_text_agrees_with_the_headline() -> None:
    said = " ".join(narrate(_unconfirmed()).summary)
    assert "neither confirm nor refute" in said or "does worse than the base model" in said
    assert "held out: more may be missing" in narrate(_partly_confirmed()).summary[0]
    assert "nothing confirms it" in narrate(_of_one_run()).summary[0]


def test_another_verdict_has_its_own_headline_whatever_the_held_out_runs_say() -> None:
    assert headline(_unconfirmed(Verdict.PARTLY_EXPLAINED)) == ("Part of the missing physics is found", "fair")
    assert "held_out_runs" not in findings_to_json(_unconfirmed(Verdict.PARTLY_EXPLAINED))


def test_an_effect_that_is_less_likely_than_not_is_said_to_be_with_what_may_be_in_its_place() -> None:
    findings = made_findings()

    def said(own: float, *others: float) -> str:
        added, left = findings.added[0], [one for one in findings.effects if not one.added]
        given = [dataclasses.replace(added, evidence={**added.evidence, "posterior_probability": own})]
        for k, value in enumerate(others):
            one = dataclasses.replace(left[0], title=f"other {k}")
            given.append(dataclasses.replace(one, evidence={**one.evidence, "posterior_probability": value}))
        return " ".join(narrate(dataclasses.replace(findings, effects=tuple(given))).summary)

    mind = "Mind: latent heat of transformation (posterior probability 0.40) is less likely than not"
    beside = (
        ": in its place other 1 (posterior probability 0.32) and other 0 (posterior probability 0.20) may be there."
    )
    assert mind + beside in said(0.4, 0.2, 0.32, 0.01)
    assert f"{mind}." in said(0.4, 0.01)
    assert "less likely than not" not in said(0.6, 0.3)
    assert "less likely than not" not in said(float("nan"), 0.3)
