"""A command that ends in time: it runs in a process of its own, which is ended when the time is over."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from collections.abc import Sequence
from contextlib import suppress

from smajax.cli.terminal import INTERRUPTED, interrupts_answered

BUDGET = "SMAJAX_BUDGET"  # s, of the process that is ended: it shows early what it knows
SHARE = 0.1  # of them before the first page of a search
GRACE = 2.0  # s between Ctrl-C and the end of a process that does not answer: a compilation cannot be interrupted


def run_within(seconds: float, words: Sequence[str]) -> int | None:
    """The exit code of `smajax WORDS`; None where it was ended because the time was over.

    Its output goes where ours does. Files are written whole or not at all, so none is half written when it is ended.
    """
    process = subprocess.Popen([sys.executable, "-m", "smajax", *words], env={**os.environ, BUDGET: str(seconds)})
    try:
        return process.wait(timeout=seconds)
    except subprocess.TimeoutExpired:
        process.terminate()
        try:
            process.wait(timeout=GRACE)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()
        return None
    except KeyboardInterrupt:
        # It says what there is to say. From a terminal it got Ctrl-C too; from `kill` this process alone did.
        with interrupts_answered():
            with suppress(ValueError, OSError):  # Windows cannot send it
                process.send_signal(signal.SIGINT)
            code = process.wait()
        return INTERRUPTED if code < 0 else code  # ended before it could answer: its code is that of the signal


def first_page(usual: float) -> float:
    """Seconds of a search before its first page: `usual`, and fewer in a process that is ended before long. What that one starts is not ended."""
    with suppress(ValueError):
        return min(usual, SHARE * float(os.environ.pop(BUDGET, "inf")))
    return usual


def without(words: Sequence[str], option: str) -> list[str]:
    """The words of a command without an option and its value, as `--option value` and as `--option=value`."""
    result: list[str] = []
    skip = False
    for word in words:
        if skip:
            skip = False
        elif word == option:
            skip = True
        elif not word.startswith(f"{option}="):
            result.append(word)
    return result
