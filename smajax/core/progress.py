"""How long work tells how far it is."""

from __future__ import annotations

from collections.abc import Callable, Iterable

Progress = Callable[[str, float], None]  # (what, share done 0..1)


def quiet(what: str, share: float) -> None:
    """Progress for nobody."""


def say_checked(progress: Progress, warnings: Iterable[str], can_tell: Iterable[str]) -> None:
    """What was found before a fit: what looks wrong, which is said wherever stderr goes, and what the runs can tell."""
    for kind, lines in (("warn", warnings), ("say", can_tell)):
        for line in lines:
            progress(f"{kind}: check: {line}", 1.0)
