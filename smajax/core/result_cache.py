"""Work kept on disk by its content, so that a fit that was interrupted goes on where it stopped, to the same end."""

from __future__ import annotations

import time as clock
import tokenize
import zipfile
import zlib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from smajax.core.files import writing
from smajax.core.provenance import digest

SELDOM = 1.0  # s between two states of the same work


def arrays(path: Path) -> dict[str, np.ndarray] | None:
    """Named arrays of a file; None where there is none, or one that was damaged, which is work to be done again."""
    try:
        with path.open("rb") as file, np.load(file, allow_pickle=False) as kept:
            return dict(kept)
    except (OSError, ValueError, EOFError, KeyError, SyntaxError, tokenize.TokenError, zipfile.BadZipFile, zlib.error):
        return None


class Kept:
    """A folder of finished and unfinished work; without a folder, nothing is kept.

    A key covers code, data, model, where the work starts and its settings: what is found under it is the same work.
    """

    def __init__(self, folder: Path | None = None) -> None:
        self.folder = folder
        self.reused = 0
        self._saved = -np.inf

    def key(self, work: Any, *settings: object) -> str:
        """`work`: a pytree of arrays; settings: anything that can be printed, or arrays."""
        if self.folder is None:
            return ""
        told = [one if isinstance(one, np.ndarray) else repr(one) for one in settings]
        return digest(work, told)[:32]

    def load(self, key: str) -> dict[str, np.ndarray] | None:
        """What was kept under `key`."""
        path = self._path(key)
        if path is None or not path.exists():
            return None
        found = arrays(path)
        self.reused += found is not None
        return found

    def save(self, key: str, record: Mapping[str, Any], *, last: bool = True) -> None:
        """Keep arrays under `key`, whole or not at all. A state that is not the `last` one is kept once a second."""
        path = self._path(key)
        if path is None or (not last and clock.monotonic() - self._saved < SELDOM):
            return
        path.parent.mkdir(parents=True, exist_ok=True)
        with writing(path) as file:
            np.savez(file, **record)
        self._saved = clock.monotonic()

    def _path(self, key: str) -> Path | None:
        return None if self.folder is None else self.folder / f"{key}.npz"
