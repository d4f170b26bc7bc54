"""The reader for each kind of measured file, by suffix."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from pathlib import Path
from types import MappingProxyType

from smajax.core.names import listed, nearest
from smajax.data.readers.csv_file import read_csv
from smajax.data.readers.mat_file import read_mat
from smajax.data.readers.parquet_netcdf import read_netcdf, read_parquet
from smajax.data.readers.table import MeasuredDataError, Table

# Endings of text tables; how one is written its first lines say.
TEXT = (".csv", ".txt", ".tsv", ".tab", ".dat", ".asc", ".log")
# A new file kind is one line here.
READERS: Mapping[str, Callable[[Path], Table]] = MappingProxyType(
    {
        **dict.fromkeys(TEXT, read_csv),
        ".mat": read_mat,
        ".parquet": read_parquet,
        ".nc": read_netcdf,
    }
)


def read_table(path: str | Path, wanted: Collection[str | int] | None = None, decimal: str | None = None) -> Table:
    """Reads one measured file with the reader for its suffix. Raises MeasuredDataError.

    wanted: the columns that will be asked for, by name or number from 1; of a text table no others are kept in memory.
    decimal: what stands before the decimals of a text table, "," or "."; None: as its first lines tell.
    """
    path = Path(path)
    reader = READERS.get(path.suffix.lower())
    if reader is None:
        raise MeasuredDataError(
            f"{path}: files ending in {path.suffix or 'nothing'!r} cannot be read; expected {listed(READERS)}"
        )
    if not path.exists():
        beside = [one.name for one in path.parent.iterdir()] if path.parent.is_dir() else []
        what = f"the folder {path.parent} does not exist" if not path.parent.is_dir() else "there is no such file"
        raise MeasuredDataError(f"{path}: {what}{nearest(path.name, beside)}")
    if not path.is_file():
        raise MeasuredDataError(f"{path}: is a folder; expected a file")
    if path.stat().st_size == 0:
        raise MeasuredDataError(f"{path}: the file is empty")
    try:
        return reader(path) if reader is not read_csv else read_csv(path, wanted, decimal)
    except PermissionError:
        raise MeasuredDataError(f"{path}: may not be read; give yourself the right to (chmod u+r)") from None
