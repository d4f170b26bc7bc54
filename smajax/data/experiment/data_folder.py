"""Where the measured files of an experiment are."""

from __future__ import annotations

import os
import re
from pathlib import Path

from smajax.data.experiment.errors import ExperimentError

VARIABLE = "SMAJAX_DATA"
DEFAULT = Path("shared") / "data"


def _default_folder(path: Path) -> Path:
    """The first existing shared/data beside any folder above the experiment file."""
    for parent in path.resolve().parents:
        if (parent / DEFAULT).is_dir():
            return parent / DEFAULT
    raise ExperimentError(
        path, "data.folder", f"{VARIABLE} is not set and no {DEFAULT} is near; set {VARIABLE} to the folder of the data"
    )


def data_folder(path: Path, text: str) -> Path:
    """The folder that `text` of the experiment file at `path` means; relative ones start at the file's own folder.

    `${SMAJAX_DATA}` is that environment variable, or the default folder when it is not set.
    Raises ExperimentError when the folder does not exist.
    """
    for name in re.findall(r"\$\{?(\w+)\}?", text):
        if name != VARIABLE:
            raise ExperimentError(path, "data.folder", f"got ${{{name}}}; only ${{{VARIABLE}}} may be used here")
    full = text
    if VARIABLE in text:
        value = os.environ.get(VARIABLE) or str(_default_folder(path))
        full = re.sub(r"\$\{SMAJAX_DATA\}|\$SMAJAX_DATA\b", lambda _: str(Path(value).resolve()), text)
    folder = path.resolve().parent / full
    if not folder.is_dir():
        raise ExperimentError(
            path, "data.folder", f"got {text!r}; the folder {folder} does not exist; correct it or set {VARIABLE}"
        )
    return folder
