"""Which steps a person has opened in a folder: one that only has to be looked at is done when it was."""

from __future__ import annotations

import json
from pathlib import Path

from smajax.app.jobs import HIDDEN
from smajax.core.files import json_text, replace

OPENED = "opened.json"


def opened(project: Path) -> frozenset[str]:
    """Names of steps; none where nothing is known."""
    try:
        names = json.loads((project / HIDDEN / OPENED).read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return frozenset()
    return frozenset(str(one) for one in names) if isinstance(names, list) else frozenset()


def note_opened(project: Path, step: str) -> None:
    """Keep that this step was opened; a folder that cannot be written to, or a link out of it, has no marks, and nothing else is wrong."""
    before = opened(project)
    if step in before or (project / HIDDEN).is_symlink():
        return
    try:
        (project / HIDDEN).mkdir(exist_ok=True)
        replace(project / HIDDEN / OPENED, json_text(sorted({*before, step})))
    except OSError:
        return
