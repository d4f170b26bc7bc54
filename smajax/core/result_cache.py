"""Results and states cached on disk by content: an interrupted fit resumes where it stopped, with the same result."""

from __future__ import annotations

import time as clock
import tokenize
import zipfile
import zlib
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from smajax.core.files import writing
from smajax.core.provenance import digest

SAVE_INTERVAL = 1.0  # s between two states of unfinished work


def arrays(path: Path) -> dict[str, np.ndarray] | None:
    """Named arrays of a file; None where there is none, or a damaged one, whose work is done again."""
    try:
        with path.open("rb") as file, np.load(file, allow_pickle=False) as content:
            return dict(content)
    except (OSError, ValueError, EOFError, KeyError, SyntaxError, tokenize.TokenError, zipfile.BadZipFile, zlib.error):
        return None


class Counts(NamedTuple):
    """Records that were found of another run, and keys of those that were saved."""

    reused: int
    saved: frozenset[str]


class ResultCache:
    """A folder of finished and unfinished work; without a folder, nothing is cached.

    A key covers code, data, model, initial values and settings: a hit is the result of the same work.
    """

    def __init__(self, folder: Path | None = None) -> None:
        self.folder = folder
        self.reused = 0  # records of another run
        self._own: set[str] = set()  # keys that this one has saved
        self._saved = -np.inf

    @property
    def counts(self) -> Counts:
        """What it has found of another run, and saved itself."""
        return Counts(self.reused, frozenset(self._own))

    def alone(self) -> ResultCache:
        """The same folder for a second process."""
        other = ResultCache(self.folder)
        other._own = set(self._own)
        return other

    def add(self, counts: Counts) -> None:
        """Count what a second process has found and saved."""
        self.reused += counts.reused
        self._own |= counts.saved

    def key(self, work: Any, *settings: object) -> str:
        """`work`: a pytree of arrays; settings: anything that can be printed, or arrays."""
        if self.folder is None:
            return ""
        content = [one if isinstance(one, np.ndarray) else repr(one) for one in settings]
        return digest(work, content)[:32]

    def load(self, key: str, *, counted: bool = True) -> dict[str, np.ndarray] | None:
        """The record cached under `key`; None on a miss. `counted`: among what was reused, as a fit is."""
        path = self._path(key)
        if path is None or not path.exists():
            return None
        record = arrays(path)
        self.reused += counted and record is not None and key not in self._own
        return record

    def save(self, key: str, record: Mapping[str, Any], *, last: bool = True) -> None:
        """Cache arrays under `key`, whole or not at all. States before the `last` one are saved at most once a second."""
        path = self._path(key)
        if path is None or (not last and clock.monotonic() - self._saved < SAVE_INTERVAL):
            return
        path.parent.mkdir(parents=True, exist_ok=True)
        with writing(path) as file:
            np.savez(file, **record)
        self._saved = clock.monotonic()
        self._own.add(key)

    def time_taken(self, seconds: float) -> dict[str, str]:
        """For the provenance of a result: the `seconds` of this program, and that there was an earlier one whose results it took."""
        resumed = {"seconds are counted": "since the resume: the time of the earlier run is not in them"}
        return {"seconds": f"{seconds:.0f}", **(resumed if self.reused else {})}

    def _path(self, key: str) -> Path | None:
        return None if self.folder is None else self.folder / f"{key}.npz"
