"""Every effect by name: those of the library, and the unknown terms, which are no candidates."""

from __future__ import annotations

from smajax.attribution.unknown.terms import UNKNOWN
from smajax.model.effects.base import AbstractEffect
from smajax.model.effects.library import LIBRARY

EVERY: dict[str, type[AbstractEffect]] = {**LIBRARY, **UNKNOWN}
