"""MATLAB version 7.3 files, which are HDF5: plain arrays and Simulink "Structure with time"."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from smajax.measured.extras import needed
from smajax.measured.table import Array, MeasuredDataError, Table

LARGEST = 1 << 29  # numbers of one variable, 4 GiB
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


def _structure(name: str, node: Any) -> tuple[Array | None, Array | str]:
    """(time, values) of a "Structure with time", or why it is none in the place of the values."""
    signals = node.get("signals")
    if signals is None or not hasattr(signals, "keys") or "values" not in signals:
        return None, f"variable {name!r} is a struct with fields {sorted(node)}; expected 'time' and 'signals.values'"
    values = _numbers(signals["values"])
    if values is None:
        return None, f"variable {name!r}: its field 'signals.values' is not one real array"
    time = _numbers(node["time"]) if "time" in node else None
    if time is not None and len(time) != len(values):
        return None, f"variable {name!r}: {len(time)} times and {len(values)} values; expected as many of both"
    return time, values


def read_mat73(path: Path) -> Table:
    """Reads every numeric signal, named as `read_mat` names those of a version 5 file. Raises MeasuredDataError."""
    h5py = needed("h5py", path, "or save it again with save(..., '-v7')")
    columns: dict[str, Array] = {}
    clocks: dict[str, Array] = {}
    unusable: dict[str, str] = {}
    try:
        with h5py.File(path, "r") as file:
            for name, node in file.items():
                if name.startswith("#"):
                    continue
                time, found = _structure(name, node) if hasattr(node, "keys") else (None, _numbers(node))
                if found is None or isinstance(found, str):
                    unusable[name] = found or f"variable {name!r} holds no real numbers"
                    continue
                names = [name] if found.shape[1] == 1 else [f"{name}[{k}]" for k in range(1, found.shape[1] + 1)]
                columns.update(zip(names, found.T, strict=True))
                if time is not None:
                    clocks.update(dict.fromkeys(names, time[:, 0]))
    except MemoryError:
        raise
    except Exception as error:  # a damaged file raises whatever its bytes happen to lead to
        raise MeasuredDataError(f"{path}: the MATLAB 7.3 file is damaged or cut short ({error})") from error
    if not columns:
        raise MeasuredDataError(f"{path}: no signal in it; {'; '.join(unusable.values()) or 'it has no variable'}")
    return Table(path=path, columns=columns, clocks=clocks, unusable=unusable)
