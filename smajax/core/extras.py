"""Packages that only some commands need: they come with an extra (`pip install 'smajax[tune]'`) and are imported when used."""

from __future__ import annotations

import importlib
from types import ModuleType


class MissingExtraError(ImportError):
    """A package of an extra is not installed: what needs it, and how to install it."""


def optional_package(name: str, extra: str, purpose: str, otherwise: str = "") -> ModuleType:
    """The package `name`, of the extra `extra`.

    purpose: what needs it, as the subject of a sentence; otherwise: another way out. Raises MissingExtraError where it is not
    installed; a package that is there and fails to load raises what it raises.
    """
    try:
        return importlib.import_module(name)
    except ModuleNotFoundError as error:
        if error.name is None or error.name.partition(".")[0] != name.partition(".")[0]:
            raise  # of a package that `name` itself needs
        raise MissingExtraError(
            f"{purpose} needs {name}: pip install 'smajax[{extra}]'" + (f", {otherwise}" if otherwise else ""),
            name=name,
        ) from None
