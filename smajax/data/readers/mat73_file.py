"""MATLAB version 7.3 files, which are HDF5: plain arrays and Simulink "Structure with time"."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from smajax.data.readers.optional_packages import needed
from smajax.data.readers.table import Array, MeasuredDataError, Table

LARGEST = 1 << 29  # numbers of one variable, 4 GiB
LONGEST = 1 << 12  # characters of a label, signals of one Scope
NUMBERS = {"double", "single", "logical", *(f"{sign}int{bits}" for sign in ("", "u") for bits in (8, 16, 32, 64))}


def _numbers(node: Any) -> Array | None:
    """A dataset as one signal a column, shape (n, k); MATLAB's first axis is the file's last. None for what is no number."""
    kind = node.attrs.get("MATLAB_class", b"double") if hasattr(node, "dtype") else b""
    if (kind.decode() if isinstance(kind, bytes) else str(kind)) not in NUMBERS or node.attrs.get("MATLAB_empty", 0):
        return None
    if node.size is None or node.size > LARGEST:  # a few bytes of a file may declare any size
        return None
    values = np.squeeze(np.asarray(node[()]))
    if values.dtype.kind not in "fiub" or values.ndim > 2:
        return None
    values = values.reshape(-1, 1) if values.ndim < 2 else values.T
    return np.asarray(values, dtype=np.float64)


def _text(node: Any) -> str:
    """MATLAB text, which is a row of UTF-16 codes; empty for what is none."""
    kind = node.attrs.get("MATLAB_class", b"") if hasattr(node, "dtype") else b""
    if kind not in (b"char", "char") or node.size is None or node.size > LONGEST or node.dtype.kind not in "iu":
        return ""
    return "".join(map(chr, np.asarray(node[()]).T.ravel())).strip("\0 ")


def _each(file: Any, node: Any) -> list[Any]:
    """The elements of a field of a struct array; of a single struct, the field itself."""
    refers = getattr(node, "dtype", None)
    if refers is None or refers.kind != "O" or node.size > LONGEST:
        return [node]
    return [file[reference] for reference in np.asarray(node[()]).ravel()]


def _signals(file: Any, name: str, node: Any, deeper: bool = True) -> list[tuple[str, Array | None, Array, str]] | str:
    """(name, time, values (n, k), label) of each signal of a "Structure with time", or why it is none.

    Structs without `signals` are taken as `read_mat` takes those of a version 5 file.
    """
    signals = node.get("signals")
    if signals is None:
        by_small = {one.lower(): node[one] for one in node}
        if "time" in by_small and ("values" in by_small or "data" in by_small):
            values = by_small.get("values", by_small.get("data"))
            return _one(name, _numbers(by_small["time"]), values, "")
        if deeper:
            inside = [_signals(file, f"{name}.{one}", node[one], False) for one in node if hasattr(node[one], "keys")]
            result = [signal for several in inside if not isinstance(several, str) for signal in several]
            if result:
                return result
    if signals is None or not hasattr(signals, "keys") or "values" not in signals:
        return f"variable {name!r} is a struct with fields {sorted(node)}; expected 'time' and 'signals.values'"
    time = _numbers(node["time"]) if "time" in node else None
    each = _each(file, signals["values"])
    labels, titles = (
        [_text(one) for one in _each(file, signals[key])] if key in signals else [] for key in ("label", "title")
    )
    several: list[tuple[str, Array | None, Array, str]] = []
    for k, values in enumerate(each):
        label = next((one[k] for one in (labels, titles) if len(one) == len(each) and one[k]), "")
        read = _one(name if len(each) == 1 else f"{name}.{k + 1}", time, values, label)
        if isinstance(read, str):
            return read
        several += read
    return several


def _one(name: str, time: Array | None, node: Any, label: str) -> list[tuple[str, Array | None, Array, str]] | str:
    values = _numbers(node)
    if values is None:
        return f"variable {name!r}: its field 'signals.values' is not one real array"
    if time is not None and len(time) != len(values):
        return f"variable {name!r}: {len(time)} times and {len(values)} values; expected as many of both"
    return [(name, time, values, label)]


def read_mat73(path: Path) -> Table:
    """Reads every numeric signal, named as `read_mat` names those of a version 5 file. Raises MeasuredDataError."""
    h5py = needed("h5py", path, "or save it again with save(..., '-v7')")
    columns: dict[str, Array] = {}
    clocks: dict[str, Array] = {}
    labels: dict[str, str] = {}
    unusable: dict[str, str] = {}
    try:
        with h5py.File(path, "r") as file:
            for name, node in file.items():
                if name.startswith("#"):
                    continue
                result: list[tuple[str, Array | None, Array, str]] | str = f"variable {name!r} holds no real numbers"
                if hasattr(node, "keys"):
                    result = _signals(file, name, node)
                elif (plain := _numbers(node)) is not None:
                    result = [(name, None, plain, "")]
                if isinstance(result, str):
                    unusable[name] = result
                    continue
                for own, time, values, label in result:
                    names = [own] if values.shape[1] == 1 else [f"{own}[{k}]" for k in range(1, values.shape[1] + 1)]
                    columns.update(zip(names, values.T, strict=True))
                    if time is not None:
                        clocks.update(dict.fromkeys(names, time[:, 0]))
                    if label and len(names) == 1:
                        labels[own] = label
    except MemoryError:
        raise
    except Exception as error:  # a damaged file raises whatever its bytes happen to lead to
        raise MeasuredDataError(f"{path}: the MATLAB 7.3 file is damaged or cut short ({error})") from error
    if not columns:
        raise MeasuredDataError(f"{path}: no signal in it; {'; '.join(unusable.values()) or 'it has no variable'}")
    return Table(path=path, columns=columns, clocks=clocks, unusable=unusable, labels=labels)
