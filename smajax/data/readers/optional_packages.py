"""Libraries that only some file kinds need."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from smajax.core.extras import MissingExtraError, optional_package
from smajax.data.readers.table import MeasuredDataError


def needed(library: str, path: Path, otherwise: str = "") -> Any:
    """The library; MeasuredDataError that says how to install it, `otherwise` being another way out."""
    try:
        return optional_package(library, "formats", f"{path}: reading {path.suffix} of this kind", otherwise)
    except MissingExtraError as error:
        raise MeasuredDataError(str(error)) from None
