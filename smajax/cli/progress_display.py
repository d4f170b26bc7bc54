"""Progress of long work: a bar in a terminal, nothing elsewhere unless it is asked for."""

from __future__ import annotations

import os
import sys
import time as clock
from collections.abc import Iterator
from contextlib import contextmanager

from rich.console import Console
from rich.progress import BarColumn, ProgressColumn, Task, TaskID, TextColumn, TimeElapsedColumn
from rich.progress import Progress as Bars
from rich.text import Text

from smajax.cli.log_lines import VARIABLE as VARIABLE
from smajax.cli.log_lines import line
from smajax.core.compiling import compilations_reported
from smajax.core.files import json_line
from smajax.core.progress import Compiling, Event, Message, Progress, Stage, WarningMessage, event_record

HOW = f"No terminal here, so progress is not drawn; {VARIABLE}=lines writes a line for each stage, and {VARIABLE}=none leaves this one out."
COMPILING = "compiling, the first time only"


@contextmanager
def displayed(console: Console, hint: bool = False) -> Iterator[Progress]:
    """Yields `progress(event)`, see `smajax.core.progress`; a warning is written wherever stderr goes.

    hint: where nothing is drawn, write once how to get progress; for long work whose result is read by a person.
    """
    if os.environ.get(VARIABLE) == "json":
        with compilations_reported(_written):
            yield _written
    elif sys.stderr.isatty():
        with _bars(console) as progress:
            yield progress
    elif os.environ.get(VARIABLE) == "lines":
        with _lines(console) as progress:
            yield progress
    else:
        if hint and VARIABLE not in os.environ:
            console.print(HOW, markup=False, highlight=False, soft_wrap=True)
        yield _warnings(console)


def _written(event: Event) -> None:
    """The event as a line of JSON on stderr, for `smajax app` and other programs."""
    record = event_record(event)
    if record is not None:
        record["at"] = round(clock.time(), 3)
        sys.stderr.write(json_line(record) + "\n")  # in one piece: an event of a compilation comes from another thread
        sys.stderr.flush()


def _warnings(console: Console) -> Progress:
    def show(event: Event) -> None:
        if isinstance(event, WarningMessage):
            console.print(f"warning: {event.text}", markup=False, highlight=False, soft_wrap=True)

    return show


@contextmanager
def _lines(console: Console) -> Iterator[Progress]:
    last, compiled = "", "none"

    def write(text: str) -> None:
        console.print(line(text), markup=False, highlight=False, soft_wrap=True)

    def show(event: Event) -> None:
        nonlocal last, compiled
        match event:
            case Message(text) | WarningMessage(text):
                write(text)
                last = text
            case Stage(name, share):
                if name != last and share < 1.0:
                    write(name)
                    last = name
            case Compiling(active):
                if active and compiled != last:  # once a stage
                    write(COMPILING)
                    compiled = last

    with compilations_reported(show):
        yield show


class _TimeLeft(ProgressColumn):
    """Time left at the pace of the whole stage: steps of a minute each have no pace within the last seconds.

    While a program is compiled, that it is.
    """

    compiling = False

    def render(self, task: Task) -> Text:
        """Counts down between two shares; nothing is promised before the first."""
        if self.compiling and not task.finished:
            return Text(COMPILING)
        share, now, at = task.completed, task.elapsed or 0.0, float(task.fields["at"])
        if task.finished or not 0.0 < share < 1.0:
            return Text("")
        left = max(at * (1.0 - share) / share - (now - at), 0.0)
        return Text(f"about {left:.0f} s left" if left < 90.0 else f"about {left / 60.0:.0f} min left")


@contextmanager
def _bars(console: Console) -> Iterator[Progress]:
    time_left = _TimeLeft()
    columns = (TextColumn("{task.description}"), BarColumn(), TimeElapsedColumn(), time_left)
    with Bars(*columns, console=console) as bars:
        open_tasks: dict[str, TaskID] = {}

        def move(name: str, share: float) -> None:
            if name not in open_tasks:
                open_tasks[name] = bars.add_task(name, total=1.0, at=0.0)
            task = open_tasks[name]
            bars.update(task, completed=share, at=next(one.elapsed or 0.0 for one in bars.tasks if one.id == task))
            if share >= 1.0:
                open_tasks.pop(name)

        def show(event: Event) -> None:
            match event:
                case Message(text) | WarningMessage(text):
                    bars.console.print(text, markup=False, highlight=False)
                case Stage(name, share):
                    move(name, share)
                case Compiling(active):
                    time_left.compiling = active

        with compilations_reported(show):
            yield show
