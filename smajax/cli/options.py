"""What the commands have in common: option types, parsing of their values, exit codes."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING, Annotated, Any

import typer

if TYPE_CHECKING:
    from smajax.simulation.integration_error import Tolerance

DEMOS = ("latent", "complete")  # the benches of `smajax demo`
UNMET = 3  # exit code: the command is done and its result does not meet a request
HEX = "[0-9a-f]"
# Folders within a result, and the names of smajax's files there; other files in them are the user's.
INSIDE = {"fits": f"{HEX * 32}.npz", "finished": f"*-{HEX * 16}.npz"}
FITS = f"fits/{INSIDE['fits']}"

Overwrite = Annotated[
    bool, typer.Option("--overwrite", help="delete another result of smajax in --out, and start from the beginning")
]
Json = Annotated[bool, typer.Option("--json", help="print the result on stdout as JSON instead of text")]
Open = Annotated[bool, typer.Option("--open/--no-open", help="open the page in a browser when it is done")]

Finely = Annotated[
    str,
    typer.Option(
        help="how finely between two samples: `auto` until the error is below 3e-4 of a whole transformation (1e-3 of many loops); a number "
        "such as 1e-4, the error of a step (moving loads); or `none`, one step a sample, not checked",
    ),
]


def _mark(text: str) -> str:
    if text not in ("", ",", "."):
        raise typer.BadParameter(f"`,` or `.`, not `{text}`.")
    return text


Decimal = Annotated[
    str,
    typer.Option(callback=_mark, help="`,` or `.`: the decimal mark, for logs that do not determine it (`1,234`)"),
]


@contextmanager
def refused(option: str | None = None) -> Iterator[None]:
    """A ValueError in this context becomes a typer.BadParameter of this option."""
    try:
        yield
    except ValueError as error:
        raise typer.BadParameter(str(error), param_hint=option) from None


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
            result = parse_quantity(text, unit, bare=unit)
        except UnitError as error:
            raise typer.BadParameter(str(error)) from None
        if not (low <= result <= high and above < result):
            least = f"more than {above:g}" if above > low else f"{low:g} or more"
            expected = f"{least} {unit}" if high == math.inf else f"{low:g} to {high:g} {unit}"
            raise typer.BadParameter(f"{expected}, not `{text}`" + f"; give one such as {like}" * bool(like))
        return result

    return typer.Option(parser=parsed, metavar=f"<{unit}>", help=f"{about}; {alone(unit)}")


def alone(unit: str) -> str:
    """The part of the help of every option that takes quantities."""
    return f"without a unit in {unit}"


def understood(what: str, text: str | None, values: Sequence[float], unit: str = "") -> str:
    """The list as it was read, where a comma may be a decimal one: `Set points: 6 and 5 deg.` of `6,5`; else ""."""
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


def tolerance_of(text: str) -> Tolerance:
    """`auto`, `none` (None) or a number above zero. Raises typer.BadParameter."""
    if text in ("auto", "none"):
        return "auto" if text == "auto" else None
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not 0.0 < value < math.inf:
        raise typer.BadParameter(
            f"`auto`, `none` or a number above 0 such as 1e-4, not `{text}`", param_hint="--tolerance"
        )
    return value


def within(low: float, high: float = math.inf) -> Callable[[float | None], float | None]:
    """The callback of an option that takes numbers from `low` to `high`, whose message has the value."""

    def checked(value: float | None) -> float | None:
        if value is not None and not low <= value <= high:
            expected = f"{low:g} or more" if high == math.inf else f"{low:g} to {high:g}"
            raise typer.BadParameter(f"{expected}, not `{value:g}`")
        return value

    return checked


def texts(option: str, several: Sequence[str] | None, example: str = "name=0.2,other=1") -> dict[str, str]:
    """`name=0.2,other=1`, once or more, as text by name; a comma within a value (`2,5`) is part of it."""
    result: dict[str, str] = {}
    joined = ",".join(one.strip(", ") for one in several or ())
    for part in re.split(r",\s*(?=[A-Za-z_])|\s+(?=[^,\s=]+=)", joined) if joined else ():
        name, sign, value = (one.strip() for one in part.partition("="))
        if not sign or not name or name in result:
            raise _each_once(option, part, example)
        result[name] = value
    return result


def _each_once(option: str, part: str, example: str, why: str = "") -> typer.BadParameter:
    return typer.BadParameter(
        f"each name once with its number, as in `{example}`, not `{part.strip()}`{why}", param_hint=option
    )


def pairs(option: str, several: Sequence[str] | None, units: Mapping[str, str], example: str) -> dict[str, float]:
    """The same as numbers by name, in the units of those names ("1", where there is none: weights)."""
    from smajax.core.units import UnitError, parse_quantity

    result: dict[str, float] = {}
    for name, value in texts(option, several, example).items():
        unit = units.get(name, "1")
        try:
            result[name] = parse_quantity(value, unit, bare=unit)
        except UnitError as error:
            raise _each_once(option, f"{name}={value}", example, f": {error}") from None
    return result
