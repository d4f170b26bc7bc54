"""Files that are there whole or not at all."""

from __future__ import annotations

import csv
import io
import json
import math
import os
import tempfile
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import IO, TYPE_CHECKING, Any

if TYPE_CHECKING:
    import xarray as xr

UNFINISHED = ".part"  # the end of a hidden file that is being written, or was when its program was killed


@contextmanager
def writing(path: Path) -> Iterator[IO[bytes]]:
    """A file to write into, which becomes `path` in one step when all is written; if anything fails, `path` is as before."""
    # In the same folder, because a rename is one step only within one file system.
    handle, name = tempfile.mkstemp(dir=path.parent, prefix=f".{path.name}.", suffix=UNFINISHED)
    try:
        with os.fdopen(handle, "wb") as file:
            yield file
            file.flush()
            os.fsync(file.fileno())  # else a power cut may leave the new name with nothing behind it
        os.chmod(name, 0o644)  # mkstemp makes a file for its owner alone
        os.replace(name, path)
    except BaseException:
        Path(name).unlink(missing_ok=True)
        raise


def replace(path: Path, content: str | bytes) -> Path:
    """Write `content`, text as UTF-8, to `path` in one step; the path."""
    with writing(path) as file:
        file.write(content.encode("utf-8") if isinstance(content, str) else content)
    return path


def sweep_up(folder: Path) -> None:
    """Take away what killed programs left half written in `folder` and below it; nobody else may be writing there."""
    for one in folder.rglob(f".*{UNFINISHED}"):
        if one.is_file():
            with suppress(OSError):
                one.unlink()


def _finite(part: Any) -> Any:
    if isinstance(part, dict):
        return {key: _finite(one) for key, one in part.items()}
    if isinstance(part, list | tuple):
        return [_finite(one) for one in part]
    return None if isinstance(part, float) and not math.isfinite(part) else part


def json_text(value: Any) -> str:
    """JSON in which a number that is none is null."""
    return json.dumps(_finite(value), indent=2, ensure_ascii=False, allow_nan=False) + "\n"


def json_line(value: Any) -> str:
    """The same in one line, for an attribute."""
    return json.dumps(_finite(value), ensure_ascii=False, allow_nan=False)


def csv_text(head: Sequence[str], rows: Iterable[Sequence[object]]) -> str:
    """A text table under one line of headings; numbers with ten digits, an empty cell for None and what is no number."""

    def cell(value: object) -> object:
        if isinstance(value, float):
            return f"{value:.10g}" if math.isfinite(value) else ""
        return "" if value is None else value

    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(head)
    writer.writerows([cell(value) for value in row] for row in rows)
    return text.getvalue()


def heading(name: str, unit: str) -> str:
    """`temperature [degC]`, as `smajax` reads it back; a plain number has the unit 1."""
    return f"{name} [{'1' if unit in ('-', '') else unit}]"


def as_netcdf(result: xr.Dataset) -> bytes:
    """NetCDF 3, which every reader knows."""
    return bytes(result.to_netcdf(engine="scipy"))
