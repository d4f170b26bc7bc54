"""An effect with a coefficient at a bound of its range is not shown as a trusted answer: on the page, in the terminal, in the list of reports."""

from __future__ import annotations

import dataclasses
import json
from pathlib import Path
from typing import Any

import pytest

from smajax.attribution.findings import Findings, Verdict
from smajax.cli.commands.close_loop import print_findings
from smajax.fit.uncertainty import Remark, RemarkKind
from smajax.report.html import findings_to_html
from smajax.report.index_page import cells, read_reports
from smajax.report.json_file import findings_to_json
from smajax.report.narrative import narrate
from tests.helpers.made_findings import made_findings


@pytest.mark.usefixtures("blank_pictures")
def test_an_effect_that_ends_at_a_bound_is_not_shown_as_a_trusted_answer() -> None:
    findings = made_findings()
    assert '<header class="answer good"' in findings_to_html(findings)
    assert "coefficients_at_bounds" not in findings_to_json(findings)
    at_its_bound = dataclasses.replace(findings.after[-1], value=1e5, remark=Remark(RemarkKind.UPPER_BOUND))
    findings = dataclasses.replace(findings, after=(*findings.after[:-1], at_its_bound))
    first = narrate(findings).summary[0]
    assert first.startswith("The base model may lack: latent heat of transformation.")
    assert "latent_heat.enthalpy ends at its upper bound of 100 J/g" in first
    page = findings_to_html(findings)
    assert '<header class="answer fair"' in page
    assert "<h1>Explained, but by what ends at a bound: latent heat of transformation</h1>" in page
    assert "The missing physics is found" not in page
    assert "<dd>explained, at a bound</dd>" in page
    assert findings_to_json(findings)["coefficients_at_bounds"] == ["latent_heat.enthalpy"]
    # At zero the effect is off: nothing is asked of it, and nothing stands in.
    off = dataclasses.replace(at_its_bound, value=0.0, remark=Remark(RemarkKind.LOWER_BOUND))
    findings = dataclasses.replace(findings, after=(off,))
    assert findings.coefficients_at_bounds == ()
    assert "latent_heat.enthalpy ends at zero, where the effect is off" in " ".join(narrate(findings).summary)


def test_a_width_at_its_bound_is_a_caution_and_not_a_doubt_about_the_effect() -> None:
    """It says that these runs do not determine it; the effect's size does not end there."""
    findings = made_findings()
    spring = dataclasses.replace(findings.added[0], name="nonlinear_spring")
    width = dataclasses.replace(
        findings.after[-1], name="nonlinear_spring.displacement", value=1e5, remark=Remark(RemarkKind.UPPER_BOUND)
    )
    findings = dataclasses.replace(findings, effects=(spring,), after=(width,))
    assert findings.coefficients_at_bounds == ()
    said = " ".join(narrate(findings).summary)
    assert "nonlinear_spring.displacement ends at its upper bound" in said
    assert "the runs do not determine it" in said
    assert "may lack" not in said


def test_the_terminal_says_beside_the_verdict_that_an_effect_ends_at_a_bound(capsys: Any, tmp_path: Path) -> None:
    at_its_bound = dataclasses.replace(made_findings().after[-1], value=1e5, remark=Remark(RemarkKind.UPPER_BOUND))
    print_findings(dataclasses.replace(made_findings(), after=(at_its_bound,)), tmp_path / "report.html")
    verdict, sentence = capsys.readouterr().out.splitlines()[2:4]
    assert verdict == "Verdict: explained, at a bound"
    assert "ends at its upper bound of 100 J/g: it stands in for something else" in sentence


def test_the_list_of_reports_says_it_beside_the_verdict(tmp_path: Path) -> None:
    at_its_bound = dataclasses.replace(made_findings().after[-1], value=1e5, remark=Remark(RemarkKind.UPPER_BOUND))
    for name, after in (("found", made_findings().after), ("limited", (at_its_bound,))):
        (tmp_path / name).mkdir()
        record = findings_to_json(dataclasses.replace(made_findings(), after=after))
        (tmp_path / name / "report.json").write_text(json.dumps(record), encoding="utf-8")
    rows, _ = read_reports(tmp_path)
    assert [cells(row)[1] for row in rows] == ["explained", "explained, at a bound"]


def _with_a_limited_unknown(verdict: Verdict) -> Findings:
    """`made_findings` whose recoverable strain ends at its upper bound; adequate: nothing is added."""
    findings = made_findings()
    limited = dataclasses.replace(findings.after[1], value=0.12, remark=Remark(RemarkKind.UPPER_BOUND))
    after = (findings.after[0], limited, *findings.after[2:])
    effects = tuple(
        dataclasses.replace(one, added=one.added and verdict is Verdict.EXPLAINED) for one in findings.effects
    )
    return dataclasses.replace(findings, verdict=verdict, after=after, effects=effects)


@pytest.mark.usefixtures("blank_pictures")
@pytest.mark.parametrize(
    ("verdict", "opening", "headline"),
    [
        (
            Verdict.EXPLAINED,
            "The base model may lack: latent heat",
            "Explained, but an unknown ends at a bound. Added: ",
        ),
        (Verdict.ADEQUATE, "Nothing is missing", "Adequate, but an unknown ends at a bound</h1>"),
    ],
)
def test_an_unknown_of_the_experiment_that_ends_at_a_bound_is_said_beside_the_verdict(
    capsys: Any, tmp_path: Path, verdict: Verdict, opening: str, headline: str
) -> None:
    findings = _with_a_limited_unknown(verdict)
    summary = narrate(findings).summary
    assert summary[0].startswith(opening)
    assert "recoverable_strain ends at its upper bound of 12 %. The truth may lie beyond" in summary[0]
    assert "widen its bounds in the experiment file" in summary[0]
    assert sum("recoverable_strain" in one for one in summary) == 1  # not twice
    page = findings_to_html(findings)
    assert f"<h1>{headline}" in page
    assert '<header class="answer fair"' in page
    assert f"<dd>{verdict}, at a bound</dd>" in page
    record = findings_to_json(findings)
    assert record["unknowns_at_bounds"] == ["recoverable_strain"]
    assert "coefficients_at_bounds" not in record
    (tmp_path / "one").mkdir()
    (tmp_path / "one" / "report.json").write_text(json.dumps(record), encoding="utf-8")
    rows, _ = read_reports(tmp_path)
    assert cells(rows[0])[1] == f"{verdict}, at a bound"
    print_findings(findings, tmp_path / "report.html")
    assert f"Verdict: {verdict}, at a bound" in capsys.readouterr().out.splitlines()


def test_an_unknown_at_zero_or_a_preset_at_a_bound_or_a_doubtful_verdict_is_no_such_thing() -> None:
    findings = _with_a_limited_unknown(Verdict.EXPLAINED)
    limited = findings.after[1]
    for other in (
        dataclasses.replace(findings, verdict=Verdict.PARTLY_EXPLAINED),
        dataclasses.replace(findings, after=(dataclasses.replace(limited, prior_base=0.05, prior_deviation=0.5),)),
        dataclasses.replace(
            findings, after=(dataclasses.replace(limited, value=0.0, remark=Remark(RemarkKind.LOWER_BOUND)),)
        ),
    ):
        assert "unknowns_at_bounds" not in findings_to_json(other)
        assert "recoverable_strain ends" in " ".join(narrate(other).summary)
