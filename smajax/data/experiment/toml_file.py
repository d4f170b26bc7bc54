"""A file of settings in TOML: its sections, keys and types checked, with errors that name the file and the key."""

from __future__ import annotations

import json
import math
import tomllib
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, TypeAlias, TypeVar

from pydantic import BaseModel, ConfigDict, ValidationError

from smajax.core.display_units import written
from smajax.core.names import close_matches, listed, nearest
from smajax.core.units import parse_quantity
from smajax.data.experiment.errors import ExperimentError

Quantity = str | float
LARGEST = 1 << 20  # bytes of a file of settings
# Part of what the parser says -> what is mostly wrong.
TEXT = "; text stands in quotation marks, as in unit = 'mm' or step = '50 ms', and true and false are written in small letters"
MISTAKES = {"Invalid value": TEXT, "Expected newline or end of document after a statement": TEXT}
LONGEST = 200  # characters of what was got, in a message


def toml_key(name: str) -> str:
    """A key of TOML, in quotation marks where it needs them."""
    bare = name.replace("-", "").replace("_", "")
    return name if bare.isascii() and bare.isalnum() else toml_value(name)


def toml_value(value: str | bool | float | Sequence[str | float]) -> str:
    """Text, a truth value, a number with every digit, or a list of such, as TOML writes it."""
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, str):
        return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
    return repr(value) if isinstance(value, int | float) else f"[{', '.join(map(toml_value, value))}]"


def quantity(value: float, unit: str, like: float | None = None) -> Quantity:
    """A value given in `unit`, one of the program's own, as a file has it: a plain number, or text that is read back as the same float.

    It is in the unit that an engineer would write (that of the value `like`, if given), where that takes no more digits: `75 GPa`.
    """
    number = float(value)
    if unit in ("-", "1", ""):
        return number
    own, shown = repr(number), written(unit, number if like is None else like)
    if shown.unit != unit and math.isfinite(number):
        for places in (15, 16, 17):
            text = f"{shown.of(number):.{places}g}"
            if _places(text) <= _places(own) and parse_quantity(f"{text} {shown.unit}", unit) == number:
                return f"{text} {shown.unit}"
    return f"{own.removesuffix('.0')} {unit}"


def _places(number: str) -> int:
    """Significant digits of a number as text."""
    mantissa = number.lstrip("+-").split("e")[0]
    return len(mantissa.replace(".", "").strip("0"))


class Section(BaseModel):
    """A table of the file: only the keys written here, each with what is expected of it."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)


Whole = TypeVar("Whole", bound=Section)
# Sections by place in the file; "*" stands for any name or number, () for the whole. None: a key, where "*" would make it a section.
Places: TypeAlias = Mapping[tuple[str, ...], type[Section] | None]


def _section_at(place: Sequence[str | int], places: Places) -> type[Section] | None:
    for pattern, section in places.items():
        if len(pattern) == len(place) and all(p in ("*", str(k)) for p, k in zip(pattern, place, strict=True)):
            return section
    return None


def _key_path(place: Sequence[str | int], content: dict[str, Any]) -> str:
    """`runs.Step02.role` for ("runs", 1, "role"); an entry of a list without a name is counted from 1."""
    parts = [str(part) for part in place]
    if len(place) > 1 and isinstance(place[1], int):
        entry = content[str(place[0])][place[1]]
        name = entry.get("name") if isinstance(entry, dict) else None
        parts[1] = name if isinstance(name, str) and name else f"[{place[1] + 1}]"
    return ".".join(parts)


def _depth(place: Sequence[str | int], places: Places) -> int:
    """How many parts of a pydantic location are keys of the file; the rest names members of a union."""
    sections = [n for n in range(len(place) + 1) if _section_at(place[:n], places) is not None]
    return min(len(place), sections[-1] + 1)


def _table(place: Sequence[str | int], depth: int, around: type[Section] | None, places: Places) -> str:
    """What is expected of an entry that has a section of its own; its name may be that of another key, misspelled."""
    own = _section_at(place[:depth], places)
    if own is None or around is None:
        return "expected a section"
    return f"expected a table with {listed(own.model_fields)}{nearest(str(place[depth - 1]), around.model_fields)}"


def _message(error: Any, content: dict[str, Any], places: Places) -> tuple[str, str]:
    """(key path, message) of one pydantic error."""
    place = tuple(error["loc"])
    depth = _depth(place, places)
    section = _section_at(place[: depth - 1], places) if depth else None
    field = section.model_fields.get(str(place[depth - 1])) if section is not None and depth else None
    expected = f"expected {field.description}" if field is not None else _table(place, depth, section, places)
    # One step further for the entries of a table (parameters, files, inputs) and of a list.
    entry = len(place) > depth and isinstance(error["input"], str | int | float | bool | list | dict)
    table = field is not None and any(word in str(field.annotation) for word in ("dict[", "list[", "Mapping["))
    key = _key_path(place[: depth + 1] if entry and table else place[:depth], content)
    match error["type"]:
        case "extra_forbidden":
            known = list(section.model_fields) if section is not None else []
            return key, f"is not a known key{close_matches(str(place[depth - 1]), known, 'known here')}"
        case "missing":
            return key, f"is missing; {expected}"
        case "value_error":
            return key, str(error["ctx"]["error"])
        case "too_short" | "string_too_short":
            return key, f"is empty; {expected}"
    return key, f"got {shortened(repr(error['input']))}, {expected}"


def shortened(text: str) -> str:
    """What a file holds, as far as a message needs it."""
    return text if len(text) <= LONGEST else f"{text[:LONGEST]}..."


def read_toml(path: Path, what: str, folder: str = "", hint: str = "") -> dict[str, Any]:
    """The content of a file of settings.

    `what`: "an experiment file"; `folder`: what may be given in its place; `hint`: what to do about a file that is none. Raises
    ExperimentError.
    """
    try:
        if path.exists() and not path.is_file():
            raise ExperimentError(path, "", f"is no file; expected {what}{folder}")
        if path.stat().st_size > LARGEST:
            raise ExperimentError(path, "", f"is larger than {LARGEST:,} bytes; expected {what}, not the data")
        return tomllib.loads(path.read_text(encoding="utf-8-sig"))
    except FileNotFoundError as error:
        raise ExperimentError(path, "", f"there is no such file; expected {what}") from error
    except OSError as error:
        raise ExperimentError(path, "", f"cannot be read ({error.strerror})") from error
    except UnicodeDecodeError as error:
        raise ExperimentError(path, "", f"is not UTF-8 text ({error.reason} at byte {error.start}){hint}") from error
    except (ValueError, RecursionError) as error:
        # Beside its own error the parser lets through those of numbers too long and of brackets too deep.
        if isinstance(error, ExperimentError):
            raise
        bare = next((hint for part, hint in MISTAKES.items() if part in str(error)), "")
        raise ExperimentError(path, "", f"is not TOML: {shortened(str(error))}{bare}{hint}") from error


def validated(path: Path, content: dict[str, Any], whole: type[Whole], places: Places) -> Whole:
    """The content as its sections. Raises ExperimentError naming the file and the keys."""
    try:
        return whole.model_validate(content)
    except ValidationError as error:
        result = dict.fromkeys(_message(one, content, places) for one in error.errors())
        # A union reports once per member, and an unknown key may be why another is missing: the typo comes first.
        ordered = sorted(result, key=lambda one: "not a known key" not in one[1])
        first, *others = ordered
        more = "".join(f"\n{path}: {key}: {message}" for key, message in others[:4])
        raise ExperimentError(path, first[0], first[1] + more) from None
