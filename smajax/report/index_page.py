"""One page that compares the reports of a folder: what each found, and its errors before and after."""

from __future__ import annotations

import html
import json
import math
import os
import time
import warnings
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any
from urllib.parse import quote

from smajax.core.display_units import digits, display, label
from smajax.core.files import replace
from smajax.core.wording import verdict_text
from smajax.report.json_file import with_current_keys
from smajax.report.next_steps import MODEL, Step, after_reports, section
from smajax.report.plain_page import bullets, table, whole

RECORD, PAGE, INDEX = "report.json", "report.html", "reports.html"
MARK = "<!-- smajax reports -->"  # of a page that may be written over
HEAD = (
    "report",
    "verdict",
    "error before",
    "after",
    "held out, before",
    "after",
    "times the noise",
    "effects added",
    "written",
)
NUMBERS = (2, 3, 4, 5, 6)


@dataclass(frozen=True)
class ReportRow:
    """A report of `close-loop` in one line. Errors are root mean squares over all samples of the runs, SI."""

    folder: str  # from the folder that was searched
    title: str
    verdict: str
    effects: tuple[str, ...]  # names of those added
    output: str
    unit: str
    noise: float | None
    fit_before: float | None
    fit_after: float | None
    held_out_before: float | None
    held_out_after: float | None
    written: float  # s since 1970: when the record was written
    coefficients_at_bounds: tuple[str, ...] = ()  # of those effects
    unknowns_at_bounds: tuple[str, ...] = ()  # of the experiment
    doubt: str = ""  # that runs which the fit did not see leave of the verdict

    @property
    def noises(self) -> float | None:
        """The error after in times the noise: of held-out runs, or of fit runs where none is held out."""
        error = self.fit_after if self.held_out_after is None else self.held_out_after
        return None if error is None or not self.noise else error / self.noise


def _error(runs: Sequence[Mapping[str, Any]], role: str, when: str) -> float | None:
    parts = [(run["samples"], run[f"rmse_{when}"]) for run in runs if run["role"] == role]
    if not parts or any(error is None for _, error in parts):
        return None
    return math.sqrt(sum(count * error**2 for count, error in parts) / max(sum(count for count, _ in parts), 1))


def read_report(path: Path, searched: Path) -> ReportRow:
    """The line of a `report.json`. Raises ValueError for a file that is no such record."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", DeprecationWarning)  # keys of an older version, which are read
            record = with_current_keys(json.loads(path.read_text(encoding="utf-8")))
        errors = {
            f"{name}_{when}": _error(record["runs"], role, when)
            for name, role in (("fit", "fit"), ("held_out", "held-out"))
            for when in ("before", "after")
        }
        return ReportRow(
            folder=path.parent.relative_to(searched).as_posix(),
            title=str(record["title"]),
            verdict=str(record["verdict"]),
            effects=tuple(str(one["name"]) for one in record["effects"] if one["added"]),
            output=str(record["output"]["name"]),
            unit=str(record["output"]["unit"]),
            noise=record["output"]["noise_sigma"],
            written=path.stat().st_mtime,
            coefficients_at_bounds=tuple(map(str, record.get("coefficients_at_bounds", ()))),
            unknowns_at_bounds=tuple(map(str, record.get("unknowns_at_bounds", ()))),
            doubt=str(record.get("held_out_runs", "")),
            **errors,
        )
    except (AttributeError, KeyError, TypeError, ValueError) as error:
        raise ValueError(f"{path}: is no record of close-loop ({type(error).__name__}: {error})") from None


def read_reports(folder: Path) -> tuple[list[ReportRow], list[str]]:
    """(every report in `folder` and below it by its folder's name, why others could not be read); hidden folders are passed over."""
    rows, messages = [], []
    for place, inner, files in os.walk(folder):
        inner[:] = sorted(name for name in inner if not name.startswith("."))
        if RECORD in files:
            try:
                rows.append(read_report(Path(place) / RECORD, folder))
            except ValueError as error:
                messages.append(str(error))
    return rows, messages


def cells(row: ReportRow) -> list[str]:
    """A line of the table under `HEAD`, in the units of a reader."""
    shown = display(row.unit, row.output)

    def error(value: float | None) -> str:
        return "–" if value is None else f"{digits(shown.of(value), 3, zeros=True)} {shown.unit}".strip()

    errors = (row.fit_before, row.fit_after, row.held_out_before, row.held_out_after)
    return [
        row.title,
        verdict_text(row.verdict, row.coefficients_at_bounds, row.unknowns_at_bounds, row.doubt),
        *map(error, errors),
        digits(row.noises, 3, zeros=True),
        ", ".join(map(label, row.effects)) or "–",
        time.strftime("%Y-%m-%d %H:%M", time.localtime(row.written)),
    ]


def index_page(rows: Sequence[ReportRow], messages: Sequence[str] = (), steps: Sequence[Step] = ()) -> str:
    """The page; its links are relative to the folder that was searched. steps: what a reader may do next."""
    counts: dict[str, int] = {}
    for row in rows:
        said = verdict_text(row.verdict, (), (), row.doubt)
        counts[said] = counts.get(said, 0) + 1
    summary = "; ".join(f"{count} {verdict}" for verdict, count in sorted(counts.items(), key=lambda one: -one[1]))
    links = [quote(f"{row.folder}/{PAGE}") for row in rows]
    parts = [
        MARK,
        "<style>td:nth-child(8){min-width:14em}</style>",  # on a telephone a long list would make every row tall
        f"<h1>{len(rows)} {'report' if len(rows) == 1 else 'reports'}</h1><p>{html.escape(summary)}.</p>",
        table(HEAD, [cells(row) for row in rows], NUMBERS, links),
        "<p class=quiet>Errors are root mean squares over all samples of the runs, of the base model and of the model with the effects added. "
        "Times the noise: the error after of held-out runs, of fit runs where none is held out. A click on a heading sorts.</p>",
        section(steps),
    ]
    if messages:
        parts += ["<h2>Not read</h2>", bullets(messages)]
    return whole("Reports of smajax", parts)


def write_index(folder: Path) -> tuple[Path, list[ReportRow], list[str]]:
    """Write `reports.html` into `folder`: (page, its lines, why other records could not be read).

    Raises ValueError where there is no report, or where `reports.html` is another page.
    """
    page = folder / INDEX
    if page.exists() and MARK not in page.read_text(encoding="utf-8", errors="replace"):
        raise ValueError(f"{page} was not written by `smajax reports`; rename it, or give another folder")
    rows, messages = read_reports(folder)
    if not rows:
        why = f": {'; '.join(messages)}" if messages else ""
        raise ValueError(f"no {RECORD} in {folder} or below it{why}; expected folders that `smajax close-loop` wrote")
    steps = after_reports(folder, _with_model(folder, rows))
    return replace(page, index_page(rows, messages, steps)), rows, messages


def _with_model(folder: Path, rows: Sequence[ReportRow]) -> list[str]:
    """Folders of the reports that have a model, that with the least error over the noise first."""
    held = [row for row in rows if (folder / row.folder / MODEL).is_file()]
    return [row.folder for row in sorted(held, key=lambda row: math.inf if row.noises is None else row.noises)]


def as_record(row: ReportRow) -> dict[str, Any]:
    """A line for a program, SI."""
    return {**asdict(row), "error_in_noises": row.noises}
