"""Writes report.html, report.json and its tables as CSV into a folder, each whole or not at all."""

from __future__ import annotations

import json
from pathlib import Path

from smajax.attribution.findings import Findings
from smajax.core.files import replace
from smajax.report.csv_files import PARAMETERS, RUNS, findings_parameters, findings_runs
from smajax.report.html import findings_to_html
from smajax.report.json_file import findings_to_json
from smajax.report.narrative import narrate
from smajax.report.next_steps import MODEL, after_close_loop

BASE_MODEL = "base_model.toml"


def write_report(findings: Findings, folder: Path, experiment: Path | None = None) -> Path:
    """Writes the files into `folder`, creating it, and returns the path of report.html.

    experiment: the experiment file, for the commands that the page suggests. A reader never sees half a file: each is written beside its place and then put there in one step.
    Raises NotADirectoryError when `folder` or one of its parents is a file.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except (FileExistsError, NotADirectoryError) as error:
        raise NotADirectoryError(
            f"got {str(folder)!r} to write the report into, which is a file or lies below one; expected a folder, "
            "existing or new; give another one"
        ) from error
    narrative = narrate(findings)
    steps = after_close_loop(findings, folder, str(experiment or findings.source))
    page = findings_to_html(findings, narrative, steps)
    record = json.dumps(findings_to_json(findings, narrative), indent=2, ensure_ascii=False, allow_nan=False) + "\n"
    # The record goes first: where the page is, its numbers are too.
    replace(folder / "report.json", record)
    if findings.extended_model is not None and findings.base_model is not None:
        findings.base_model.save(folder / BASE_MODEL)
        findings.extended_model.save(folder / MODEL)
    replace(folder / PARAMETERS, findings_parameters(findings))
    replace(folder / RUNS, findings_runs(findings))
    return replace(folder / "report.html", page)
