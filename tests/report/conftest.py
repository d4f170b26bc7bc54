"""A record and the report that is made of it."""

from __future__ import annotations

from pathlib import Path

import pytest

from smajax.attribution.findings import Findings
from smajax.report.write import write_report
from tests.helpers.made_findings import made_findings
from tests.helpers.report_page import Page


@pytest.fixture(scope="session")
def findings() -> Findings:
    return made_findings()


@pytest.fixture(scope="session")
def folder(findings, tmp_path_factory) -> Path:
    """A folder that the report was written into once, over an older one."""
    folder = tmp_path_factory.mktemp("out") / "new" / "report"
    folder.mkdir(parents=True)
    (folder / "report.html").write_text("older")
    assert write_report(findings, folder) == folder / "report.html"
    return folder


@pytest.fixture(scope="session")
def page(folder) -> Page:
    return Page((folder / "report.html").read_text(encoding="utf-8"))
