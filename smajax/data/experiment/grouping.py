"""Which files make one run: each file by itself, or one file a sensor, told apart by their names."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from smajax.core.names import listed
from smajax.data.readers.table import MeasuredDataError

WORD = re.compile(r"[^\W\d_]+|\d+")


@dataclass(frozen=True)
class RunFiles:
    """One run: its name, and its file of each kind, in the order of the kinds."""

    name: str
    files: tuple[Path, ...]


def _words(file: Path) -> set[str]:
    return set(WORD.findall(file.stem))


def _without(file: Path, words: set[str]) -> str:
    """The file's name without these words: `SensorInput_Step01` without `SensorInput` is `Step01`."""
    left = WORD.sub(lambda result: "" if result.group() in words else result.group(), file.stem)
    return re.sub(r"([\W_])[\W_]+", r"\1", left).strip("_-. ")


def paired(kinds: Sequence[Sequence[Path]]) -> tuple[RunFiles, ...]:
    """One run for each file of the first kind, with the file of each other kind whose name agrees but for the kind's words.

    A kind's words are those that all its files have in their names and no file of another kind has. Raises MeasuredDataError
    for a file without its partners.
    """
    by_name = []
    for files in kinds:
        others = set().union(*(_words(file) for other in kinds if other is not files for file in other))
        own = set.intersection(*map(_words, files)) - others
        by_name.append({_without(file, own): file for file in files})
    for files, named in zip(kinds, by_name, strict=True):
        if len(named) < len(files) or named.keys() != by_name[0].keys():
            lines = "; ".join(
                f"{listed(sorted(one))} among {kind[0].name} and its like"
                for kind, one in zip(kinds, by_name, strict=True)
            )
            raise MeasuredDataError(
                f"no file has both an input and an output, and their names do not tell which ones make a run: runs {lines}. "
                "Name them alike but for the sensor (input_step1.mat, position_step1.mat), or write files = { channel = "
                "'file' } under each [[runs]] by hand"
            )
    return tuple(RunFiles(name or "run", tuple(named[name] for named in by_name)) for name in by_name[0])
