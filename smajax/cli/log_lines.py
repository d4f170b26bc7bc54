"""Lines of progress for a log, `SMAJAX_PROGRESS=lines`: their clock, and the first of them. Imports nothing that takes time."""

from __future__ import annotations

import os
import sys
import time as clock

# Where stderr is no terminal nothing is written, so that a program that calls us has a clean one; with `lines` a log of a
# build has a line for each stage, and with `json` a program reads each event as a line. A person who waits there for minutes is told so, unless the variable is set.
VARIABLE = "SMAJAX_PROGRESS"
BEGAN = clock.monotonic()  # imported with the command line, so that the seconds of a line are those of the command


def line(text: str) -> str:
    """`[  12.3 s] text`."""
    return f"[{clock.monotonic() - BEGAN:6.1f} s] {text}"


def announce(command: str) -> None:
    """Say that a command has started: its first stage comes seconds later, when libraries are loaded and the input is read."""
    if os.environ.get(VARIABLE) == "lines" and not sys.stderr.isatty():
        sys.stderr.write(line(f"{command}: loading") + "\n")
        sys.stderr.flush()
