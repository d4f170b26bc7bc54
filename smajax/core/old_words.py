"""Sentences that results held until version 0.2: the report composes them now, and the old names go in version 0.3."""

from __future__ import annotations

import warnings
from importlib import import_module
from typing import Any


def worded(old: str, now: str, function: str, *of: Any) -> Any:
    """What a function of the report says `of` these; DeprecationWarning for the name `old`, with the one of `now`."""
    warnings.warn(f"{old} is smajax.report.{now} now; it goes in version 0.3", DeprecationWarning, stacklevel=3)
    return getattr(import_module("smajax.report.old_words"), function)(*of)
