"""How long work tells how far it is."""

from __future__ import annotations

from collections.abc import Callable

Progress = Callable[[str, float], None]  # (what, share done 0..1)


def quiet(what: str, share: float) -> None:
    """Progress for nobody."""
