"""MATLAB files: Simulink "Structure with time" and plain numeric arrays."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from smajax.core.names import listed
from smajax.data.readers.mat73_file import read_mat73
from smajax.data.readers.mat_integrity import sound_arrays
from smajax.data.readers.table import Array, MeasuredDataError, Table

_MAGIC = b"MATLAB "


@dataclass
class Signals:
    """What has been read: columns and their clocks, and what the file calls them."""

    columns: dict[str, Array] = field(default_factory=dict)
    clocks: dict[str, Array] = field(default_factory=dict)
    labels: dict[str, str] = field(default_factory=dict)


def _plain(value: Any) -> Any:
    """The content of MATLAB's 1 x 1 boxes; anything else as it is."""
    while isinstance(value, np.ndarray) and value.dtype == object and value.size == 1:
        value = value.ravel()[0]
    return value


def _numbers(value: Any) -> Array | None:
    """A real array of at most two dimensions, one signal a column, shape (n, k); None when it is something else."""
    value = np.asarray(_plain(value))
    if value.dtype.kind not in "fiub":
        return None
    if value.ndim > 2:
        # Simulink logs a vector signal as (width, 1, n).
        value = np.squeeze(value)
        if value.ndim > 2:
            return None
        value = value.T if value.ndim == 2 else value
    if value.ndim < 2 or 1 in value.shape:
        value = value.reshape(-1, 1)
    return np.asarray(value, dtype=np.float64)


def _names(base: str, values: Array) -> list[str]:
    return [base] if values.shape[1] == 1 else [f"{base}[{k}]" for k in range(1, values.shape[1] + 1)]


def _text(value: Any) -> str:
    """MATLAB text; empty for what is none."""
    value = np.asarray(_plain(value))
    return str(value.ravel()[0]).strip() if value.dtype.kind in "US" and value.size == 1 else ""


def _labels(signal: Any, count: int) -> list[str]:
    """What a Scope calls the columns of one of its signals: their labels, else the title of the axes; "" for none."""
    fields = signal.dtype.names or ()
    given = np.asarray(_plain(signal["label"])) if "label" in fields else np.zeros(0)
    labels = [_text(one) for one in given.ravel()] if given.size == count else [""] * count
    title = _text(signal["title"]) if "title" in fields else ""
    return [one or (title if count == 1 else "") for one in labels]


def _field(record: Any, *names: str) -> Any:
    """The field of one of these names, whatever its capitals; None where there is none."""
    return next((record[one] for one in record.dtype.names or () if one.lower() in names), None)


def _add_structure(name: str, value: Any, result: Signals, deeper: bool = True) -> str | None:
    """Adds the signals of one "Structure with time" to `result`; returns why it could not, or None.

    A struct with time and values is one signal, and one of such structs, as logged signals are kept, several (`deeper`).
    """
    fields = value.dtype.names or ()
    if value.size != 1:
        return f"variable {name!r} is a {value.shape} array of structs; expected a single one"
    record = value.ravel()[0]
    if "signals" not in fields:
        time, values = _field(record, "time"), _field(record, "values", "data")
        if time is not None and values is not None:
            return _add(name, _numbers(time), _numbers(values), [], result)
        inside = {one: np.asarray(_plain(record[one])) for one in fields}
        lines = [
            _add_structure(f"{name}.{one}", held, result, False)
            for one, held in inside.items()
            if held.dtype.names and deeper
        ]
        if None in lines:
            return None
        return f"variable {name!r} is a struct with fields {list(fields)}; expected 'time' and 'signals.values'"
    signals = np.asarray(record["signals"])
    inner = signals.dtype.names or ()
    if "values" not in inner or signals.size == 0:
        held = (
            f"has the fields {listed(list(inner))}"
            if inner
            else f"is no struct, but {signals.dtype} of {signals.shape}"
        )
        return f"variable {name!r}: its field 'signals' {held}; expected a struct with 'values'"
    time = _numbers(record["time"]) if "time" in fields else None
    for number, signal in enumerate(signals.ravel(), start=1):
        base = name if signals.size == 1 else f"{name}.{number}"
        values = _numbers(signal["values"])
        wrong = _add(base, time, values, [] if values is None else _labels(signal, values.shape[1]), result)
        if wrong is not None:
            return wrong
    return None


def _add(name: str, time: Array | None, values: Array | None, labels: Sequence[str], result: Signals) -> str | None:
    """Adds one signal, values (n, k); returns why it could not, or None."""
    if values is None:
        return f"variable {name!r}: its field 'signals.values' is not a real array"
    if time is not None and time.size and values.shape[0] != time.size:
        return f"variable {name!r}: {time.size} times and {values.shape[0]} values; expected as many of both"
    names = _names(name, values)
    for column, one in zip(names, values.T, strict=True):
        result.columns[column] = one
        if time is not None and time.size:
            result.clocks[column] = time[:, 0]
    result.labels.update({column: label for column, label in zip(names, labels, strict=False) if label})
    return None


def read_mat(path: Path) -> Table:
    """Reads every numeric signal of a MATLAB file; one of version 7.3 by `read_mat73`.

    A "Structure with time" becomes a column with its own clock; an array (n, k) becomes columns name[1] ... name[k], the
    signals of a Scope with several axes name.1, name.2, ..., those of a struct of signals name.field.
    A variable of another structure is an error only when it is asked for. Raises MeasuredDataError.
    """
    import scipy.io

    with path.open("rb") as file:
        start = file.read(16)
    if start.startswith(b"MATLAB 7.3") or start.startswith(b"\x89HDF"):
        return read_mat73(path)
    if not start.startswith(_MAGIC):
        raise MeasuredDataError(f"{path}: is not the MATLAB version 5 file that its suffix says")
    try:
        sound = sound_arrays(path.read_bytes())
        readable = [name for name, whole in sound.items() if whole and name]
        content = scipy.io.loadmat(path, struct_as_record=True, squeeze_me=False, variable_names=readable)
    except MemoryError:
        raise
    except Exception as error:  # a damaged file raises whatever its bytes happen to lead to
        raise MeasuredDataError(f"{path}: the MATLAB file is damaged or cut short ({error})") from error

    result = Signals()
    columns = result.columns
    unusable: dict[str, str] = {
        name: f"variable {name!r} is or holds an object of MATLAB's (a string, table, time series, function); expected numbers "
        "or a struct: save those"
        for name, whole in sound.items()
        if not whole and name
    }
    for name, raw in content.items():
        if name.startswith("__") or name in unusable:
            continue
        value = np.asarray(_plain(raw))
        if value.dtype.names:
            reason = _add_structure(name, value, result)
            if reason is not None:
                unusable[name] = reason
            continue
        values = _numbers(value)
        if values is None:
            unusable[name] = f"variable {name!r} is an array of {value.dtype}; expected real numbers"
            continue
        columns.update(zip(_names(name, values), values.T, strict=True))
    if not columns:
        raise MeasuredDataError(f"{path}: no signal in it; {'; '.join(unusable.values()) or 'it has no variable'}")
    return Table(path=path, columns=columns, clocks=result.clocks, unusable=unusable, labels=result.labels)
