"""A report's folder: written whole, over an older one, and nowhere else; its tables are those of the record."""

from __future__ import annotations

import csv

import numpy as np
import pytest

from smajax.data.readers.read import read_table
from smajax.fit.prediction_band import moving
from smajax.report.write import write_report


def test_the_files_are_written_whole_and_nothing_else(folder, page):
    written = ["parameters.csv", "report.html", "report.json", "runs.csv"]
    assert sorted(entry.name for entry in folder.iterdir()) == written
    assert page.source.startswith("<!DOCTYPE html>")
    assert page.source.rstrip().endswith("</html>")


def test_a_missing_folder_is_made(findings, tmp_path, monkeypatch):
    monkeypatch.setattr("smajax.report.write.findings_to_html", lambda findings, narrative, steps: "page")
    assert write_report(findings, tmp_path / "a" / "b").read_text() == "page"


@pytest.mark.parametrize("below", ["", "deeper"])
def test_a_file_in_the_folders_place_is_refused_by_name(findings, tmp_path, below):
    (tmp_path / "taken").write_text("kept")
    with pytest.raises(NotADirectoryError, match=r"taken.*expected a folder"):
        write_report(findings, tmp_path / "taken" / below)
    assert (tmp_path / "taken").read_text() == "kept"


def test_the_tables_are_those_of_the_record_and_can_be_read_back(findings, folder):
    table = read_table(folder / "runs.csv")
    for name in ("measured", "before", "after"):
        np.testing.assert_allclose(
            table.column(f"{name} [m]"), np.concatenate([getattr(run, name) for run in findings.runs]), rtol=1e-9
        )
    np.testing.assert_allclose(table.column("voltage [V]")[:1200], findings.runs[0].inputs["voltage"], rtol=1e-9)
    moves = np.concatenate([moving(run.measured, findings.noise_sigma) for run in findings.runs])
    assert 0.0 < moves.mean() < 1.0
    np.testing.assert_array_equal(table.column("moves [1]"), moves)
    with (folder / "parameters.csv").open(encoding="utf-8") as file:
        rows = {row["parameter"]: row for row in csv.DictReader(file)}
    assert float(rows["latent_heat.enthalpy"]["after"]) == 24187.3
    assert rows["latent_heat.enthalpy"]["before"] == ""
    assert rows["stress_slope_austenite"]["standard error before"] == ""
