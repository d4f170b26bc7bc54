"""Figures -> a folder: a picture and a JSON file a row, and the table as a page for a browser and for a repository."""

from __future__ import annotations

import hashlib
import html
import json
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from matplotlib.figure import Figure

from smajax.core.files import csv_text, replace, writing
from smajax.core.progress import Message, Progress, Stage
from smajax.core.provenance import made_with, source_mark
from smajax.report.drawing import UPRIGHT
from smajax.report.embedded import picture
from smajax.report.next_steps import after_figures, section
from smajax.report.plain_page import table, whole

from .catalogue import every_row
from .row import Row, State

SIZE = (9.0, 5.6)  # inches
DPI, FINE = 90, 140  # of a desk and of a telephone, which has more of them
UP = ".upright.png"  # the same panels one below the other, for a telephone
IN_PART = "In part: not as the source words it, or with a value chosen so that this one figure holds; the reason stands with the figure."
MARK = ".made-by"  # which code and setting the folder's files come from


@dataclass(frozen=True)
class Drawn:
    """A row whose picture and record lie in the folder."""

    row: Row
    state: State
    found: str
    caveat: str
    in_part: str = ""

    @property
    def holds(self) -> bool:
        """As the source words it."""
        return self.state is State.HOLDS

    @property
    def verdict(self) -> str:
        """A few words for the table."""
        return "holds, see note" if self.holds and self.caveat else str(self.state)


def _kept(row: Row, folder: Path) -> Drawn | None:
    record, picture = folder / f"{row.name}.json", folder / f"{row.name}.png"
    if not (record.exists() and picture.exists()):
        return None
    try:
        result = json.loads(record.read_text(encoding="utf-8"))
        return Drawn(row, State(result["state"]), result["found"], result["caveat"], result["in_part"])
    except (ValueError, KeyError):
        return None  # damaged, or of a version that had two states: drawn again


def _made(row: Row, folder: Path, fast: bool) -> Drawn:
    result = row.work(fast)
    for name, width, dpi in ((f"{row.name}.png", SIZE[0], DPI), (f"{row.name}{UP}", UPRIGHT, FINE)):
        figure = Figure(figsize=(width, SIZE[1]))
        result.draw(figure)
        with writing(folder / name) as file:
            figure.savefig(file, dpi=dpi, facecolor="white", format="png", metadata={"Software": None})
    record = {
        "id": row.name,
        "where": row.where,
        "system": row.system,
        "claim": row.claim,
        "holds": result.state is State.HOLDS,
        "state": str(result.state),
        "in_part": result.in_part,
        "found": result.found,
        "numbers": result.numbers,
        "caveat": result.caveat,
    }
    # Last and at once: a record means that its picture is there too.
    replace(folder / f"{row.name}.json", json.dumps(record, indent=2, ensure_ascii=False) + "\n")
    return Drawn(row, result.state, result.found, result.caveat, result.in_part)


def _figures_mark() -> str:
    """Hex digest of the figures' own modules, which `source_mark` does not see: they are outside the package."""
    digest = hashlib.sha256()
    for file in sorted(Path(__file__).parent.glob("*.py")):
        digest.update(file.read_bytes())
    return digest.hexdigest()


def draw(rows: Sequence[Row], folder: Path, fast: bool, progress: Progress) -> list[Drawn]:
    """Make each row, or take it from `folder` where an interrupted call of this code and setting has finished it."""
    folder.mkdir(parents=True, exist_ok=True)
    mark = folder / MARK
    setting = f"{'fast' if fast else 'full'} {source_mark()} {_figures_mark()}\n"
    if not mark.exists() or mark.read_text(encoding="utf-8") != setting:
        stale = [
            name
            for row in every_row()
            for name in (f"{row.name}.json", f"{row.name}.png", f"{row.name}{UP}")
            if (folder / name).exists()
        ]
        for name in stale:
            (folder / name).unlink()
        if stale:
            progress(
                Message(
                    f"{sum(name.endswith('.json') for name in stale)} figures of another version of smajax or another setting are gone."
                )
            )
        replace(mark, setting)
    drawn = []
    for index, row in enumerate(rows):
        progress(Stage(f"{row.name}: {row.system}", 0.0))
        drawn.append(_kept(row, folder) or _made(row, folder, fast))
        progress(Stage(f"{row.name}: {row.system}", 1.0))
        progress(Message(f"{row.name} {drawn[-1].verdict} ({index + 1} of {len(rows)})"))
    return drawn


def lying_in(folder: Path) -> list[Drawn]:
    """Every figure in `folder`, whenever it was drawn, in the order of the catalogue."""
    return [one for one in (_kept(row, folder) for row in every_row()) if one is not None]


def write_pages(folder: Path) -> Path:
    """The table and the pictures of every figure in `folder`, as README.md, figures.csv and index.html; the last's path."""
    drawn = lying_in(folder)
    replace(folder / "README.md", as_markdown(drawn))
    replace(folder / "figures.csv", as_csv(drawn, folder))
    return replace(folder / "index.html", as_page(drawn, folder))


def as_markdown(drawn: Sequence[Drawn]) -> str:
    """What the source says, what was measured, whether it holds; then each picture."""
    lines = [
        "# Figures of the source, reproduced",
        "",
        "Source: M. H. Elahinia (2004). Made by `smajax figures`; beside each picture lies a JSON file with its numbers.",
        "",
        f"{holding(drawn)} {IN_PART}",
        "",
        "| | system | what the source says | what was measured | |",
        "|---|---|---|---|---|",
    ]
    for one in drawn:
        row = one.row
        cells = (f"[{row.name}](#{row.name.lower()}), {row.where}", row.system, row.claim, one.found, one.verdict)
        lines.append(f"| {' | '.join(cells)} |")
    for one in drawn:
        lines += [
            "",
            f"## {one.row.name}",
            "",
            f"{one.row.system} ({one.row.where}). {one.found[0].upper()}{one.found[1:]}.",
        ]
        lines += ["", f"Holds in part: {one.in_part}."] if one.state is State.IN_PART else []
        lines += ["", f"Note: {one.caveat}"] if one.caveat else []
        lines += ["", f"![{one.row.name}]({one.row.name}.png)"]
    return "\n".join(lines) + "\n"


def as_page(drawn: Sequence[Drawn], folder: Path) -> str:
    """The same for a browser, in one file; the pictures are those in `folder`."""
    say = html.escape
    rows = "".join(
        f'<tr><td data-v="{index}"><a href="#{one.row.name}">{one.row.name}</a><br>{say(one.row.where)}</td>'
        f"<td>{say(one.row.system)}</td><td>{say(one.row.claim)}</td><td>{say(one.found)}</td>"
        f'<td class="{one.state.name.lower()}">{one.verdict}</td></tr>'
        for index, one in enumerate(drawn)
    )
    parts = [
        f'<h2 id="{one.row.name}">{one.row.name}: {say(one.row.system)}</h2><p>{say(one.found)}.</p>'
        + (f"<p>Holds in part: {say(one.in_part)}.</p>" if one.state is State.IN_PART else "")
        + (f"<p>Note: {say(one.caveat)}</p>" if one.caveat else "")
        + _picture(one, folder)
        for one in drawn
    ]
    head = (
        "<style>.fails{color:#c8553d;font-weight:600}.in_part{color:#9a6a00;font-weight:600}</style>"
        f"<h1>Figures of the source, reproduced</h1><p>Source: M. H. Elahinia (2004). {say(holding(drawn))} {say(IN_PART)}</p>"
        "<div class=scroll><table class=sortable><thead><tr>"
        "<th>figure</th><th>system</th><th>what the source says</th><th>what was measured</th><th>holds</th></tr></thead>"
        f"<tbody>{rows}</tbody></table></div>"
    )
    foot = [
        "<h2>Provenance</h2>",
        table(["", ""], list(map(list, made_with().items()))),
        "<p class=quiet>The same numbers: figures.csv, and a JSON file for each figure.</p>",
    ]
    return whole("Figures of the source", [head, section(after_figures()), *parts, *foot])


def _picture(one: Drawn, folder: Path) -> str:
    upright = folder / f"{one.row.name}{UP}"
    wide = (folder / f"{one.row.name}.png").read_bytes()
    alt = f"{one.row.name}: {one.found}"
    return str(picture(wide, alt, "panels", upright.read_bytes() if upright.exists() else None))


def as_csv(drawn: Sequence[Drawn], folder: Path) -> str:
    """A row a number that proves a claim, as the record of the figure has it."""
    rows = []
    for one in drawn:
        numbers = json.loads((folder / f"{one.row.name}.json").read_text(encoding="utf-8"))["numbers"]
        rows += [[one.row.name, one.verdict, name, value] for name, value in numbers.items()]
    return csv_text(["figure", "claim", "number", "value"], rows)


def holding(drawn: Sequence[Drawn]) -> str:
    """How many claims are in each of the three states."""
    count = Counter(one.state for one in drawn)
    return f"{count[State.HOLDS]} of {len(drawn)} hold, {count[State.IN_PART]} hold in part, {count[State.FAILS]} fail."


def as_text(drawn: Sequence[Drawn]) -> str:
    """The table for a terminal."""
    lines = []
    for one in drawn:
        lines += [f"{one.row.name:>4}  {one.row.claim}", f"      {one.verdict}: {one.found}"]
        lines += [f"      in part: {one.in_part}."] if one.state is State.IN_PART else []
        lines += [f"      note: {one.caveat}"] if one.caveat else []
    lines.append(holding(drawn))
    return "\n".join(lines)
