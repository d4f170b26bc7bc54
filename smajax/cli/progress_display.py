"""Progress of long work: a bar in a terminal, nothing elsewhere unless it is asked for."""

from __future__ import annotations

import os
import sys
import time as clock
from collections.abc import Iterator
from contextlib import contextmanager

from rich.console import Console
from rich.progress import BarColumn, Progress, ProgressColumn, Task, TaskID, TextColumn, TimeElapsedColumn
from rich.text import Text

from smajax.core.compiling import TOLD, compilations_told
from smajax.core.progress import Progress as Report

# Where stderr is no terminal nothing is said, so that a program that calls us has a clean one; with `lines` a log of a
# build has a line for each stage. A person who waits there for minutes is told so, unless the variable is set.
VARIABLE = "SMAJAX_PROGRESS"
HOW = f"No terminal here, so progress is not drawn; {VARIABLE}=lines writes a line for each stage, and {VARIABLE}=none leaves this one out."


@contextmanager
def shown(console: Console, told_how: bool = False) -> Iterator[Report]:
    """Yields `report(what, share)`; share 1 closes the stage.

    What begins with "say: " is a sentence, not a stage; what begins with "warn: " is said wherever stderr goes.
    told_how: where nothing is drawn, say once how to get progress; for long work whose result is words for a person.
    """
    if sys.stderr.isatty():
        with _bars(console) as report:
            yield report
    elif os.environ.get(VARIABLE) == "lines":
        with _lines(console) as report:
            yield report
    else:
        if told_how and VARIABLE not in os.environ:
            console.print(HOW, markup=False, highlight=False, soft_wrap=True)
        yield _warnings(console)


def _sentence(what: str) -> str:
    """What is told and is no stage; empty for a stage."""
    kind, _, told = what.partition(": ")
    return told if kind in ("say", "warn") else ""


def _warnings(console: Console) -> Report:
    def warned(what: str, share: float) -> None:
        if what.startswith("warn: "):
            console.print(f"warning: {_sentence(what)}", markup=False, highlight=False, soft_wrap=True)

    return warned


@contextmanager
def _lines(console: Console) -> Iterator[Report]:
    began, last, compiled = clock.monotonic(), "", "none"

    def said(told: str) -> None:
        console.print(f"[{clock.monotonic() - began:6.1f} s] {told}", markup=False, highlight=False, soft_wrap=True)

    def line(what: str, share: float) -> None:
        nonlocal last
        if _sentence(what) or (what != last and share < 1.0):
            said(_sentence(what) or what)
            last = what

    def compiles(now: bool) -> None:
        nonlocal compiled
        if now and compiled != last:  # once a stage
            said(TOLD)
            compiled = last

    with compilations_told(compiles):
        yield line


class _Left(ProgressColumn):
    """Time left at the pace of the whole stage: steps of a minute each have no pace within the last seconds.

    While a program is compiled, that it is.
    """

    compiling = False

    def render(self, task: Task) -> Text:
        """Counts down between two shares; nothing is promised before the first."""
        if self.compiling and not task.finished:
            return Text(TOLD)
        share, now, at = task.completed, task.elapsed or 0.0, float(task.fields["at"])
        if task.finished or not 0.0 < share < 1.0:
            return Text("")
        left = max(at * (1.0 - share) / share - (now - at), 0.0)
        return Text(f"about {left:.0f} s left" if left < 90.0 else f"about {left / 60.0:.0f} min left")


@contextmanager
def _bars(console: Console) -> Iterator[Report]:
    left = _Left()

    def compiles(now: bool) -> None:
        left.compiling = now

    columns = (TextColumn("{task.description}"), BarColumn(), TimeElapsedColumn(), left)
    with Progress(*columns, console=console) as bar, compilations_told(compiles):
        open_tasks: dict[str, TaskID] = {}

        def move(what: str, share: float) -> None:
            if told := _sentence(what):
                bar.console.print(told, markup=False, highlight=False)
                return
            if what not in open_tasks:
                open_tasks[what] = bar.add_task(what, total=1.0, at=0.0)
            task = open_tasks[what]
            bar.update(task, completed=share, at=next(one.elapsed or 0.0 for one in bar.tasks if one.id == task))
            if share >= 1.0:
                open_tasks.pop(what)

        yield move
