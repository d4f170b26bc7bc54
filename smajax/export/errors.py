"""What cannot be exported, and why."""

from __future__ import annotations

from pathlib import Path
from typing import Any

ROOM = Path(__file__).parents[1]


class ExportError(ValueError):
    """A model or a controller that cannot be exported: which part, why, and what to do."""


class NoTranslation(ExportError):
    """An operation of a traced program that C has no translation for. `part`: where the program asks for it."""

    def __init__(self, what: str, part: str = "") -> None:
        super().__init__(what, part)
        self.what, self.part = what, part

    def __str__(self) -> str:
        where = f"{self.part} cannot be exported: " if self.part else ""
        return f"{where}C has no translation for {self.what}."


def part_of(equation: Any) -> str:
    """The function that an equation of a traced program comes from, the innermost that is no library's; "" where that is not known."""
    try:
        frames = list(equation.source_info.traceback.frames)
    except AttributeError:
        return ""
    for frame in frames:
        path = Path(frame.file_name)
        if "site-packages" in path.parts or frame.file_name.startswith("<"):
            continue
        inside = path.is_relative_to(ROOM)
        if inside and path.relative_to(ROOM).parts[0] in ("core", "engine", "export"):
            continue
        name = ".".join(path.relative_to(ROOM.parent).with_suffix("").parts) if inside else path.name
        return f"`{frame.function_name}` of {name} (line {frame.line_num})"
    return ""
