"""The error of an experiment file: which file, which key, what was got, what was expected."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path

from smajax.core.names import close_matches, of_many, own_first
from smajax.core.units import UnitError
from smajax.data.readers.table import MeasuredDataError


class ExperimentError(ValueError):
    """An experiment file that cannot be used; the message reads `file: key.path: what is wrong and what to do`."""

    def __init__(self, path: Path, key: str, message: str) -> None:
        super().__init__(f"{path}: {key}: {message}" if key else f"{path}: {message}")
        self.path = path
        self.key = key


def check_name(path: Path, key: str, kind: str, name: str, known: Iterable[str]) -> None:
    """Raises ExperimentError unless `name` is one of the known names of that kind."""
    names = own_first(known)
    if name not in names:
        raise ExperimentError(path, key, f"there is no {kind} {name!r}{close_matches(name, names, 'there are')}")


def check_parameter(path: Path, key: str, name: str, known: Iterable[str], presets: str) -> None:
    """Raises ExperimentError unless `name` is a parameter of the model of these presets, named as on a command line."""
    names = list(known)
    if name not in names:
        lists = f"`smajax presets {presets}` lists those of the model, `smajax effects` those of effects"
        raise ExperimentError(path, key, f"there is no parameter {name!r}{of_many(name, names, lists)}")


@contextmanager
def at_key(path: Path, key: str) -> Iterator[None]:
    """Turns an error of a unit or of a measured file into an ExperimentError at that key."""
    try:
        yield
    except (UnitError, MeasuredDataError) as error:
        raise ExperimentError(path, key, str(error)) from error
