"""The folder of a report holds the models of its page, and the page leads to them."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import pytest

import smajax as sma
from smajax.data.model_file.of_presets import model_of_presets
from smajax.report.write import write_report
from tests.helpers.made_findings import made_findings

pytestmark = pytest.mark.usefixtures("blank_pictures")


def test_both_models_are_written_and_the_page_leads_to_them(tmp_path: Path) -> None:
    base = model_of_presets("flexinol_table_3_2", "dead_weight", "voltage")
    extended = dataclasses.replace(base, title="with an effect")
    page = write_report(dataclasses.replace(made_findings(), base_model=base, extended_model=extended), tmp_path)
    assert sma.load_model(tmp_path).title == "with an effect"
    assert sma.load_model(tmp_path / "base_model.toml").title == base.title
    text = page.read_text(encoding="utf-8")
    assert 'href="model.toml"' in text
    assert 'href="base_model.toml"' in text
    assert 'href="#next"' in text


def test_a_page_of_findings_without_a_model_leads_to_none(tmp_path: Path) -> None:
    page = write_report(made_findings(), tmp_path)
    assert not list(tmp_path.glob("*.toml"))
    assert "model.toml" not in page.read_text(encoding="utf-8")
