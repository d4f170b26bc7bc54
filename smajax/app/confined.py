"""Paths that a request names: those within the chosen folder, and no others."""

from __future__ import annotations

from pathlib import Path


class OutsideError(ValueError):
    """A path that leads out of the chosen folder, or to a hidden file in it."""


def inside(root: Path, text: str) -> Path:
    """The path `text` below `root` (resolved), links followed. Raises OutsideError where it leaves `root`, or a part of it is hidden."""
    try:
        target = (root / text).resolve()
    except (OSError, RuntimeError, ValueError):  # a circle of links, a null character
        raise OutsideError(f"{text!r} is no path") from None
    if not target.is_relative_to(root):
        raise OutsideError(f"{text!r} leads out of the folder {root}; only files in it are read")
    if target.is_symlink():  # what is left of a circle of links, from Python 3.13 on
        raise OutsideError(f"{text!r} is no path")
    if any(part.startswith(".") for part in target.relative_to(root).parts):
        raise OutsideError(f"{text!r} is a hidden file")
    return target


def is_inside(root: Path, path: Path) -> bool:
    """Whether `path`, links followed, lies within `root` (resolved)."""
    try:
        return path.resolve().is_relative_to(root)
    except (OSError, RuntimeError):
        return False
