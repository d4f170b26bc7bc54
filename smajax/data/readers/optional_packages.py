"""Libraries that only some file kinds need."""

from __future__ import annotations

import importlib
from pathlib import Path
from typing import Any

from smajax.data.readers.table import MeasuredDataError


def needed(library: str, path: Path, otherwise: str = "") -> Any:
    """The library; MeasuredDataError that says how to install it, `otherwise` being another way out."""
    try:
        return importlib.import_module(library)
    except ImportError:
        raise MeasuredDataError(
            f"{path}: reading {path.suffix} of this kind needs {library}: pip install 'smajax[formats]'"
            + (f", {otherwise}" if otherwise else "")
        ) from None
