"""The report: both files hold the record's own numbers, and the page needs nothing beside itself."""

from __future__ import annotations

import base64
import csv
import dataclasses
import io
import json
import re
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from smajax.attribution.findings import Findings, Formula, UnknownTerm
from smajax.core.display_units import correlation, digits, display, p_value, with_error
from smajax.data.readers.read import read_table
from smajax.fit.uncertainty import Remark, RemarkKind
from smajax.report import pictures
from smajax.report.html import findings_to_html
from smajax.report.json_file import RENAMED, findings_to_json, with_current_keys
from smajax.report.narrative import narrate
from smajax.report.write import write_report
from tests.helpers.made_findings import NAN, NOISE, made_effect, made_findings

NO_REMARK = Remark()


@pytest.fixture(scope="module")
def findings() -> Findings:
    return made_findings()


class Page(HTMLParser):
    """What a browser would fetch, the text, the pictures and the numbers that cells carry."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.source = text
        self.addresses: list[str] = []
        self.tags: list[str] = []
        self.text: list[str] = []
        self.numbers: list[tuple[float, str]] = []  # (of the record, as shown)
        self.cell: float | None = None
        self.feed(text)

    def handle_starttag(self, tag, attributes):
        self.tags.append(tag)
        values = dict(attributes)
        self.addresses += [value for name in ("src", "href", "srcset", "action", "data") if (value := values.get(name))]
        self.cell = float(values["data-v"]) if tag == "td" and "data-v" in values else None

    def handle_data(self, data):
        self.text.append(data)
        if self.cell is not None:
            self.numbers.append((self.cell, data))
            self.cell = None

    def images(self) -> list[np.ndarray]:
        prefix = "data:image/png;base64,"
        coded = [address.removeprefix(prefix) for address in self.addresses if address.startswith(prefix)]
        return [np.asarray(Image.open(io.BytesIO(base64.b64decode(text))).convert("L")) for text in coded]


@pytest.fixture(scope="module")
def folder(findings, tmp_path_factory) -> Path:
    """A folder that the report was written into once, over an older one."""
    folder = tmp_path_factory.mktemp("out") / "new" / "report"
    folder.mkdir(parents=True)
    (folder / "report.html").write_text("older")
    assert write_report(findings, folder) == folder / "report.html"
    return folder


@pytest.fixture(scope="module")
def page(folder) -> Page:
    return Page((folder / "report.html").read_text(encoding="utf-8"))


def test_the_files_are_written_whole_and_nothing_else(folder, page):
    written = ["parameters.csv", "report.html", "report.json", "runs.csv"]
    assert sorted(entry.name for entry in folder.iterdir()) == written
    assert page.source.startswith("<!DOCTYPE html>")
    assert page.source.rstrip().endswith("</html>")


def test_the_folder_is_made(findings, tmp_path, monkeypatch):
    monkeypatch.setattr("smajax.report.write.findings_to_html", lambda findings, narrative: "page")
    assert write_report(findings, tmp_path / "a" / "b").read_text() == "page"


@pytest.mark.parametrize("below", ["", "deeper"])
def test_a_file_in_the_folders_place_is_refused_by_name(findings, tmp_path, below):
    (tmp_path / "taken").write_text("kept")
    with pytest.raises(NotADirectoryError, match=r"taken.*expected a folder"):
        write_report(findings, tmp_path / "taken" / below)
    assert (tmp_path / "taken").read_text() == "kept"


def test_json_is_strict_and_holds_the_record(findings, folder):
    def refuse(name: str) -> None:
        raise AssertionError(f"{name} is not JSON")

    read = json.loads((folder / "report.json").read_text(encoding="utf-8"), parse_constant=refuse)
    assert read == findings_to_json(findings)
    assert read["verdict"] == "explained"
    assert read["output"] == {
        "name": "position",
        "unit": "m",
        "noise_sigma": NOISE,
        "noise_how": "estimated from the flat part of the runs",
    }
    assert [run["rmse_before"] for run in read["runs"]] == [run.rmse_before for run in findings.runs]
    assert read["runs"][2]["role"] == "held-out"
    assert read["runs"][2]["samples"] == 1200
    assert read["before"]["parameters"]["stress_slope_austenite"]["standard_error"] is None
    assert read["after"]["parameters"]["latent_heat.enthalpy"]["value"] == 24187.3
    latent = next(effect for effect in read["effects"] if effect["added"])
    assert latent["name"] == "latent_heat"
    assert latent["coefficients"]["enthalpy"] == {
        "value": 24187.3,
        "standard_error": 210.6,
        "unit": "J/kg",
        "interval_over_runs": None,
    }


def test_the_tables_are_those_of_the_record_and_can_be_read_back(findings, folder):
    table = read_table(folder / "runs.csv")
    for name in ("measured", "before", "after"):
        np.testing.assert_allclose(
            table.column(f"{name} [m]"), np.concatenate([getattr(run, name) for run in findings.runs]), rtol=1e-9
        )
    np.testing.assert_allclose(table.column("voltage [V]")[:1200], findings.runs[0].inputs["voltage"], rtol=1e-9)
    with (folder / "parameters.csv").open(encoding="utf-8") as file:
        rows = {row["parameter"]: row for row in csv.DictReader(file)}
    assert float(rows["latent_heat.enthalpy"]["after"]) == 24187.3
    assert rows["latent_heat.enthalpy"]["before"] == ""
    assert rows["stress_slope_austenite"]["standard error before"] == ""


def test_what_is_no_number_is_null(findings):
    run = dataclasses.replace(findings.runs[0], rmse_after=float("inf"), offset_after=NAN)
    read = findings_to_json(dataclasses.replace(findings, runs=(run,)))
    assert read["runs"][0]["rmse_after"] is None
    assert read["runs"][0]["offset_after"] is None
    assert read["effects"][2]["evidence"]["alone_rmse_fit"] is None


def test_numpy_scalars_are_plain_numbers_and_arrays_lists(findings):
    run = dataclasses.replace(findings.runs[0], rmse_after=np.float32(0.5))
    assert findings_to_json(dataclasses.replace(findings, runs=(run,)))["runs"][0]["rmse_after"] == 0.5


def test_the_page_fetches_nothing(page):
    assert page.addresses
    assert [address for address in page.addresses if not address.startswith(("#", "data:"))] == []
    assert not re.search(r"@import|url\(|https?://", page.source)


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


def test_every_contents_entry_leads_somewhere(page):
    targets = set(re.findall(r'id="([^"]+)"', page.source))
    links = set(re.findall(r'href="#([^"]+)"', page.source))
    assert len(links) > 10
    assert links <= targets


def test_no_picture_is_blank(page, findings):
    images = page.images()
    assert len(images) == 2 * len(findings.runs) + 4
    for image in images:
        assert image.shape[1] > 500
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


def test_samples_of_a_phase_are_told_for_each_model(page):
    """420 and 360 of 2400 samples cool: the share that each model's own sentence gives."""
    texts = [text for _, text in page.numbers]
    assert "420 (18%)" in texts
    assert "360 (15%)" in texts


def test_a_predicted_gain_stays_in_the_record(page, folder):
    assert (0.998, "0.998") in page.numbers
    assert "score gain" not in " ".join(page.text)
    assert "score_gain_at_the_end" in (folder / "report.json").read_text()


def test_candidates_stand_in_the_order_that_the_page_tells(findings):
    late = [
        dataclasses.replace(made_effect(name, name, "heat", NAN), evidence={"posterior_probability": probability})
        for name, probability in (("b", 0.0), ("c", 0.001), ("d", 0.01))
    ]
    order = [effect.name for effect in pictures.ranked((findings.effects[2], *late, *findings.effects[:2]))]
    assert order == ["latent_heat", "radiation", "d", "c", "b", "sensor_lag"]


def test_detectable_is_told_from_worth_adding(page):
    assert "not the same as worth adding" in " ".join(page.text)


@pytest.mark.parametrize(("offset", "told"), [(1e-4, True), (0.0, False)])
def test_the_offset_of_held_out_runs_is_told_where_there_is_one(findings, offset, told):
    runs = tuple(dataclasses.replace(run, offset_before=offset, offset_after=offset) for run in findings.runs)
    text = findings_to_html(dataclasses.replace(findings, runs=runs))
    assert ("only their offset is fitted to them" in text) is told


def test_a_model_that_lacks_nothing_has_one_column(findings):
    effects = tuple(dataclasses.replace(effect, added=False) for effect in findings.effects)
    runs = tuple(dataclasses.replace(run, after=run.before, rmse_after=run.rmse_before) for run in findings.runs)
    adequate = dataclasses.replace(findings, verdict="adequate", effects=effects, runs=runs, rounds=())
    page = Page(findings_to_html(adequate))
    headings = " ".join(page.text)
    assert "The model is adequate" in headings
    assert "offset after" not in headings
    assert "had been standing in" not in headings
    assert "samples before" not in headings
    assert all(image.std() > 5.0 for image in page.images())


def test_a_diverged_model_is_still_drawn(findings):
    run = dataclasses.replace(findings.runs[0], before=np.full(1200, NAN), rmse_before=NAN)
    broken = dataclasses.replace(findings, runs=(run, *findings.runs[1:]))
    assert all(image.std() > 10.0 for image in Page(findings_to_html(broken)).images())


def test_a_run_without_a_temperature_has_no_hysteresis_picture(findings):
    assert pictures.run_hysteresis(findings, dataclasses.replace(findings.runs[0], states={})) is None


def test_long_runs_keep_their_peaks(findings):
    time = np.linspace(0.0, 1.0, 100_003)
    values = np.zeros_like(time)
    values[77_777], values[100_002] = 5.0, -3.0
    thin_time, thin_values = pictures.extremes(time, values)
    assert len(thin_time) < 2 * pictures.SAMPLES_DRAWN
    assert (thin_values.max(), thin_values.min()) == (5.0, -3.0)
    assert thin_time[thin_values.argmax()] == time[77_777]
    assert np.all(np.diff(thin_time) >= 0.0)


def test_autocorrelation_of_white_noise_and_of_a_sine():
    rng = np.random.default_rng(0)
    white = pictures.autocorrelation([rng.normal(size=20_000), rng.normal(size=10_000)], 50)
    assert white[0] == 1.0
    assert np.abs(white[1:]).max() < 4.0 / np.sqrt(30_000)
    sine = pictures.autocorrelation([np.sin(2.0 * np.pi * np.arange(10_000) / 100.0)], 100)
    assert sine[50] == pytest.approx(-1.0, abs=0.01)
    assert sine[100] == pytest.approx(1.0, abs=0.011)


@pytest.mark.parametrize(
    ("unit", "quantity", "value", "text"),
    [
        ("m", "position", 0.0123456, "12.35"),
        ("rad", "angle", np.pi / 4.0, "45"),
        ("-", "strain", 0.041, "4.1"),
        ("-", "martensite_fraction", 0.041, "0.041"),
        ("Pa", "stress", 172e6, "172"),
        ("N s/m", "damping", 2.0, "2"),
        ("W/(m^2 K)", "", 1.0e-7, "1e-7"),
        ("m", "position", NAN, "–"),
    ],
)
def test_units_at_the_edge(unit, quantity, value, text):
    assert digits(display(unit, quantity).of(value)) == text


@pytest.mark.parametrize(
    ("value", "error", "text"),
    [
        (149.98765, 0.301, "149.99 ± 0.30"),
        (24.1873, 0.2106, "24.19 ± 0.21"),
        (2.0, None, "2"),
        (2.0, NAN, "2"),
        (71234.0, 512.0, "71230 ± 510"),
        (858.2, 112.0, "860 ± 110"),
        (858.2, 99.7, "860 ± 100"),
        (7.1234e9, 5.1e6, "7.1234e9 ± 5.1e6"),
        (0.0, 1.0e-9, "0.0 ± 1.0e-9"),
        (3.2e-9, 1.1e-9, "3.2e-9 ± 1.1e-9"),
        (NAN, 0.1, "–"),
    ],
)
def test_an_error_sets_the_decimals_of_its_value(value, error, text):
    assert with_error(value, error) == text


def test_numbers_that_round_to_nothing_or_have_underflowed():
    assert [correlation(value) for value in (1.7e-16, -0.004, 0.126, -0.9, NAN, None)] == [
        "0",
        "0",
        "0.13",
        "-0.90",
        "–",
        "–",
    ]
    assert [p_value(value) for value in (0.0, 0.413)] == ["p < 1e-300", "p = 0.41"]


def _unknown_term(name: str, named: bool, alike: tuple[str, ...] = ()) -> UnknownTerm:
    at = np.linspace(-1.0, 90.0, 61)
    values = 1.2 / (1.0 + np.exp(-(at - 52.0) / 4.0))
    return UnknownTerm(
        name=name,
        title="a heat loss depending on the <temperature>",
        equation="heat",
        symbol="T - T_inf",
        state="temperature over ambient",
        state_unit="K",
        unit="W/m",
        named=named,
        indistinguishable=alike,
        log_odds=31.4,
        score_gain=0.85,
        left_out_before=1.8e-3,
        left_out_after=2.0e-4,
        held_out_before=2.1e-3 if named else None,
        held_out_after=2.5e-4 if named else None,
        at=at,
        values=values,
        error=0.2 + 0.0 * at,
        error_held=0.05 + 0.0 * at,
        cells=np.linspace(-1.0, 90.0, 21),
        samples=np.arange(20),
        formulas=(Formula("1.27 (1 + tanh((T - T_inf - 52.4)/4.51))/2", 3.1, 2, 12.0, values[::2]),),
    )


def test_unknown_terms_are_told_drawn_and_recorded(findings, page):
    terms = (_unknown_term("unknown_a", True, ("unknown_b",)), _unknown_term("unknown_b", False))
    with_terms = dataclasses.replace(findings, unknown=(*terms, _unknown_term("unknown_c", False)))
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


def test_correlated_parameters_lead_to_what_can_be_done(findings: Findings) -> None:
    def section(remark: Remark = NO_REMARK, correlated: tuple[tuple[str, ...], ...] = ()) -> str:
        first, *rest = findings.after
        after = (dataclasses.replace(first, remark=remark), *rest)
        page = findings_to_html(dataclasses.replace(findings, after=after, correlated=correlated))
        return page[page.index('<section id="parameters"') : page.index('<section id="residual"')]

    assert 'href="#cannot-know"' in section(correlated=((findings.after[0].name, findings.after[1].name),))
    assert 'href="#cannot-know"' in section(Remark(RemarkKind.COMBINATION, ("specific_heat",)))
    assert 'href="#cannot-know"' not in section(Remark(RemarkKind.LOWER_BOUND))


def test_a_record_with_the_keys_of_before_is_read(findings: Findings) -> None:
    """Until version 0.2, with a warning for each."""
    new = findings_to_json(dataclasses.replace(findings, unknown=(_unknown_term("unknown_a", True),)))
    back = {now: key for (place, key), now in RENAMED.items() if not place}
    old = {back.get(key, key): value for key, value in new.items()}
    old["unknown"] = [
        {"alike" if key == "indistinguishable" else key: value for key, value in one.items()} for one in new["unknown"]
    ]
    with pytest.warns(DeprecationWarning, match=r"portrait_before \(residual_before now\).*unknown.alike"):
        assert with_current_keys(old) == new
    assert with_current_keys(new) == new


def test_the_names_of_before_are_read_with_a_warning(findings: Findings) -> None:
    with pytest.warns(DeprecationWarning, match="residual_after"):
        assert findings.portrait_after is findings.residual_after
    with pytest.warns(DeprecationWarning, match="narrate"):
        assert findings.summary == narrate(findings).summary
    with pytest.raises(AttributeError, match="no attribute 'nothing'"):
        _ = findings.nothing
