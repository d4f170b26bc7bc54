"""A step of the way: its page, and what a form of it does."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import IO, Any

from smajax.app.project import Project


class FieldError(ValueError):
    """What is wrong with an entry, shown beside its field; field "" is the page as a whole."""

    def __init__(self, field: str, message: str) -> None:
        super().__init__(message)
        self.field = field


@dataclass(frozen=True)
class Sent:
    """A form as it was sent: the last value of each field, all values of fields that occur several times, and files by name."""

    values: Mapping[str, str]
    several: Mapping[str, Sequence[str]] = field(default_factory=dict)
    files: Sequence[tuple[str, IO[bytes]]] = ()

    @property
    def action(self) -> str:
        return self.values.get("do", "")


Page = Callable[[Project], Mapping[str, Any]]


def nothing(project: Project, sent: Sent) -> str:
    """Of a page without a form."""
    return ""


@dataclass(frozen=True)
class Step:
    """name: in the address, and of its template. page: what the template shows. save: what a form does; the step to go to, "" to stay.

    keys: first parts of the keys of an experiment file whose errors this page shows beside their fields.
    """

    name: str
    title: str
    page: Page
    save: Callable[[Project, Sent], str] = nothing
    keys: tuple[str, ...] = ()
    done: Callable[[Project], bool] = lambda project: False
    needs: str = ""  # "experiment", "loads", "model": what has to be there first
    light: bool = False  # whether it is shown before JAX is loaded, and the experiment file checked
    to_look_at: bool = False  # whether it is done only once a person has opened it
