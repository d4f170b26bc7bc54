"""What the commands have in common: where they speak, how Ctrl-C is answered, exit codes, options."""

from __future__ import annotations

import math
import os
import shlex
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from rich.console import Console

UNMET = 3  # exit code: the work is done and what was asked of its result is not met
INTERRUPTED = 130
HEX = "[0-9a-f]"
# Folders within a result, and what smajax names its files there; what else is in them is the user's.
INSIDE = {"fits": f"{HEX * 32}.npz", "finished": f"*-{HEX * 16}.npz"}
FITS = f"fits/{INSIDE['fits']}"

Overwrite = Annotated[
    bool, typer.Option("--overwrite", help="delete another result that smajax wrote into --out, and begin anew")
]
Json = Annotated[bool, typer.Option("--json", help="print the record on stdout as JSON instead of words")]
Open = Annotated[bool, typer.Option("--open/--no-open", help="open the page in a browser")]
OpenUnless = Annotated[bool, typer.Option("--open/--no-open", help="open the page in a browser (from a terminal)")]


def console() -> Console:
    """Where progress and errors are said."""
    from rich.console import Console

    return Console(stderr=True)


def browse(page: Path) -> None:
    """Open a page in the user's browser."""
    import webbrowser

    webbrowser.open(page.resolve().as_uri())


def browse_from_terminal(page: Path, wanted: bool) -> None:
    """Open it where a person looks: not in a pipe, not in a build."""
    if wanted and sys.stdout.isatty() and not os.environ.get("CI"):
        browse(page)


def command_line() -> str:
    """The command as it was typed."""
    return "smajax " + shlex.join(sys.argv[1:])


@contextmanager
def resumable(kept: str = "Finished fits are kept: the same command goes on from there.") -> Iterator[None]:
    """Ctrl-C is answered here: typer would end in silence."""
    try:
        yield
    except KeyboardInterrupt:
        console().print(f"\nInterrupted. {kept}", soft_wrap=True)
        # At once: an interpreter that shuts down in the middle of a compilation can crash.
        os._exit(INTERRUPTED)


def numbers(option: str, text: str) -> tuple[float, ...]:
    """`1,2 3` as finite numbers."""
    try:
        found = tuple(float(part) for part in text.replace(",", " ").split())
        if not all(map(math.isfinite, found)):
            raise ValueError
        return found
    except ValueError:
        raise typer.BadParameter(f"finite numbers with commas between them, not `{text}`", param_hint=option) from None


def pairs(option: str, several: Sequence[str] | None) -> dict[str, float]:
    """`name=0.2,other=1`, given once or more, as numbers by name."""
    found: dict[str, float] = {}
    for part in ",".join(several or ()).replace(" ", ",").split(","):
        name, sign, value = part.partition("=")
        if not part:
            continue
        try:
            if not sign or name in found:
                raise ValueError
            found[name] = float(value)
            if not math.isfinite(found[name]):
                raise ValueError
        except ValueError:
            raise typer.BadParameter(
                f"each name once with its number, as in `name=0.2,other=1`, not `{part}`", param_hint=option
            ) from None
    return found
