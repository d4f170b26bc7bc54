"""What the commands have in common: where they speak, how Ctrl-C is answered, exit codes, options."""

from __future__ import annotations

import math
import os
import re
import shlex
import signal
import sys
import threading
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from types import FrameType
from typing import TYPE_CHECKING, Annotated, Any

import typer

if TYPE_CHECKING:
    from rich.console import Console

DEMOS = ("latent", "complete")  # the benches that `smajax demo` has
UNMET = 3  # exit code: the work is done and what was asked of its result is not met
INTERRUPTED = 130
AGAIN = 1.0  # s after which Ctrl-C that was not answered is given again
SOON = 0.02  # s, where it came at a moment at which nothing can be raised
CALLBACKS = ("_xla_gc_callback",)  # what is raised in them goes nowhere
HEX = "[0-9a-f]"
# Folders within a result, and what smajax names its files there; what else is in them is the user's.
INSIDE = {"fits": f"{HEX * 32}.npz", "finished": f"*-{HEX * 16}.npz"}
FITS = f"fits/{INSIDE['fits']}"

Overwrite = Annotated[
    bool, typer.Option("--overwrite", help="delete another result that smajax wrote into --out, and begin anew")
]
Json = Annotated[bool, typer.Option("--json", help="print the record on stdout as JSON instead of words")]
Open = Annotated[bool, typer.Option("--open/--no-open", help="open the page in a browser when it is done")]


def console() -> Console:
    """Where progress and errors are said."""
    from rich.console import Console

    return Console(stderr=True)


def browse(page: Path) -> None:
    """Open a page in the user's browser."""
    import webbrowser

    webbrowser.open(page.resolve().as_uri())


def command_line() -> str:
    """The command as it was typed."""
    return "smajax " + shlex.join(sys.argv[1:])


@contextmanager
def insistent() -> Iterator[None]:
    """Ctrl-C until it is answered: what is raised while Python collects garbage, where XLA calls back, is printed and dropped."""
    own = threading.current_thread() is threading.main_thread()
    if not own or signal.getsignal(signal.SIGINT) is not signal.default_int_handler:
        yield
        return

    def interrupt(number: int, frame: FrameType | None) -> None:
        called_back = frame is not None and frame.f_code.co_name in CALLBACKS
        signal.setitimer(signal.ITIMER_REAL, SOON if called_back else AGAIN)
        if not called_back:
            raise KeyboardInterrupt

    alarm = signal.signal(signal.SIGALRM, interrupt)
    signal.signal(signal.SIGINT, interrupt)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGINT, signal.default_int_handler)
        signal.signal(signal.SIGALRM, alarm or signal.SIG_DFL)


@contextmanager
def until_nobody_reads() -> Iterator[None]:
    """A list that goes into `head`: when that has seen enough, all is well."""
    try:
        yield
        sys.stdout.flush()
    except BrokenPipeError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())  # what Python still holds goes nowhere


@contextmanager
def resumable(kept: str = "", out: Path | None = None, finished: str = "") -> Iterator[None]:
    """Ctrl-C is answered here: typer would end in silence.

    kept: what is said where a file of the pattern `finished` lies in `out`; else that there is nothing to go on from.
    """
    try:
        with insistent():
            yield
    except KeyboardInterrupt:
        there = out is not None and any(out.glob(finished))
        told = kept if there else "Nothing was finished: the same command begins anew."
        console().print(f"\nInterrupted. {told}", soft_wrap=True)
        # At once: an interpreter that shuts down in the middle of a compilation can crash.
        os._exit(INTERRUPTED)


def quantity(
    about: str, unit: str, low: float = -math.inf, high: float = math.inf, above: float = -math.inf, like: str = ""
) -> Any:
    """An option that takes a number with its unit (`10ms`, `10 ms`), or a number alone, which is in `unit`.

    It is from `low` to `high`, and more than `above`; like: an example for the message of one that is not.
    """

    def parsed(text: str | float) -> float:
        from smajax.core.units import UnitError, parse_quantity

        if not isinstance(text, str):  # the default
            return text
        try:
            found = parse_quantity(text, unit, bare=unit)
        except UnitError as error:
            raise typer.BadParameter(str(error)) from None
        if not (low <= found <= high and above < found):
            least = f"more than {above:g}" if above > low else f"{low:g} or more"
            asked = f"{least} {unit}" if high == math.inf else f"{low:g} to {high:g} {unit}"
            raise typer.BadParameter(f"{asked}, not `{text}`" + f"; give one such as {like}" * bool(like))
        return found

    return typer.Option(parser=parsed, metavar=f"<{unit}>", help=f"{about}; {alone(unit)}")


def alone(unit: str) -> str:
    """What the help of every option says that takes quantities."""
    return f"in {unit} where it says no unit"


def understood(what: str, text: str | None, values: Sequence[float], unit: str = "") -> str:
    """How a list was read, where a comma may have been meant for a decimal point: `Set points: 6 and 5 deg.` of `6,5`; or ""."""
    from smajax.core.wording import and_listed

    if text is None or not re.search(r"\d,\d", text):
        return ""
    return f"{what}: {and_listed([f'{one:g}' for one in values])} {unit}".rstrip() + "."


def numbers(option: str, text: str, unit: str = "1") -> tuple[float, ...]:
    """`1,2 3` or `1deg,2 deg` as finite numbers in `unit`, which those without one have."""
    from smajax.core.units import UnitError, parse_quantity

    parts = [part for part in re.split(r"[,\s]+(?=[-+.\d])", text.strip(", ")) if part]
    try:
        return tuple(parse_quantity(part, unit, bare=unit) for part in parts)
    except UnitError as error:
        raise typer.BadParameter(
            f"finite numbers with commas between them, not `{text}`: {error}", param_hint=option
        ) from None


def within(low: float, high: float = math.inf) -> Callable[[float | None], float | None]:
    """The callback of an option that takes numbers from `low` to `high`: says what was got, as a library's would not."""

    def checked(value: float | None) -> float | None:
        if value is not None and not low <= value <= high:
            asked = f"{low:g} or more" if high == math.inf else f"{low:g} to {high:g}"
            raise typer.BadParameter(f"{asked}, not `{value:g}`")
        return value

    return checked


def texts(option: str, several: Sequence[str] | None, example: str = "name=0.2,other=1") -> dict[str, str]:
    """`name=0.2,other=1`, given once or more, as text by name; a comma within a value (`2,5`) stays there."""
    found: dict[str, str] = {}
    told = ",".join(one.strip(", ") for one in several or ())
    for part in re.split(r",\s*(?=[A-Za-z_])|\s+(?=[^,\s=]+=)", told) if told else ():
        name, sign, value = (one.strip() for one in part.partition("="))
        if not sign or not name or name in found:
            raise _each_once(option, part, example)
        found[name] = value
    return found


def _each_once(option: str, part: str, example: str, why: str = "") -> typer.BadParameter:
    return typer.BadParameter(
        f"each name once with its number, as in `{example}`, not `{part.strip()}`{why}", param_hint=option
    )


def pairs(option: str, several: Sequence[str] | None, units: Mapping[str, str], example: str) -> dict[str, float]:
    """The same as numbers by name, in the units of those names ("1", where there is none: weights)."""
    from smajax.core.units import UnitError, parse_quantity

    found: dict[str, float] = {}
    for name, value in texts(option, several, example).items():
        unit = units.get(name, "1")
        try:
            found[name] = parse_quantity(value, unit, bare=unit)
        except UnitError as error:
            raise _each_once(option, f"{name}={value}", example, f": {error}") from None
    return found
