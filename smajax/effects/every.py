"""Every effect by name: those of the library, and the unknown terms, which are no candidates."""

from __future__ import annotations

from smajax.effects.base import AbstractEffect
from smajax.effects.library import LIBRARY
from smajax.unknown.terms import UNKNOWN

EVERY: dict[str, type[AbstractEffect]] = {**LIBRARY, **UNKNOWN}
