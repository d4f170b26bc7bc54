"""Writes report.html and report.json into a folder, each whole or not at all."""

from __future__ import annotations

import json
import os
import tempfile
from pathlib import Path

from smajax.report.findings import Findings
from smajax.report.html import findings_to_html
from smajax.report.json_file import findings_to_json


def write_report(findings: Findings, folder: Path) -> Path:
    """Writes both files into `folder`, creating it, and returns the path of report.html.

    A reader never sees half a file: each is written beside its place and then put there in one step.
    Raises NotADirectoryError when `folder` or one of its parents is a file.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except (FileExistsError, NotADirectoryError) as error:
        raise NotADirectoryError(
            f"got {str(folder)!r} to write the report into, which is a file or lies below one; expected a folder, "
            "existing or new; give another one"
        ) from error
    page = findings_to_html(findings)
    record = json.dumps(findings_to_json(findings), indent=2, ensure_ascii=False, allow_nan=False) + "\n"
    # The record goes first: where the page is, its numbers are too.
    _replace(folder / "report.json", record)
    return _replace(folder / "report.html", page)


def _replace(path: Path, text: str) -> Path:
    # In the same folder, because a rename is one step only within one file system.
    handle, name = tempfile.mkstemp(dir=path.parent, prefix=f".{path.name}.")
    try:
        with os.fdopen(handle, "w", encoding="utf-8", newline="\n") as file:
            file.write(text)
        os.chmod(name, 0o644)  # mkstemp makes a file for its owner alone
        os.replace(name, path)
    except BaseException:
        Path(name).unlink(missing_ok=True)
        raise
    return path
