"""The page holds the record's own numbers, and needs nothing beside itself."""

from __future__ import annotations

import dataclasses
import json
import re

import numpy as np
import pytest

from smajax.attribution.findings import Findings, coverage, pooled_rmse
from smajax.fit.uncertainty import Remark, RemarkKind
from smajax.report.html import findings_to_html
from smajax.report.json_file import findings_to_json
from smajax.report.narrative import narrate
from tests.helpers.made_findings import NAN
from tests.helpers.report_page import Page, made_unknown_term

pytestmark = pytest.mark.usefixtures("blank_pictures")

NO_REMARK = Remark()


def test_the_page_fetches_nothing(page):
    assert page.addresses
    assert [address for address in page.addresses if not address.startswith(("#", "data:"))] == []
    names = page.source.replace(
        "http://www.w3.org/2000/svg", ""
    )  # of the language of pictures that are saved, which is no address
    assert not re.search(r"@import|url\((?!#)|https?://", names)


def test_names_are_text_and_never_markup(page):
    assert "b" not in page.tags
    assert "<b>x</b>" in page.text


def test_the_verdict_comes_first(page, findings):
    text = " ".join(page.text)
    assert (
        text.index(narrate(findings).summary[0])
        < text.index("Error of every run")
        < text.index("What was added, and why")
    )


def test_the_first_screen_has_the_errors_before_and_after_and_how_the_band_does(findings):
    source = findings_to_html(findings)
    figures = re.findall(r"<dt>(.*?)</dt><dd>(.*?)</dd>", source[: source.index("</header>")])
    shown = {caption: text for caption, text in figures}
    before, after = (1e3 * pooled_rmse(findings.runs, "held-out", which) for which in ("before", "after"))
    assert shown["error on the held-out runs"] == f"{before:.3g} → {after:.3g} mm"
    assert shown["held-out samples in the 90 % band"] == "93%"
    assert "of those at which the output moves" not in shown  # nothing is known of these
    moving = dataclasses.replace(findings.runs[-1].average, moving_coverage=0.8, moving_samples=100)
    told = dataclasses.replace(
        findings, runs=(*findings.runs[:-1], dataclasses.replace(findings.runs[-1], average=moving))
    )
    assert "<dt>of those at which the output moves</dt><dd>80%</dd>" in findings_to_html(told)
    assert any(
        "93% of the samples lie in its 90 % band (80% of those at which the output moves)." in one
        for one in narrate(told).summary
    )
    without = dataclasses.replace(findings, runs=tuple(run for run in findings.runs if run.role == "fit"))
    plain = findings_to_html(without)
    assert "held-out" not in plain[plain.index("<dl") : plain.index("</dl>")]
    assert coverage(without) is None


def test_every_contents_entry_leads_somewhere(page):
    targets = set(re.findall(r'id="([^"]+)"', page.source))
    links = set(re.findall(r'href="#([^"]+)"', page.source))
    assert len(links) > 10
    assert links <= targets


def test_no_picture_is_blank(page, findings):
    images = page.images()
    # Each run over time and over the temperature; before and after, candidates, errors, autocorrelation; phases twice, once for a telephone.
    assert len(images) == 2 * len(findings.runs) + 6
    for image in images:
        assert image.shape[1] > 400
        assert image.std() > 10.0


def test_numbers_in_tables_are_those_of_the_record(page, findings):
    carried = [value for value, _ in page.numbers]
    for run in findings.runs:
        assert run.rmse_before in carried
        assert run.rmse_after in carried
    for found in (*findings.before, *findings.after):
        assert found.value in carried
    assert (findings.runs[0].rmse_before, f"{1e3 * findings.runs[0].rmse_before:.3g}") in page.numbers  # shown in mm
    assert (24187.3, "24.19 ± 0.21") in page.numbers  # J/g
    assert (0.0461, "4.6100 ± 0.0012") in page.numbers  # a strain, per cent
    assert (1e6, "1") in page.numbers  # MPa/K, no standard error to show


def test_the_page_counts_the_samples_of_a_phase_for_each_model(page):
    """420 and 360 of 2400 samples cool: the share that each model's own sentence gives."""
    texts = [text for _, text in page.numbers]
    assert "420 (18%)" in texts
    assert "360 (15%)" in texts


def test_a_predicted_gain_stays_in_the_record(page, folder):
    assert (0.998, "0.998") in page.numbers
    assert "score gain" not in " ".join(page.text)
    assert "score_gain_at_the_end" in (folder / "report.json").read_text()


def test_the_page_distinguishes_detectable_from_worth_adding(page):
    assert "not the same as worth adding" in " ".join(page.text)


@pytest.mark.parametrize(("offset", "told"), [(1e-4, True), (0.0, False)])
def test_the_offset_of_held_out_runs_is_reported_if_there_is_one(findings, offset, told):
    runs = tuple(dataclasses.replace(run, offset_before=offset, offset_after=offset) for run in findings.runs)
    text = findings_to_html(dataclasses.replace(findings, runs=runs))
    assert ("only their offset is fitted to them" in text) is told


@pytest.mark.usefixtures("drawn")
def test_a_model_that_lacks_nothing_has_one_column(findings):
    effects = tuple(dataclasses.replace(effect, added=False) for effect in findings.effects)
    runs = tuple(dataclasses.replace(run, after=run.before, rmse_after=run.rmse_before) for run in findings.runs[:1])
    adequate = dataclasses.replace(findings, verdict="adequate", effects=effects, runs=runs, rounds=())
    page = Page(findings_to_html(adequate))
    headings = " ".join(page.text)
    assert "The model is adequate" in headings
    assert "offset after" not in headings
    assert "had been standing in" not in headings
    assert "samples before" not in headings
    assert all(image.std() > 5.0 for image in page.images())


@pytest.mark.usefixtures("drawn")
def test_a_diverged_model_is_still_drawn(findings):
    run = dataclasses.replace(findings.runs[0], before=np.full(1200, NAN), rmse_before=NAN)
    broken = dataclasses.replace(findings, runs=(run,))
    assert all(image.std() > 10.0 for image in Page(findings_to_html(broken)).images())


def test_unknown_terms_are_described_drawn_and_recorded(findings, page):
    terms = (made_unknown_term("unknown_a", True, ("unknown_b",)), made_unknown_term("unknown_b", False))
    with_terms = dataclasses.replace(findings, unknown=(*terms, made_unknown_term("unknown_c", False)))
    told = Page(findings_to_html(with_terms))
    text = " ".join(told.text)
    assert "What no effect of the library accounts for" in text
    assert "What no effect of the library accounts for" not in " ".join(page.text)
    assert "1.27 (1 + tanh((T - T_inf - 52.4)/4.51))/2" in text
    assert "f in W/m, T - T_inf in K" in text
    # The likeliest and the one that is not distinguished from it are drawn, the third is a row of the table only.
    assert len(told.images()) == len(page.images()) + 2
    assert text.count("not distinguished from the likeliest") == 1
    record = json.loads(json.dumps(findings_to_json(with_terms), allow_nan=False))["unknown"]
    assert [one["named"] for one in record] == [True, False, False]
    assert [one["log_odds"] for one in record] == [31.4, 31.4, 31.4]
    assert record[0]["function"]["values"] == pytest.approx(terms[0].values.tolist())
    assert record[0]["formulas"][0]["numbers"] == 2
    assert sum(record[0]["samples"]["counts"]) == 190
    assert findings_to_json(findings)["unknown"] == []


def test_correlated_parameters_link_to_the_advice(findings: Findings) -> None:
    def section(remark: Remark = NO_REMARK, correlated: tuple[tuple[str, ...], ...] = ()) -> str:
        first, *rest = findings.after
        after = (dataclasses.replace(first, remark=remark), *rest)
        page = findings_to_html(dataclasses.replace(findings, after=after, correlated=correlated))
        return page[page.index('<section id="parameters"') : page.index('<section id="residual"')]

    assert 'href="#cannot-know"' in section(correlated=((findings.after[0].name, findings.after[1].name),))
    assert 'href="#cannot-know"' in section(Remark(RemarkKind.COMBINATION, ("specific_heat",)))
    assert 'href="#cannot-know"' not in section(Remark(RemarkKind.LOWER_BOUND))
