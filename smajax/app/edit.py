"""Single values of an experiment file, changed in place: its comments, its order and what no page shows stay as they are.

Fields of the forms are named by the key that the commands use in their errors (`channels.voltage.unit`, `runs.ramp.role`), so that an
error of the file finds its field.
"""

from __future__ import annotations

import threading
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import tomlkit
from tomlkit.exceptions import TOMLKitError

from smajax.core.files import replace
from smajax.data.experiment.column_guess import GUESS, LIKELY, SURE, TIME
from smajax.data.experiment.errors import ExperimentError

Form = Mapping[str, str]
ON = "on"
# Begins of comments in which a draft says why a value is what it is; the last one stood behind the role of a run.
REASONS = (f"# {SURE}:", f"# {LIKELY}:", f"# {GUESS}", "# not fitted: the error on it validates the model")
_WRITING = threading.Lock()


def edited(path: Path, change: Callable[[tomlkit.TOMLDocument], None]) -> None:
    """Change the experiment file at `path`. Raises ExperimentError where it is not TOML."""
    with _WRITING:
        document = parsed(path)
        change(document)
        replace(path, tomlkit.dumps(document))


def parsed(path: Path) -> tomlkit.TOMLDocument:
    """The experiment file at `path`, with its comments. Raises ExperimentError where it is not TOML."""
    try:
        return tomlkit.parse(path.read_text(encoding="utf-8-sig"))
    except (TOMLKitError, UnicodeDecodeError) as error:
        raise ExperimentError(path, "", f"is not TOML: {error}") from None


def put(table: Any, keys: tuple[str, ...], value: Any) -> None:
    """Set the value at these keys, or remove it where it is "" or None; tables on the way are made."""
    *way, last = keys
    for key in way:
        if key not in table:
            if value in ("", None):
                return
            table[key] = tomlkit.table()
        table = table[key]
    if value in ("", None):
        table.pop(last, None)
    elif table.get(last) != value:
        table[last] = value
        _without_reason(table[last])


def _without_reason(item: Any) -> None:
    """The draft's reason behind a value, or behind the heading of a table, goes with the value; a person's comment stays."""
    if item.trivia.comment.startswith(REASONS):
        item.trivia.comment_ws = item.trivia.comment = ""


def number_or_text(text: str) -> int | str:
    """A column as an experiment file names it: `3` is the third one, anything else a heading."""
    return int(text) if text.isdigit() else text


def set_channels(document: tomlkit.TOMLDocument, form: Form, outputs: frozenset[str], own: Mapping[str, str]) -> None:
    """`column.KEY` = the quantity that a column is, "" for none. outputs: quantities that a sensor shows. own: units by column, as guessed."""
    channels = document.setdefault("channels", tomlkit.table(is_super_table=True))
    for field, quantity in form.items():
        if not field.startswith("column."):
            continue
        text = field.removeprefix("column.")
        key = number_or_text(text)
        _forget(document, channels, key)
        if quantity == TIME:
            document["time"] = {"column": key, "unit": own.get(text) or "s"}
            if "sampling" not in document:
                document["sampling"] = {"step": "50 ms"}
        elif quantity:
            role = "output" if quantity in outputs else "input"
            before = channels.get(quantity, {})
            entry = tomlkit.table()
            entry["role"] = role
            entry["column"] = key
            entry["unit"] = own.get(text) or before.get("unit") or "1"
            if role == "output":
                entry["noise"] = before.get("noise", "estimate")
            channels[quantity] = entry


def _forget(document: tomlkit.TOMLDocument, channels: Any, key: int | str) -> None:
    """No channel, and no time, is this column any more."""
    for name in [name for name, one in channels.items() if key in (one.get("column"), one.get("variable"))]:
        del channels[name]
    if "time" in document and document["time"].get("column") == key:
        document["time"] = {"kind": "sample"}
        document.pop("sampling", None)


def set_channel_values(document: tomlkit.TOMLDocument, form: Form) -> None:
    """`channels.NAME.unit`, `.noise` and `.reversed`; `time.unit`; `sampling.step`; `data.decimal`; `title`."""
    for field, value in form.items():
        match field.split("."):
            case ["channels", name, ("unit" | "noise") as what] if name in document.get("channels", {}):
                channel = document["channels"][name]
                before = channel.get(what)
                put(channel, (what,), value.strip() or ("1" if what == "unit" else ""))
                if what == "unit" and channel.get(what) != before:
                    _without_reason(channel)
            case ["channels", name, "reversed"] if name in document.get("channels", {}):
                put(document["channels"][name], ("reversed",), True if value == ON else None)
            case ["time", "unit"] | ["sampling", "step"] | ["data", "decimal"]:
                put(document, tuple(field.split(".")), value.strip())
            case ["nuisance", "offset"]:
                put(document, ("nuisance", "offset"), value == ON)
            case ["title"]:
                put(document, ("title",), value.strip())


def set_parameters(document: tomlkit.TOMLDocument, form: Form) -> None:
    """`model.parameters.NAME` = a value with its unit, "" for the preset's."""
    for field, value in form.items():
        if name := field.removeprefix("model.parameters.") if field.startswith("model.parameters.") else "":
            put(document, ("model", "parameters", name), value.strip())
            if value.strip():
                no_prior(document, name)


def no_prior(document: tomlkit.TOMLDocument, name: str) -> None:
    """Without the prior of a value that is known, or an unknown, from here on."""
    put(document, ("priors", "presets", name), None)
    if not document.get("priors", {}).get("presets", True):
        document["priors"].pop("presets")


def set_unknowns(document: tomlkit.TOMLDocument, form: Form, fresh: Callable[[str], Mapping[str, str]]) -> None:
    """`unknown.NAME.low`, `.high`, `.start`; `unknown.NAME.free` = on or off. fresh: bounds of one that becomes unknown."""
    for field, value in form.items():
        name, _, what = field.removeprefix("unknown.").rpartition(".")
        if not field.startswith("unknown.") or not name:
            continue
        table = document.setdefault("unknown", tomlkit.table())
        if what == "free" and value != ON:
            table.pop(name, None)
        elif what == "free" and name not in table:
            box = tomlkit.inline_table()
            box.update(fresh(name))
            table[name] = box
            put(document, ("model", "parameters", name), None)
            no_prior(document, name)
        elif what in ("low", "high", "start") and name in table:
            table[name][what] = value.strip()


def set_runs(document: tomlkit.TOMLDocument, form: Form) -> None:
    """`runs.NAME.role`, `.start`, `.end`, `.inputs.INPUT` and `.parameters.PARAMETER`."""
    for run in document.get("runs", []):
        prefix = f"runs.{run['name']}."
        for field, value in form.items():
            if not field.startswith(prefix):
                continue
            match field.removeprefix(prefix).split(".", 1):
                case ["role"] if value in ("fit", "held-out"):
                    put(run, ("role",), value)
                case [("start" | "end") as what]:
                    put(run, (what,), value.strip())
                case [("inputs" | "parameters") as what, name]:
                    _put_inline(run, what, name, value.strip())


def _put_inline(run: Any, what: str, name: str, value: str) -> None:
    """An entry of a table in one line, `inputs = { mass = "500 g" }`; none is left empty."""
    if what not in run:
        if not value:
            return
        run[what] = tomlkit.inline_table()
    if run[what].get(name) != value:
        _without_reason(run[what])
    put(run[what], (name,), value)
    if not run[what]:
        del run[what]


def set_effects(document: tomlkit.TOMLDocument, only: list[str] | None) -> None:
    """`[effects] only`, or none of it where every effect may be tried."""
    if only is None:
        effects = document.get("effects")
        if effects is not None:
            effects.pop("only", None)
            if not effects:
                del document["effects"]
        return
    put(document, ("effects", "only"), only)


def carried_over(old: tomlkit.TOMLDocument, new: tomlkit.TOMLDocument) -> None:
    """Put into a new draft what the person said in the old file, as far as the new one has a place for it."""
    for name in ("title", "effects", "priors", "nuisance"):
        if name in old:
            new[name] = old[name]
    for name, before in old.get("channels", {}).items():
        after = new.get("channels", {}).get(name)
        if after is not None and after.get("column", after.get("variable")) == before.get(
            "column", before.get("variable")
        ):
            for what in ("unit", "noise", "reversed", "missing", "offset"):
                if what in before:
                    after[what] = before[what]
    counted = old.get("time", {}).get("kind") == "sample"  # then the one says what the other means
    if counted and "time" in new:
        new.pop("sampling", None)
    for name in ("time", "sampling"):
        if name in old and ("time" if counted else name) in new and old[name] != new.get(name):
            new[name] = old[name]
    if "decimal" in old.get("data", {}):  # its folder is that of the logs now
        new["data"]["decimal"] = old["data"]["decimal"]
    same_wire = old.get("model", {}).get("wire") == new.get("model", {}).get("wire")
    if same_wire and "unknown" in old:
        gone = set(old.get("model", {}).get("parameters", {}))
        for name, box in old["unknown"].items():
            if name in new.get("unknown", {}) or name in gone:
                new["unknown"][name] = box
    before_runs = {run["name"]: run for run in old.get("runs", [])}
    for run in new.get("runs", []):
        for what in ("role", "start", "end", "inputs", "parameters"):
            if what in before_runs.get(run["name"], {}):
                run[what] = before_runs[run["name"]][what]
